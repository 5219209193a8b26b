"""Two halves at once: both done, failures come back, and nothing depends on it."""

import multiprocessing
import threading

import numpy as np
import pytest

from fras_sim.fem import TissueParameters, TissueSimulator, ToolInput, box_mesh
from fras_sim.fem.second_core import SecondCore


def test_both_are_done_at_the_same_time():
    """Each half waits for the other: one after the other would never end."""
    core, met = SecondCore(), 0
    for _ in range(100):
        meeting = threading.Barrier(2, timeout=10.0)
        core.run(meeting.wait, meeting.wait)
        met += not meeting.broken
    assert met == 100


@pytest.mark.parametrize("side", ["here", "there"])
def test_a_failure_of_either_half_comes_back_and_the_next_work_is_done(side):
    core, done = SecondCore(), []

    def fail():
        raise ValueError(side)

    works = {"here": lambda: done.append("here"), "there": lambda: done.append("there")}
    with pytest.raises(ValueError, match=side):
        core.run(**{**works, side: fail})
    assert done == [other for other in works if other != side]
    core.run(**works)
    assert sorted(done[1:]) == ["here", "there"]


def test_work_within_work_and_from_another_thread_is_done_one_after_the_other():
    core, done = SecondCore(), []

    def use(name):
        core.run(lambda: done.append(f"{name} here"), lambda: done.append(f"{name} there"))

    def from_another_thread():
        other = threading.Thread(target=use, args=("other",))
        other.start()
        other.join()

    core.run(lambda: use("within"), from_another_thread)
    assert sorted(done) == ["other here", "other there", "within here", "within there"]
    use("after")
    assert sorted(done[4:]) == ["after here", "after there"]


def _use(core, answer):
    core.run(lambda: answer.put("here"), lambda: answer.put("there"))


@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_forked_process_starts_a_thread_of_its_own():
    core = SecondCore()
    core.run(lambda: None, lambda: None)
    context = multiprocessing.get_context("fork")
    answer = context.Queue()
    process = context.Process(target=_use, args=(core, answer))
    process.start()
    assert {answer.get(timeout=30), answer.get(timeout=30)} == {"here", "there"}
    process.join()


def pull():
    mesh = box_mesh(node_counts=(8, 9, 3))
    tissue = TissueSimulator(mesh, TissueParameters(), mesh.bottom_nodes[:30])
    tip_m = mesh.nodes_m[-1]
    tissue.measure({"psm1": ToolInput(tip_m, 1.0)})
    lifts_m = np.arange(12) * 1e-3
    results = [
        tissue.step({"psm1": ToolInput(tip_m + np.array([0.0, 0.0, lift_m]), -0.3)})
        for lift_m in lifts_m
    ]
    return results[-1]


def test_shared_work_gives_what_one_core_gives_and_the_same_bits_each_time(monkeypatch):
    alone = pull()
    for name in ("assembly.WORTH_SHARING", "linear.multifrontal.WORTH_SHARING"):
        monkeypatch.setattr(f"fras_sim.fem.{name}", 0)
    monkeypatch.setattr("fras_sim.fem.linear.multifrontal.WORTH_SPLITTING", 0)
    first, again = pull(), pull()
    np.testing.assert_array_equal(first.nodes_m, again.nodes_m)
    np.testing.assert_array_equal(first.nodal_force_n, again.nodal_force_n)
    np.testing.assert_allclose(first.nodes_m, alone.nodes_m, atol=3e-5)
    assert first.max_force_n == pytest.approx(alone.max_force_n, rel=1e-2)
