from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from fras_supervisor.order import ended_before, find_cycle, start_order, topological
from fras_supervisor.table import Process

NAMES = [f"p{index}" for index in range(8)]


@st.composite
def acyclic(draw: st.DrawFn) -> dict[str, tuple[str, ...]]:
    ranked = draw(st.permutations(NAMES))
    edges = {
        name: tuple(draw(st.lists(st.sampled_from(ranked[:rank]), unique=True))) if rank else ()
        for rank, name in enumerate(ranked)
    }
    return {name: edges[name] for name in draw(st.permutations(NAMES))}


graphs = st.dictionaries(
    st.sampled_from(NAMES), st.lists(st.sampled_from(NAMES), unique=True), min_size=1
).map(lambda edges: {name: edges.get(name, []) for name in NAMES})


@given(acyclic())
def test_each_name_comes_after_all_that_come_before_it(before: dict[str, tuple[str, ...]]) -> None:
    order = topological(before)
    place = {name: index for index, name in enumerate(order)}
    assert sorted(order) == sorted(before)
    assert all(place[one] < place[name] for name in before for one in before[name])
    assert find_cycle(before) == ()


@given(acyclic())
def test_order_is_stable(before: dict[str, tuple[str, ...]]) -> None:
    order = topological(before)
    given_place = {name: index for index, name in enumerate(before)}
    for index, name in enumerate(order):
        done = set(order[:index])
        free = [one for one in before if one not in done and done.issuperset(before[one])]
        assert name == min(free, key=given_place.__getitem__)


@given(graphs)
def test_a_cycle_that_is_found_is_one_and_none_found_means_sortable(
    before: dict[str, list[str]],
) -> None:
    ring = find_cycle(before)
    if ring:
        assert ring[0] == ring[-1]
        assert all(other in before[one] for one, other in pairwise(ring))
    else:
        assert len(topological(before)) == len(before)


@given(acyclic())
def test_stopping_reverses_needs(needs: dict[str, tuple[str, ...]]) -> None:
    rows = {name: Process(name=name, command=("x",), needs=needs[name]) for name in needs}
    assert topological(ended_before(rows)) == tuple(reversed(start_order(rows)))


def test_an_outliver_ends_after_those_it_outlives() -> None:
    rows = {
        "router": Process(name="router", command=("x",)),
        "recorder": Process(
            name="recorder", command=("x",), needs=("router",), outlives=("sim", "sa")
        ),
        "sim": Process(name="sim", command=("x",), needs=("router",)),
        "sa": Process(name="sa", command=("x",), needs=("router",)),
    }
    assert start_order(rows) == ("router", "recorder", "sim", "sa")
    assert topological(ended_before(rows)) == ("sa", "sim", "recorder", "router")
