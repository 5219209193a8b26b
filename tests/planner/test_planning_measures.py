"""Whole millimetres: rounding, sums, and what an empty set of attachments gives."""

import numpy as np
import pytest

from fras_planner.planning import PlanningScene
from fras_planner.planning.measures import measures, whole_mm


@pytest.mark.parametrize(
    ("metres", "mm"),
    [(0.0, 0), (0.0004999, 0), (0.0005, 1), (0.0124999, 12), (0.0125, 13), (0.0135, 14)],
)
def test_half_millimetres_round_up(metres: float, mm: int) -> None:
    assert whole_mm(np.array([metres])).tolist() == [mm]


def test_noise_does_not_decide_a_half() -> None:
    # Centres of an 8 x 8 grid over 100 mm: neighbours are 12.5 mm apart, give or take a bit.
    centres = (np.arange(1, 9) - 0.5) * 0.1 / 8
    assert set(whole_mm(np.diff(centres)).tolist()) == {13}


def test_measures_of_a_small_scene() -> None:
    names = ["b(1,1)", "b(1,2)", "b(2,1)"]
    rows = [(0.0, 0.0, 0.003), (0.0, 0.01, 0.003), (0.01, 0.0, 0.007)]
    scene = PlanningScene.make(names, rows, (0.0, 0.02, -0.5), [])
    assert measures(scene, ["b(1,2)", "b(2,1)"], sums=True) == {
        "roi_distance": [20, 10, 22],
        "nearest_attachment": [10, 0, 0],
        # sqrt(10^2 + 4^2) = 10.8 -> 11; sqrt(10^2 + 10^2 + 4^2) = 14.7 -> 15.
        "attachment_distance_sum": [21, 15, 15],
        "attachment_distance_set_sum": [21, 15, 15],
    }
    far = measures(scene, ["b(1,2)"], sums=False)
    assert far == {"roi_distance": [20, 10, 22], "nearest_attachment": [10, 0, 15]}
    none = measures(scene, [], sums=True)
    assert none["nearest_attachment"] == none["attachment_distance_sum"] == [0, 0, 0]


def test_equal_distances_count_once_in_the_set() -> None:
    names = ["b(1,1)", "b(1,2)", "b(1,3)"]
    rows = [(0.0, 0.0, 0.0), (0.0, 0.01, 0.0), (0.0, 0.02, 0.0)]
    scene = PlanningScene.make(names, rows, (0.0, 0.0, 0.0), [])
    found = measures(scene, ["b(1,1)", "b(1,3)"], sums=True)
    assert found["attachment_distance_sum"] == [20, 20, 20]
    assert found["attachment_distance_set_sum"] == [20, 10, 20]
