"""Chaos: trials with faults drawn from a seed, and what must hold all the same.

`draw` says what happens when, `invariants` what must hold, `recovery` how long it took; all three
are pure. `stage` keeps a stack, `injector` and `hands` disturb it, `evidence` reads a log,
`campaign` does the round, `report` and `figure` tell it.
"""
