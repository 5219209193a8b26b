"""Which trials a campaign consists of, and what is said of one that can't be."""

from pathlib import Path

import pytest

from fras_common.scenario import Scenario, ScenarioError
from fras_experiments.campaign.reading import (
    find_campaign,
    prepare,
    read_campaign,
    shipped,
    to_toml,
)
from fras_experiments.campaign.spec import (
    BadCampaign,
    Campaign,
    Draw,
    Sample,
    digest_of,
    expand,
)

BASE = Scenario(name="base")
YOUNG = "tissue.young_modulus_pa"


def points(**asked) -> list[tuple[object, ...]]:
    trials = expand(Campaign(name="c", **asked), BASE, "c.toml")
    return [tuple(one.labels.values()) for one in trials]


def test_each_value_meets_each_other_seed_by_seed():
    campaign = Campaign(
        name="c",
        seeds=range(4, 6),
        sweep={"planner.criterion": ["lex", "sum"], "awareness.blocks": [5, 7]},
    )
    trials = expand(campaign, BASE, "c.toml")
    assert [one.number for one in trials] == list(range(8))
    assert [one.scenario.seed for one in trials] == [4] * 4 + [5] * 4
    told = [(one.scenario.planner.criterion, one.scenario.awareness.blocks) for one in trials[:4]]
    assert told == [("lex", 5), ("lex", 7), ("sum", 5), ("sum", 7)]
    assert [tuple(one.labels.values()) for one in trials[:4]] == told
    # On one seed all have the same scene, and it is drawn already.
    assert len({repr(one.scenario.scene) for one in trials[:4]}) == 1
    assert trials[0].scenario.scene != trials[4].scenario.scene
    assert {one.scenario.run.pace for one in trials} == {0.0}


def test_one_at_a_time_has_the_base_once_and_cases_go_together():
    asked = points(
        design="one-at-a-time",
        sweep={"awareness.blocks": [5, 7], "planner.max_replans": [5, 0]},
        cases=({"awareness.force_limit_n": 0.3, "awareness.hard_limit_n": 0.5},),
    )
    assert asked == [
        (7, 5, 0.5, None),
        (5, 5, 0.5, None),
        (7, 0, 0.5, None),
        (7, 5, 0.3, 0.5),
    ]


def test_samples_are_drawn_evenly_and_no_field_depends_on_the_others():
    one = Sample(count=10, seed=1, fields={YOUNG: Draw(low=1000.0, high=4000.0, scale="log")})
    both = Sample(count=10, seed=1, fields={"awareness.blocks": Draw(low=5, high=9), **one.fields})
    alone = [values[0] for values in points(sample=one)]
    blocks, together = zip(*points(sample=both), strict=True)
    assert list(together) == alone
    strata = sorted(int(10 * _share(value)) for value in alone)  # type: ignore[arg-type]
    assert strata == list(range(10))
    assert all(isinstance(value, int) for value in blocks)
    assert set(blocks) == {5, 6, 7, 8, 9}
    assert points(sample=one) == [(value,) for value in alone]
    other = Sample(count=10, seed=2, fields=one.fields)
    assert [values[0] for values in points(sample=other)] != alone


def _share(value: float) -> float:
    from math import log

    return log(value / 1000.0) / log(4.0)


def test_a_digest_knows_whatever_is_asked_for():
    def digest(name: str = "c", mesh: bytes = b"", **asked) -> str:
        campaign = Campaign(name=name, **asked)
        return digest_of(campaign, expand(campaign, BASE, "c.toml"), mesh)

    told = [
        digest(),
        digest(name="d"),
        digest(mesh=b"m"),
        digest(seeds=range(3)),
        digest(seeds=range(4)),
        digest(set={"awareness.blocks": 6}),
        digest(until="plan"),
    ]
    assert len(set(told)) == len(told)
    assert digest() == told[0]


BAD = {
    'sweep."planner.criteron" = ["lex"]': ("planner.criteron", "did you mean criterion"),
    'sweep."plannr.criterion" = ["lex"]': ("plannr", "did you mean planner"),
    'sweep."planner.criterion" = ["best"]': ("planner.criterion", "nearest"),
    'sweep."planner.criterion" = []': ("sweep.planner.criterion", "zero trials"),
    'sweep."planner.criterion" = "lex"': ("sweep.planner.criterion", "a list"),
    'sweep."planner.criterion.deep" = [1]': ("planner.criterion.deep", "no table"),
    'sweep."tissue.young_modulus_pa" = ["soft"]': (YOUNG, "float"),
    'sweep."tissue.young_modulus_pa" = [-1.0]': (YOUNG, "> 0"),
    "sweep.seed = [1, 2]": ("seed", "campaign.seeds"),
    'sweep."scene.roi_m" = [[0.0, 0.0, 0.0]]': ("scene.roi_m", "drawn from the seeds"),
    'set."planner.confirm" = true': ("planner.confirm", "nobody is there"),
    'set."run.supervised" = true': ("run.supervised", "nobody is there"),
    'set."generator.disc_radius_max_m" = 0.001': ("generator.disc_radius_max_m", "disc_radius_min"),
    "[sample]\ncount = 0\nfields = {}": ("sample.count", "1"),
    "[sample]\ncount = 2\nfields = {}": ("sample.fields", "at least one"),
    '[sample]\ncount = 2\n[sample.fields."tissue.young_modulus_pa"]\nlow = 2\nhigh = 1': (
        f"sample.fields.{YOUNG}",
        "below high",
    ),
    '[sample]\ncount = 2\n[sample.fields."tissue.young_modulus_pa"]\nlow = 0\nhigh = 1\n'
    'scale = "log"': (f"sample.fields.{YOUNG}.low", "above 0"),
    '[sample]\ncount = 2\n[sample.fields."planner.criterion"]\nlow = 0\nhigh = 1': (
        "sample.fields.planner.criterion",
        "no number",
    ),
    '[sample]\ncount = 2\n[sample.fields."awareness.blocks"]\nlow = nan\nhigh = 1': (
        "sample.fields.awareness.blocks",
        "below high",
    ),
    'swep."planner.criterion" = ["lex"]': ("file", "sweep, cases, sample"),
    "cases = [1]": ("cases[0]", "object"),
}


@pytest.mark.parametrize("text", BAD)
def test_what_cannot_be_is_named_with_its_place(tmp_path: Path, text: str):
    file = tmp_path / "mine.toml"
    # Dotted keys of the root come before the first table.
    head = '[campaign]\nname = "mine"\n'
    content = f"{head}{text}" if text.startswith("[") else f"{text}\n{head}"
    file.write_text(content, encoding="utf-8")
    key, said = BAD[text]
    with pytest.raises(ScenarioError) as caught:
        prepare(str(file))
    assert caught.value.values["key"] == key, str(caught.value)
    assert said in str(caught.value)
    assert "mine.toml" in str(caught.value)


@pytest.mark.parametrize(
    ("head", "said"),
    [
        ('name = "a b"', "name"),
        ('name = "../../etc"', "name"),
        ("", "name"),
        ('name = "x"\nseeds = "5..3"', "the smaller one comes first: 3..5"),
        ('name = "x"\nseeds = 3', "str"),
        ('name = "x"\nscenario = "nowhere"', "neither a file"),
        ('name = "x"\nscenario = "nowhere.toml"', "can't be read"),
        ('name = "x"\ndesign = "random"', "one-at-a-time"),
        ('name = "x"\nuntil = "dawn"', "end, plan"),
        ('name = "x"\nsed = "1..2"', "seeds"),
        ('name = "x"\nseeds = "0..100000"', "at most 100000"),
    ],
)
def test_a_bad_head_is_named(tmp_path: Path, head: str, said: str):
    file = tmp_path / "mine.toml"
    file.write_text(f"[campaign]\n{head}\n", encoding="utf-8")
    with pytest.raises(ScenarioError, match=r"toml|nowhere") as caught:
        prepare(str(file))
    assert said in str(caught.value)


@pytest.mark.parametrize("content", [b"\xff\xfe", b"[campaign", b"a = " + b"[" * 5000, b""])
def test_what_is_no_campaign_is_named(tmp_path: Path, content: bytes):
    file = tmp_path / "mine.toml"
    file.write_bytes(content)
    with pytest.raises(BadCampaign):
        read_campaign(file)


def test_whoever_is_not_there_is_told_who_is():
    with pytest.raises(BadCampaign, match="retraction") as caught:
        find_campaign("retracton")
    assert "faults" in str(caught.value)
    with pytest.raises(BadCampaign, match="can't be read"):
        read_campaign(find_campaign("nowhere.toml"))


def test_dotted_and_nested_keys_say_the_same(tmp_path: Path):
    told = []
    for text in (
        'sweep."planner.criterion" = ["lex"]\nsweep."tissue.node_counts" = [[5, 5, 2]]',
        "[sweep]\nplanner.criterion = ['lex']\ntissue.node_counts = [[5, 5, 2]]",
        "[sweep.planner]\ncriterion = ['lex']\n[sweep.tissue]\nnode_counts = [[5, 5, 2]]",
    ):
        file = tmp_path / "c.toml"
        head = "[campaign]\nname = 'c'\n"
        file.write_text(f"{text}\n{head}" if text[0] != "[" else head + text, encoding="utf-8")
        told.append(read_campaign(file).sweep)
    assert told == [{"planner.criterion": ["lex"], "tissue.node_counts": [[5, 5, 2]]}] * 3


def test_a_campaign_is_written_as_it_is_read(tmp_path: Path):
    for path in shipped().values():
        campaign = read_campaign(path)
        copy = tmp_path / path.name
        copy.write_text(to_toml(campaign, {"digest": "0"}), encoding="utf-8")
        assert read_campaign(copy) == campaign
    sampled = Campaign(name="s", sample=Sample(count=2, fields={YOUNG: Draw(low=1.0, high=2.0)}))
    (tmp_path / "s.toml").write_text(to_toml(sampled, {}), encoding="utf-8")
    assert read_campaign(tmp_path / "s.toml") == sampled


def test_those_that_come_with_fras_can_begin():
    told = {name: prepare(name, seeds="0..1") for name in shipped()}
    assert {name: len(one.trials) for name, one in told.items()} == {
        "retraction": 4,
        "no-limit": 2,
        "criteria": 12,
        "mesh": 8,
        "planning": 2 * 6 * 4,
        "replanning": 2 * 6 * 2,
        "sensitivity": 2 * 21,
        "twin": 2 * 4 * 3,
    }
    assert {name for name, one in told.items() if one.campaign.until == "plan"} == {"planning"}
    assert all(one.scenario.has_patient for one in told["twin"].trials)
    pair = told["retraction"].trials[:2]
    assert [one.scenario.planner.ignore_ap for one in pair] == [False, True]
    assert pair[0].scenario.scene == pair[1].scenario.scene


def test_the_command_line_lies_over_the_file():
    told = prepare("retraction", seeds="3..3", mesh="11,13,2")
    assert {one.scenario.tissue.node_counts for one in told.trials} == {(11, 13, 2)}
    assert told.digest != prepare("retraction", seeds="3..3").digest
    with pytest.raises(BadCampaign, match="leave out --mesh"):
        prepare("mesh", mesh="11,13,2")
