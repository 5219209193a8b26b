"""The rules of preferences/*.lp, one by one: distances in, what a block is worth out."""

import pytest

from fras_planner.planning import Knowledge
from planner.mutants import models

MEASURED = (
    "roi_distance(b(1,1),7). nearest_attachment(b(1,1),20)."
    "attachment_distance_sum(b(1,1),100). attachment_distance_set_sum(b(1,1),60). "
)


WORTH = {
    "sum": {"preference(b(1,1),93,1)"},
    "literal": {"preference(b(1,1),53,1)"},
    "lex": {"preference(b(1,1),100,1)", "preference(b(1,1),-7,2)"},
    "nearest": {"preference(b(1,1),20,1)", "preference(b(1,1),-7,2)"},
    "weighted": {"preference(b(1,1),33,1)"},
    "capped": {"preference(b(1,1),33,1)"},
}


@pytest.mark.parametrize(("gap", "worth"), [(24, 41), (25, 43), (26, 43), (90, 43)])
def test_what_is_farther_than_enough_counts_no_more(
    knowledge: Knowledge, gap: int, worth: int
) -> None:
    facts = f"roi_distance(b(1,1),7). nearest_attachment(b(1,1),{gap})."
    (atoms,) = models(knowledge, ["preferences/capped.lp"], facts)
    assert f"preference(b(1,1),{worth},1)" in atoms


@pytest.mark.parametrize("criterion", WORTH)
def test_preference(knowledge: Knowledge, criterion: str) -> None:
    (atoms,) = models(knowledge, [f"preferences/{criterion}.lp"], MEASURED)
    assert {atom for atom in atoms if atom.startswith("preference(")} == WORTH[criterion]


def test_every_criterion_has_its_test(knowledge: Knowledge) -> None:
    assert set(knowledge.criteria) == set(WORTH)
