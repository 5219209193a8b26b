"""Bad scenarios: the error names file, key, value and what is allowed; odd ones are legal."""

import math
from pathlib import Path
from typing import Any

import pytest

from fras_common.scenario import AwarenessSection, Scenario, ScenarioError, check, load, to_toml
from fras_common.scenario.loader import convert

SCENE = "[scene]\nroi_m = [0.05, 0.06, 0.0]\n"


@pytest.fixture
def written(tmp_path: Path) -> Any:
    def write(text: str) -> Path:
        path = tmp_path / "bad.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_an_empty_file_is_the_default_scenario(written: Any):
    scenario = load(written(""))
    assert scenario == Scenario()
    assert scenario.tissue.size_m == (0.1, 0.12, 0.005)
    assert scenario.tissue.node_counts == (21, 25, 2)
    assert (scenario.tissue.young_modulus_pa, scenario.tissue.poisson_ratio) == (3000.0, 0.45)
    assert (scenario.tissue.dt_s, scenario.tissue.bed, scenario.tissue.gravity) == (
        0.02, True, False,
    )  # fmt: skip
    assert scenario.generator.attached_fraction == 0.4
    assert scenario.generator.clearance_m == 0.01
    assert (scenario.generator.disc_radius_min_m, scenario.generator.disc_radius_max_m) == (
        0.02, 0.04,
    )  # fmt: skip
    assert (scenario.awareness.force_limit_n, scenario.awareness.hard_limit_n) == (0.5, None)
    assert scenario.awareness.visible_fraction == 0.7
    assert scenario.awareness.closed_jaw_rad == pytest.approx(math.radians(20))
    assert (scenario.awareness.blocks, scenario.awareness.at_distance_m) == (7, 0.005)
    assert (scenario.planner.criterion, scenario.planner.goal) == ("capped", "visible")
    assert scenario.planner.max_replans == 5
    assert (scenario.motion.free_speed_m_s, scenario.motion.holding_speed_m_s) == (0.05, 0.02)
    assert (scenario.motion.lift_height_m, scenario.motion.retreat_max_m) == (0.05, 0.005)
    assert (scenario.run.pace, scenario.run.peer_timeout_s, scenario.run.hold_timeout_s) == (
        1.0, 10.0, 30.0,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("text", "key", "value", "allowed"),
    [
        # unknown keys
        ("colour = 1", "colour", 1, "unknown key; known here: name, seed, tissue"),
        ("[tisue]\nbed = true", "tisue", {"bed": True}, "did you mean tissue?"),
        ("[tissue]\nbeds = true", "tissue.beds", True, "did you mean bed?"),
        (SCENE + "discs = [{center_m = [0, 0], radius_m = 0.1}, {center = 1}]",
         "scene.discs[1].center", 1, "did you mean center_m?"),
        # wrong units
        ("[tissue]\nsize_mm = [100, 120, 5]", "tissue.size_mm", [100, 120, 5],
         "did you mean size_m?"),
        ("[tissue]\nsize_m = [100, 120, 5]", "tissue.size_m[0]", 100, "<= 1.0"),
        ("[tissue]\nyoung_modulus_kpa = 3", "tissue.young_modulus_kpa", 3,
         "did you mean young_modulus_pa?"),
        ("[tissue]\ndt_s = 20", "tissue.dt_s", 20, "<= 0.1"),
        ("[awareness]\nclosed_jaw_rad = 20", "awareness.closed_jaw_rad", 20, "< 1.047"),
        ("[awareness]\nclosed_jaw_deg = 20", "awareness.closed_jaw_deg", 20,
         "did you mean closed_jaw_rad?"),
        ("[motion]\nfree_speed_m_s = 50", "motion.free_speed_m_s", 50, "<= 0.5"),
        ("[generator]\nattached_fraction = 40", "generator.attached_fraction", 40, "<= 1.0"),
        # impossible values
        ("[tissue]\nnode_counts = [1, 25, 2]", "tissue.node_counts[0]", 1, ">= 2"),
        ("[tissue]\nnode_counts = [21, 25, 1]", "tissue.node_counts[2]", 1, ">= 2"),
        ("[tissue]\nnode_counts = [21, 25]", "tissue.node_counts", [21, 25], "length 3"),
        ("[tissue]\nnode_counts = 2", "tissue.node_counts", 2, "array"),
        ("[tissue]\npoisson_ratio = 0.5", "tissue.poisson_ratio", 0.5, "< 0.5"),
        ("[tissue]\ndensity_kg_m3 = 0.0", "tissue.density_kg_m3", 0.0, "> 0.0"),
        ("[tissue]\nbed = 1", "tissue.bed", 1, "bool"),
        ("seed = -1", "seed", -1, ">= 0"),
        ("seed = 1.5", "seed", 1.5, "int"),
        ("seed = 9007199254740992", "seed", 2**53, "<= 9007199254740991"),
        ("name = 5", "name", 5, "str"),
        ("[planner]\ncriterion = 'best'", "planner.criterion", "best",
         "allowed: sum, literal, lex, nearest, weighted, capped"),
        ("[planner]\ngoal = ''", "planner.goal", "", "allowed: visible, clear"),
        ("[awareness]\nforce_metric = 'max'", "awareness.force_metric", "max",
         "allowed: nodal_max, tool"),
        ("[awareness]\nblocks = 41", "awareness.blocks", 41, "<= 40"),
        ("[awareness]\nforce_limit_n = 0.0", "awareness.force_limit_n", 0.0, "> 0.0"),
        ("[awareness]\nforce_limit_n = inf", "awareness.force_limit_n", math.inf, "<="),
        ("[run]\npace = inf", "run.pace", math.inf, "<= 1000"),
        ("[generator]\nclearance_m = inf", "generator.clearance_m", math.inf, "<= 1.0"),
        ("[generator]\ndisc_radius_min_m = 1e-9", "generator.disc_radius_min_m", 1e-9,
         ">= 0.003"),
        ("scene = 5", "scene", 5, "object"),
        ("[scene]\ndiscs = []", "scene", {"discs": []}, "missing required field `roi_m`"),
        (SCENE + "discs = [{center_m = [0, 0], radius_m = -1}]", "scene.discs[0].radius_m", -1,
         ">= 0.0"),
        # what one field alone can't tell
        ("[scene]\nroi_m = [0.11, 0.06, 0.0]", "scene.roi_m", [0.11, 0.06, 0.0],
         "x must lie on the tissue, between 0 and 0.1 m"),
        ("[scene]\nroi_m = [-0.01, 0.06, 0.0]", "scene.roi_m", [-0.01, 0.06, 0.0], "x must lie"),
        ("[scene]\nroi_m = [0.05, 0.13, 0.0]", "scene.roi_m", [0.05, 0.13, 0.0],
         "y must lie on the tissue, between 0 and 0.12 m"),
        ("[scene]\nroi_m = [0.05, 0.06, 0.001]", "scene.roi_m", [0.05, 0.06, 0.001],
         "z must lie under the tissue"),
        ("[scene]\nroi_m = [0.05, 0.06, -0.01]", "scene.roi_m", [0.05, 0.06, -0.01],
         "above -0.01 m"),
        (SCENE + "discs = [{center_m = [0.05, 0.121], radius_m = 0.01}]",
         "scene.discs[0].center_m", [0.05, 0.121], "y up to 0.12 m"),
        ("[generator]\ndisc_radius_max_m = 0.01", "generator.disc_radius_max_m", 0.01,
         "at least disc_radius_min_m = 0.02"),
        ("[generator]\nroi_edge_margin_m = 0.05", "generator.roi_edge_margin_m", 0.05,
         "half the tissue's shorter side"),
        ("[awareness]\nhard_limit_n = 0.4", "awareness.hard_limit_n", 0.4,
         "at least force_limit_n = 0.5"),
        ("[motion]\nfree_speed_m_s = 0.06", "motion.free_speed_m_s", 0.06,
         "a stop must end within two ticks: at most 0.05"),
        ("[motion]\nstop_deceleration_m_s2 = 0.25", "motion.free_speed_m_s", 0.05,
         "raise motion.stop_deceleration_m_s2"),
    ],
)  # fmt: skip
def test_bad_input_is_named(written: Any, text: str, key: str, value: object, allowed: str):
    path = written(text)
    with pytest.raises(ScenarioError) as caught:
        load(path)
    named = caught.value.values
    assert named["file"] == str(path)
    assert named["key"] == key
    assert named["value"] == value
    assert allowed in str(named["allowed"])
    assert str(caught.value).startswith(f"{path}: {key} = {value!r}: ")


@pytest.mark.parametrize(
    ("field", "text"),
    [
        ("awareness.force_limit_n", "[awareness]\nforce_limit_n = nan"),
        ("scene.roi_m[0]", "[scene]\nroi_m = [nan, 0.06, 0.0]"),
        ("run.pace", "[run]\npace = nan"),
        ("tissue.size_m[1]", "[tissue]\nsize_m = [0.1, nan, 0.005]"),
    ],
)
def test_what_is_no_number_is_refused(written: Any, field: str, text: str):
    with pytest.raises(ScenarioError) as caught:
        load(written(text))
    assert caught.value.values["key"] == field


@pytest.mark.parametrize(
    "text", ["seed = ", "[[[", "a = 1\na = 2", "x = " + "[" * 10_000, "seed = " + "9" * 5000]
)
def test_a_file_that_is_no_toml_is_named(written: Any, text: str):
    path = written(text)
    with pytest.raises(ScenarioError, match="is not TOML") as caught:
        load(path)
    assert caught.value.values["file"] == str(path)


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path):
    with pytest.raises(ScenarioError, match="can't be read"):
        load(tmp_path / "missing.toml")
    with pytest.raises(ScenarioError, match="can't be read"):
        load(tmp_path)
    (tmp_path / "bytes.toml").write_bytes(b"name = '\xff'")
    with pytest.raises(ScenarioError, match="can't be read"):
        load(tmp_path / "bytes.toml")


def test_all_blocks_fixed_is_legal(written: Any):
    scenario = load(written(SCENE + "discs = [{center_m = [0.05, 0.06], radius_m = 1.0}]"))
    assert scenario.scene is not None
    assert scenario.scene.discs[0].radius_m == 1.0


@pytest.mark.parametrize(
    "text",
    [
        "[scene]\nroi_m = [0.0, 0.12, -0.0099]",
        SCENE + "discs = []",
        SCENE + "[generator]\nroi_edge_margin_m = 0.9",
        "[awareness]\nhard_limit_n = 0.5",
        "[run]\npace = 0\nhold_timeout_s = 0",
        "[tissue]\nnode_counts = [2, 2, 2]",
        "[generator]\nattached_fraction = 0",
        "[planner]\nmax_replans = 0",
        "name = ''",
    ],
)
def test_the_limits_themselves_are_legal(written: Any, text: str):
    assert load(written(text)) == load(written(to_toml(load(written(text)))))


def test_the_command_lines_overrides_are_checked_the_same_way():
    assert convert({"seed": 3}, "command line").seed == 3
    with pytest.raises(ScenarioError, match=r"^command line: seed = 'x': "):
        convert({"seed": "x"}, "command line")


def test_a_scenario_made_in_python_can_be_checked():
    assert check(Scenario()) == Scenario()
    with pytest.raises(ScenarioError, match=r"^scenario: "):
        check(Scenario(awareness=AwarenessSection(force_limit_n=1.0, hard_limit_n=0.9)))


def test_absent_values_are_left_out_of_the_file():
    text = to_toml(Scenario())
    assert "scene" not in text
    assert "hard_limit_n" not in text
    assert "[tissue]" in text


@pytest.mark.parametrize(
    ("raw", "key"),
    [
        ({"tissue": {"node_counts": [200, 200, 200]}}, "tissue.node_counts"),
        ({"tissue": {"size_m": [0.5, 0.12, 0.005]}}, "tissue.size_m[0]"),
        ({"tissue": {"bed": False}, "generator": {"attached_fraction": 0.0}}, "tissue.bed"),
        ({"motion": {"free_speed_m_s": 0.2}}, "motion.free_speed_m_s"),
        ({"motion": {"jaw_speed_rad_s": 3.0}}, "motion.jaw_speed_rad_s"),
        ({"motion": {"retreat_max_m": 0.0}}, "motion.retreat_max_m"),
        ({"motion": {"instrument_clearance_m": 0.04}}, "motion.instrument_clearance_m"),
        (
            {"motion": {"forbidden_boxes": [{"lower_m": [0, 0, 0], "upper_m": [0.1, 0, 0.1]}]}},
            "motion.forbidden_boxes[0].upper_m",
        ),
        (
            {"awareness": {"visible_distance_m": 0.004}, "generator": {"roi_depth_m": 0.005}},
            "awareness.visible_distance_m",
        ),
        ({"awareness": {"visible_fraction": 1.0}}, "awareness.visible_fraction"),
        ({"awareness": {"closed_jaw_rad": 1.2}}, "awareness.closed_jaw_rad"),
    ],
)
def test_what_a_service_would_refuse_is_told_before_any_starts(
    raw: dict[str, Any], key: str
) -> None:
    with pytest.raises(ScenarioError) as caught:
        convert(raw, "own.toml")
    assert caught.value.values["key"] == key
    assert "own.toml" in str(caught.value)
