"""A tissue from a mesh file, from the file to a named end, through real processes."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from mcap.reader import make_reader

from fras_audit import SERVICES, audit_log
from fras_cli.options import build_trial, shipped_scenarios
from fras_cli.trial import TrialView
from fras_common.messages import Context, TissueModel, TissueState
from fras_supervisor import free_port
from support.logs import assert_same_trial, messages

SCRIPT = Path(__file__).parents[2] / "examples" / "make_slab.py"
COARSE = "11,13,2"
SHIPPED = shipped_scenarios().parent / "meshes" / "slab.vtu"


def make_slab(path: Path, *options: str) -> None:
    subprocess.run([sys.executable, str(SCRIPT), str(path), *options], check=True)


def test_the_shipped_slab_is_what_the_script_makes(tmp_path: Path) -> None:
    make_slab(tmp_path / "slab.vtu")
    made, shipped = meshio.read(tmp_path / "slab.vtu"), meshio.read(SHIPPED)
    np.testing.assert_allclose(made.points, shipped.points, rtol=0, atol=2e-6)
    np.testing.assert_array_equal(made.cells_dict["hexahedron"], shipped.cells_dict["hexahedron"])


@pytest.fixture(scope="module")
def slab(trials: Any) -> Any:
    """The trial that ships: its summary and its log."""
    return trials.kept("slab")


def test_a_slab_is_retracted_like_a_box(slab: Any) -> None:
    summary, log = slab
    assert (summary.outcome, summary.scenario_kind) == ("success", "A")
    assert summary.visibility > 0.7
    assert summary.lost == 0

    (model,) = messages(log, "sim/tissue_model")
    assert isinstance(model, TissueModel)
    nodes_m = model.nodes_m.floats()
    assert nodes_m.shape == (1050, 3)
    assert model.elements.shape == (480, 8)
    np.testing.assert_allclose(nodes_m.min(axis=0), 0.0, atol=1e-12)
    np.testing.assert_allclose(np.ptp(nodes_m, axis=0)[:2], [0.1, 0.12], atol=1e-9)
    fixed = nodes_m[model.fixed_nodes.ints()]
    assert len(fixed) > 50
    assert fixed[:, 2].max() > 0.002  # the underside is bent, and held where it is

    states: list[TissueState] = messages(log, "sim/tissue_state")
    assert all(state.solver.converged for state in states)
    context: Context = messages(log, "sa/context")[0]
    # The corners of the bounding box are outside the rounded outline: no blocks there.
    assert not {"b(1,1)", "b(1,7)", "b(7,1)", "b(7,7)"} & set(context.names)
    assert "b(4,4)" in context.names


def test_the_log_holds_the_mesh_as_it_was_read(slab: Any) -> None:
    _, log = slab
    with log.open("rb") as stream:
        kept = {one.name: one.data for one in make_reader(stream).iter_attachments()}
    assert kept["mesh"] == SHIPPED.read_bytes()


def test_a_slab_is_derived_again_from_the_log_alone(slab: Any) -> None:
    report = audit_log(slab[1], SERVICES, lambda service, done, total: None)
    assert [tally.first for tally in report.tallies if tally.first] == []
    assert report.passed
    assert sum(tally.tolerated for tally in report.tallies) == 0


@pytest.mark.parametrize(("cell", "suffix"), [("tet4", ".msh"), ("tet10", ".vtu")])
def test_tetrahedra_reach_a_named_end(trials: Any, tmp_path: Path, cell: str, suffix: str) -> None:
    make_slab(tmp_path / f"slab{suffix}", "--cell", cell, "--nodes", "9", "11", "2")
    scenario = tmp_path / "tetrahedra.toml"
    scenario.write_text(
        f'seed = 2\n[tissue]\nmesh_file = "slab{suffix}"\nmesh_scale = 0.001\nelement = "{cell}"\n'
        "[awareness]\nat_distance_m = 0.02\n"
    )
    summary, log = trials.run(str(scenario))
    assert summary.outcome in {"success", "failed", "no_plan"}
    assert summary.actions
    (model,) = messages(log, "sim/tissue_model")
    assert model.elements.shape[1] == {"tet4": 4, "tet10": 10}[cell]
    states: list[TissueState] = messages(log, "sim/tissue_state")
    assert all(state.solver.converged for state in states)


def test_a_mesh_that_does_not_match_ends_the_trial_with_the_reason_and_leaves_no_trace(
    trials: Any, slab: Any
) -> None:
    trial = build_trial("slab", pace=0)
    trials.start(trial.scenario, b"")
    seen: list[TrialView] = []
    assert trials.follower.follow(seen.append, stop=lambda: False)
    task = seen[-1].task
    assert task is not None
    assert task.outcome == "aborted"
    assert "mesh" in task.reason
    assert trials.run("a", mesh=COARSE)[0].outcome == "success"  # the stack is none the worse
    # Neither left a trace: the same slab is the same trial, bit for bit.
    assert_same_trial(slab[1], trials.run("slab")[1])


def test_the_command_runs_it_and_keeps_the_mesh_with_the_run(fras: Any, tmp_path: Path) -> None:
    command = fras("run", "slab", "--pace", "0", "--out", "run", "--port", str(free_port()))
    status = command.end()
    assert status == 0, command.text
    assert (tmp_path / "run" / "slab.vtu").read_bytes() == SHIPPED.read_bytes()
    again = build_trial(str(tmp_path / "run" / "scenario.toml"))
    wanted = build_trial("slab", pace=0)
    assert (again.scenario, again.mesh) == (wanted.scenario, wanted.mesh)
