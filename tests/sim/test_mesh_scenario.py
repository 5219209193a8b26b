"""Scenarios with a mesh file: read by the command line, built by the simulator, refused by name."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import meshio
import msgspec
import numpy as np
import pytest

from fras_cli import mesh_input
from fras_cli.mesh_input import MeshCheckFailed
from fras_cli.options import TrialInput, build_trial, write_new_scenario
from fras_common.scenario import (
    Disc,
    MeshFacts,
    Scenario,
    ScenarioError,
    SceneSection,
    TissueSection,
    fit_to_mesh,
    load,
    to_toml,
)
from fras_sim.adapter import MeshMismatch, build_mesh, build_simulator, tissue_model
from fras_sim.fem import Cell
from support.meshes import box

THEIRS = {"hex8": "hexahedron", "tet4": "tetra", "tet10": "tetra10"}
SHIFT_MM = np.array([-30.0, 80.0, 12.0])


def write_mesh(path: Path, cell: Cell = "hex8", size_m: Any = (0.08, 0.1, 0.006)) -> None:
    """A box in millimetres, somewhere."""
    nodes_m, elements = box(cell, (4, 5, 1), size_m)
    meshio.Mesh(1000.0 * nodes_m + SHIFT_MM, [(THEIRS[cell], elements)]).write(path)


@pytest.fixture(scope="module", autouse=True)
def asked_once() -> Iterator[None]:
    """Ask the simulator's own command about each mesh once, not once a test."""
    answers: dict[Any, subprocess.CompletedProcess[bytes]] = {}

    def run(command: list[str], **options: Any) -> subprocess.CompletedProcess[bytes]:
        question = (*command, options["input"])
        if question not in answers:
            answers[question] = subprocess.run(command, **options)
        return answers[question]

    commands = SimpleNamespace(run=run, TimeoutExpired=subprocess.TimeoutExpired)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mesh_input, "subprocess", commands)
        yield


@pytest.fixture
def scenario_file(tmp_path: Path) -> Any:
    def write(tissue: str, rest: str = "") -> Path:
        path = tmp_path / "trial" / "mine.toml"
        path.parent.mkdir(exist_ok=True)
        path.write_text(f"{rest}\n[tissue]\n{tissue}\n", encoding="utf-8")
        return path

    write_mesh(tmp_path / "body.vtu")
    return write


GOOD = 'mesh_file = "../body.vtu"\nmesh_scale = 0.001\n'


def test_the_mesh_is_found_beside_the_scenario_and_gives_it_its_size(scenario_file: Any) -> None:
    path = scenario_file(GOOD)
    trial = build_trial(str(path))
    assert trial.scenario.tissue.size_m == pytest.approx((0.08, 0.1, 0.006))
    assert trial.scenario.tissue.mesh_file == "body.vtu"
    assert trial.scenario.scene is not None
    for disc in trial.scenario.scene.discs:
        assert 0 <= disc.center_m[0] <= trial.scenario.tissue.size_m[0]
        assert 0 <= disc.center_m[1] <= trial.scenario.tissue.size_m[1]
    assert trial.mesh == (path.parent.parent / "body.vtu").read_bytes()
    other = build_trial(str(path), seed=9)
    assert other.scenario.scene != trial.scenario.scene


def test_the_simulator_builds_what_the_command_line_sent(scenario_file: Any) -> None:
    trial = build_trial(str(scenario_file(GOOD)))
    simulator = build_simulator(trial.scenario, trial.mesh)
    nodes_m, elements = box("hex8", (4, 5, 1), (0.08, 0.1, 0.006))
    np.testing.assert_allclose(simulator.mesh.nodes_m, nodes_m, atol=1e-12)
    np.testing.assert_array_equal(simulator.mesh.elements, elements)
    fixed = simulator.mesh.nodes_m[simulator.fixed_nodes]
    assert len(fixed) > 0
    assert (fixed[:, 2] < 1e-12).all()
    model = tissue_model(simulator, trial.scenario, "t")
    assert model.elements.shape == (20, 8)


def test_a_saved_trial_can_be_run_again_from_its_folder(scenario_file: Any, tmp_path: Path) -> None:
    trial = build_trial(str(scenario_file(GOOD)))
    saved = tmp_path / "run"
    saved.mkdir()
    (saved / "scenario.toml").write_text(to_toml(trial.scenario))
    (saved / "body.vtu").write_bytes(trial.mesh)
    again = build_trial(str(saved / "scenario.toml"))
    assert (again.scenario, again.mesh) == (trial.scenario, trial.mesh)


def test_a_new_scenario_names_the_mesh_from_where_it_is_written(
    scenario_file: Any, tmp_path: Path
) -> None:
    base = scenario_file(GOOD)
    folder = tmp_path / "a" / "b"
    folder.mkdir(parents=True)
    write_new_scenario(str(base), 4, folder / "new.toml")
    assert load(folder / "new.toml").tissue.mesh_file == "../../body.vtu"
    found, wanted = build_trial(str(folder / "new.toml")), build_trial(str(base), seed=4)
    assert found.scenario == wanted.scenario


def refused(path: Path, **options: Any) -> dict[str, Any]:
    with pytest.raises(ScenarioError) as caught:
        build_trial(str(path), **options)
    values = dict(caught.value.values)
    assert str(caught.value).startswith(f"{values['file']}: {values['key']} = ")
    return values


@pytest.mark.parametrize(
    ("tissue", "key", "value", "words"),
    [
        ('mesh_file = "absent.vtu"', "tissue.mesh_file", "absent.vtu", "there is no file "),
        ('mesh_file = ".."', "tissue.mesh_file", "..", "is no file"),
        ('mesh_file = ""', "tissue.mesh_file", "", "is no file"),
        ('mesh_file = "/dev/zero"', "tissue.mesh_file", "/dev/zero", "/dev/zero is no file"),
        ('mesh_file = "../huge.vtu"', "tissue.mesh_file", "../huge.vtu", "has 100000000 bytes"),
        ('mesh_file = "a\\u0000b"', "tissue.mesh_file", "a\0b", "a\0b"),
        ('mesh_file = "mine.toml"', "tissue.mesh_file", "mine.toml", "no format known here"),
        ('mesh_file = "../noise.vtu"', "tissue.mesh_file", "../noise.vtu", "no mesh could be read"),
        ('mesh_file = "../skin.vtu"', "tissue.mesh_file", "../skin.vtu", "no volume elements"),
        ('mesh_file = "../body.vtu"', "tissue.mesh_scale", 1.0, "scale = 0.001 makes it 0.1 m"),
        (GOOD + 'element = "tet4"', "tissue.element", "tet4", "are hex8: hex8-sri or hex8"),
        (GOOD + "size_m = [0.1, 0.1, 0.006]", "tissue.size_m", [0.1, 0.1, 0.006],
         "[0.08, 0.1, 0.006] m: leave size_m out"),
        (GOOD + "[scene]\nroi_m = [0.09, 0.05, 0.0]", "scene.roi_m", [0.09, 0.05, 0.0],
         "x must lie on the tissue, between 0 and 0.08"),
        (GOOD + "[scene]\nroi_m = [0.04, 0.05, 0]\n[[scene.discs]]\ncenter_m = [0, 0.11]\n"
         "radius_m = 0.02", "scene.discs[0].center_m", [0, 0.11], "y up to 0.1"),
        (GOOD + "[generator]\nroi_edge_margin_m = 0.045", "generator.roi_edge_margin_m", 0.045,
         "half the tissue's shorter side"),
        ('element = "tet10"', "tissue.element", "tet10", "or give a mesh_file"),
        ("mesh_scale = 0.001", "tissue.mesh_scale", 0.001, "leave it out"),
        ("mesh_scale = 0.0", "tissue.mesh_scale", 0.0, "> 0"),
        ('material = "jelly"', "tissue.material", "jelly", "allowed: svk, neo-hookean"),
        ('element = "hex20"', "tissue.element", "hex20", "allowed: hex8-sri, hex8, tet4, tet10"),
        ("mesh_file = 3", "tissue.mesh_file", 3, "str"),
    ],
)  # fmt: skip
def test_bad_mesh_scenarios_are_named(
    scenario_file: Any, tmp_path: Path, tissue: str, key: str, value: Any, words: str
) -> None:
    with (tmp_path / "huge.vtu").open("wb") as sparse:
        sparse.truncate(100_000_000)
    (tmp_path / "noise.vtu").write_bytes(b"\x00\xff" * 40)
    nodes_m, elements = box("tet4")
    meshio.Mesh(nodes_m, [("triangle", elements[:, :3])]).write(tmp_path / "skin.vtu")
    path = scenario_file(tissue)
    named = refused(path)
    assert (named["file"], named["key"], named["value"]) == (str(path), key, value)
    assert words in str(named["allowed"])


def test_node_counts_of_the_command_line_are_for_the_box(scenario_file: Any) -> None:
    path = scenario_file(GOOD)
    assert refused(path, mesh="5,5,2")["key"] == "--mesh"


def test_a_roi_that_only_the_mesh_has_room_for_is_fine(scenario_file: Any, tmp_path: Path) -> None:
    write_mesh(tmp_path / "body.vtu", size_m=(0.2, 0.15, 0.006))
    trial = build_trial(str(scenario_file(GOOD + "[scene]\nroi_m = [0.18, 0.14, 0]")))
    assert trial.scenario.tissue.size_m == pytest.approx((0.2, 0.15, 0.006))


def test_a_check_that_breaks_down_is_no_fault_of_the_scenario(
    scenario_file: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = scenario_file(GOOD)
    path.parent.parent.joinpath("body.vtu").write_bytes(b"not asked about before")
    monkeypatch.setattr(sys, "executable", "/bin/false")
    with pytest.raises(MeshCheckFailed, match="status 1"):
        build_trial(str(path))


def test_the_command_ends_with_2_and_names_the_file(scenario_file: Any, tmp_path: Path) -> None:
    path = scenario_file('mesh_file = "absent.vtu"')
    command = [sys.executable, "-m", "fras_cli", "run", str(path), "--out", str(tmp_path / "run")]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ended.returncode == 2
    assert f"{path}: tissue.mesh_file = 'absent.vtu'" in ended.stderr
    assert not (tmp_path / "run").exists()  # nothing was begun


def test_a_mesh_that_may_not_be_read_is_named(
    scenario_file: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(path: Path) -> bytes:
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(Path, "read_bytes", refuse)
    assert "can't be read: [Errno 13]" in refused(scenario_file(GOOD))["allowed"]


# --- the simulator's side -------------------------------------------------------------------

FACTS = MeshFacts(
    cell="hex8", elements=("hex8-sri", "hex8"), n_nodes=60, n_elements=20, size_m=(0.08, 0.1, 0.006)
)
SCENE = SceneSection(roi_m=(0.04, 0.05, 0.0), discs=(Disc(center_m=(0.0, 0.0), radius_m=0.03),))


def with_tissue(**fields: Any) -> Scenario:
    return Scenario(scene=SCENE, tissue=TissueSection(**fields))


def test_name_and_content_of_a_mesh_go_together(scenario_file: Any) -> None:
    trial: TrialInput = build_trial(str(scenario_file(GOOD)))
    with pytest.raises(MeshMismatch, match="with 0 bytes"):
        build_mesh(trial.scenario, b"")
    with pytest.raises(MeshMismatch, match="mesh_file = None"):
        build_mesh(with_tissue(), trial.mesh)


def test_a_scenario_that_was_not_fitted_to_its_mesh_is_refused(scenario_file: Any) -> None:
    trial = build_trial(str(scenario_file(GOOD)))
    with pytest.raises(MeshMismatch, match="fit the scenario to its mesh"):
        build_mesh(with_tissue(mesh_file="body.vtu", mesh_scale=0.001), trial.mesh)
    tissue = msgspec.structs.replace(trial.scenario.tissue, element="tet4")
    with pytest.raises(ScenarioError, match=r"tissue\.element = 'tet4'"):
        build_mesh(msgspec.structs.replace(trial.scenario, tissue=tissue), trial.mesh)


@pytest.mark.parametrize("cell", THEIRS)
def test_element_and_material_of_the_scenario_reach_the_simulator(
    scenario_file: Any, tmp_path: Path, cell: Cell
) -> None:
    path = scenario_file(GOOD + f'element = "{cell}"\nmaterial = "neo-hookean"')
    write_mesh(tmp_path / "body.vtu", cell)
    trial = build_trial(str(path))
    simulator = build_simulator(trial.scenario, trial.mesh)
    assert simulator.mesh.cell == cell
    assert (simulator.parameters.element, simulator.parameters.material) == (cell, "neo-hookean")
    assert simulator.measure({}).max_force_n == pytest.approx(0.0, abs=1e-9)


def test_fitting_twice_changes_nothing() -> None:
    once = fit_to_mesh(with_tissue(mesh_file="x.vtu"), FACTS)
    assert once.tissue.size_m == FACTS.size_m
    assert fit_to_mesh(once, FACTS) == once
