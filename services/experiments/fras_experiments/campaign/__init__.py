"""Campaigns: many trials of a scenario whose fields vary, over real stacks, kept as they come.

`spec` says which trials there are, and is pure; `reading` gets a campaign from its file. `measure`
makes numbers of a trial's log. `store` keeps them, `tables` writes them out. `keeper` is what a
worker does, `cluster` where workers come from, `rounds` hands the trials out, `progress` and
`command` are for people.
"""
