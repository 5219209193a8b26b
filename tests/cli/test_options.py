"""From a file and options to one resolved scenario."""

import re
from pathlib import Path
from typing import Any

import msgspec
import pytest

from fras_cli.options import (
    build_scenario,
    find_scenario,
    parse_seeds,
    shipped_scenarios,
    write_new_scenario,
)
from fras_common.scenario import Disc, Scenario, ScenarioError, load, resolve


def test_default_scenario_file_holds_the_defaults_and_explains_every_field() -> None:
    path = shipped_scenarios() / "default.toml"
    assert load(path) == Scenario(name="default", seed=7)
    text = path.read_text()
    for section in msgspec.structs.fields(Scenario):
        kind: Any = section.type
        if section.name in ("scene", "patient"):
            kind = kind.__args__[0]
        for field in getattr(kind, "__struct_fields__", ()):
            if field != "discs":  # a table of its own
                assert re.search(rf"^(# )?{field} = .*#", text, re.MULTILINE), field
    for field in Disc.__struct_fields__:
        assert field in text


@pytest.mark.parametrize("name", ["default", "a", "b", "c", "twin"])
def test_shipped_scenarios_are_found_by_name_and_resolve(name: str) -> None:
    assert find_scenario(name) == shipped_scenarios() / f"{name}.toml"
    assert build_scenario(name).scene is not None


def test_options_are_laid_over_the_file() -> None:
    scenario = build_scenario("c", seed=3, pace=0, no_limit=True, criterion="lex", mesh="11,13,2")
    assert scenario.seed == 3
    assert scenario.run.pace == 0
    assert scenario.awareness.no_limit
    assert scenario.planner.criterion == "lex"
    assert scenario.planner.ignore_ap  # of the file
    assert scenario.tissue.node_counts == (11, 13, 2)
    assert scenario == resolve(scenario)


def test_seed_draws_anew_where_the_file_holds_a_scene(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    write_new_scenario("default", 5, file)
    assert build_scenario(str(file)).scene == build_scenario("default", seed=5).scene
    assert build_scenario(str(file), seed=6).scene == build_scenario("default", seed=6).scene


@pytest.mark.parametrize(
    ("options", "key"),
    [
        ({"mesh": "1,2,3"}, "tissue.node_counts"),
        ({"mesh": "a,b,c"}, "--mesh"),
        ({"pace": -1.0}, "run.pace"),
        ({"criterion": "best"}, "planner.criterion"),
        ({"seed": -1}, "seed"),
    ],
)
def test_bad_option_names_key_and_value(options: dict[str, Any], key: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        build_scenario("default", **options)
    assert caught.value.values["file"] == "command line"
    assert str(caught.value.values["key"]).startswith(key)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("3", "one alone is 3..3"),
        ("5..2", "the smaller one comes first: 2..5"),
        *((text, "a range such as") for text in ("a..b", "1...3", "")),
    ],
)
def test_bad_seeds(text: str, told: str) -> None:
    with pytest.raises(ScenarioError, match=told):
        parse_seeds(text)


def test_unknown_name_lists_the_known_ones() -> None:
    with pytest.raises(ScenarioError, match="a, b, c, default"):
        find_scenario("d")


def test_scenario_is_never_written_over(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text("seed = 1\n")
    with pytest.raises(ScenarioError, match="exists"):
        write_new_scenario("default", 5, file)
    assert file.read_text() == "seed = 1\n"
