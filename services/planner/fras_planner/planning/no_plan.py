"""Which rules together leave no plan."""

from collections.abc import Mapping, Sequence

from fras_planner.planning.search import Search


def minimal_core(search: Search, rules: Mapping[str, int], given: Sequence[int] = ()) -> list[str]:
    """Find rules that leave no plan, none of which can be spared.

    The solver's own core is a first guess; each rule is then lifted in turn, and stays lifted if
    there is still no plan (deletion: Marques-Silva, ISMVL 2010).

    Parameters
    ----------
    search : Search
        Of a Control without a plan while all rules are assumed; not optimising.
    rules : mapping of str to int
        Literal of `enforced(Rule)` by the rule's name.
    given : sequence of int
        Literals that are assumed throughout and never blamed.

    Returns
    -------
    list of str
        In alphabetical order. Empty if there is no plan even without any of the rules.

    Raises
    ------
    OutOfTime
    """
    core = sorted(_core(search, rules, list(rules), given) or [])
    for rule in list(core):
        without = [other for other in core if other != rule]
        smaller = _core(search, rules, without, given)
        if smaller is not None:
            core = sorted(smaller)
    return core


def _core(
    search: Search, rules: Mapping[str, int], names: list[str], given: Sequence[int]
) -> list[str] | None:
    """Rules blamed for there being no plan under `names`; None if there is one, or no proof."""
    assumed = [*given, *(rules[name] for name in names)]
    result, blamed = search(assumed)
    if not result.unsatisfiable:
        return None
    return [name for name in names if rules[name] in blamed]
