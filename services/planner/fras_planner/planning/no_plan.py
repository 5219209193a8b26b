"""Which rules together leave no plan."""

from collections.abc import Mapping, Sequence

import clingo


def minimal_core(
    control: clingo.Control, rules: Mapping[str, int], given: Sequence[int] = ()
) -> list[str]:
    """Find rules that leave no plan, none of which can be spared.

    The solver's own core is a first guess; each rule is then lifted in turn, and stays lifted if
    there is still no plan (deletion: Marques-Silva, ISMVL 2010).

    Parameters
    ----------
    control : clingo.Control
        Without a plan while all rules are assumed; not optimising.
    rules : mapping of str to int
        Literal of `enforced(Rule)` by the rule's name.
    given : sequence of int
        Literals that are assumed throughout and never blamed.

    Returns
    -------
    list of str
        In alphabetical order. Empty if there is no plan even without any of the rules.
    """
    core = sorted(_core(control, rules, list(rules), given) or [])
    for rule in list(core):
        without = [other for other in core if other != rule]
        smaller = _core(control, rules, without, given)
        if smaller is not None:
            core = sorted(smaller)
    return core


def _core(
    control: clingo.Control, rules: Mapping[str, int], names: list[str], given: Sequence[int]
) -> list[str] | None:
    """Rules blamed for there being no plan under `names`; None if there is one, or no proof."""
    blamed: list[int] = []
    assumed = [*given, *(rules[name] for name in names)]
    result = control.solve(assumed, on_core=blamed.extend)
    if not result.unsatisfiable:
        return None
    return [name for name in names if rules[name] in blamed]
