"""The results folder: nothing is lost, nothing is mixed up, nothing is written over."""

import resource
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import msgspec
import pytest

from fras_cli.run import FolderInUse
from fras_experiments.campaign.reading import Prepared, prepare
from fras_experiments.campaign.records import Lifted, Record, Result, Timing, key_of
from fras_experiments.campaign.store import OtherCampaign, StoreUnwritable, opened
from fras_experiments.campaign.tables import cell

CODE = "code 1"


@pytest.fixture
def prepared() -> Prepared:
    return prepare("retraction", seeds="0..1", mesh="11,13,2")


def record(outcome: str = "success", series: int = 1) -> Record:
    result = Result(
        outcome=outcome, reason="visible, at last", soft_limit_n=0.5, hard_limit_n=1.0,
        visibility=1.0 / 3.0, complete=True,
    )  # fmt: skip
    timing = Timing(worker="0", wall_s=1.5, cpu_s=2.0)
    lifted = tuple(Lifted(5 * n, 0.001 * n, 0.1, 0.0) for n in range(series))
    return Record(code=CODE, result=result, timing=timing, series=lifted)


@contextmanager
def full_at(size: int) -> Generator[None]:
    """No file may grow beyond this many bytes, as on a full disk."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_what_was_kept_is_there_for_the_next_command(tmp_path: Path, prepared: Prepared):
    with opened(tmp_path / "r", prepared, CODE) as store:
        assert store.load().records == {}
        kept = store.put(2, record("failed"), {"audit.mcap": b"log", "scenario.toml": b"x"})
    assert (tmp_path / "r" / kept.log).read_bytes() == b"log"
    with opened(tmp_path / "r", prepared, CODE) as store:
        assert store.load().records == {2: kept}
    # On another build nothing of it counts, and nothing of it is lost.
    with opened(tmp_path / "r", prepared, "code 2") as store:
        found = store.load()
        assert (found.records, found.foreign) == ({}, 1)
    with opened(tmp_path / "r", prepared, CODE) as store:
        assert store.load().records == {2: kept}


def test_a_record_that_was_spoilt_is_run_again(tmp_path: Path, prepared: Prepared):
    with opened(tmp_path, prepared, CODE) as store:
        store.put(0, record(), {})
        store.put(1, record(), {})
        spoilt = tmp_path / "records" / f"{key_of(CODE, prepared.trials[0].scenario, b'')}.json"
        for content in (b"", b"{", b'{"code": 3}', b"\xff"):
            spoilt.write_bytes(content)
            found = store.load()
            assert (set(found.records), found.spoilt) == ({1}, 1)


def test_other_rules_are_another_campaign_and_lie_beside_its_results(
    tmp_path: Path, prepared: Prepared
):
    own = prepared.by_rules({"domain.lp": "a.", "preferences/sum.lp": "b."})
    with opened(tmp_path / "own", own, CODE) as store:
        store.put(0, record(), {})
    assert (tmp_path / "own" / "asp" / "preferences" / "sum.lp").read_text() == "b."
    with opened(tmp_path / "own", own, CODE) as store:
        assert set(store.load().records) == {0}
    with opened(tmp_path / "usual", prepared, CODE):
        assert not (tmp_path / "usual" / "asp").exists()
    changed = prepared.by_rules({"domain.lp": "a.", "preferences/sum.lp": "c."})
    for other in (prepared, changed):
        with pytest.raises(OtherCampaign), opened(tmp_path / "own", other, CODE):
            raise AssertionError("other rules must not go on with these results")
    assert (tmp_path / "own" / "asp" / "preferences" / "sum.lp").read_text() == "b."


def test_another_campaigns_folder_is_refused_by_name(tmp_path: Path, prepared: Prepared):
    with opened(tmp_path / "r", prepared, CODE) as store:
        store.put(0, record(), {})
    before = {one: one.read_bytes() for one in (tmp_path / "r").rglob("*") if one.is_file()}
    for other in (prepare("criteria", seeds="0..1"), prepare("retraction", seeds="0..2")):
        with (
            pytest.raises(OtherCampaign, match="retraction"),
            opened(tmp_path / "r", other, CODE),
        ):
            pass
    assert {one: one.read_bytes() for one in before} == before


def test_folders_that_hold_something_else_are_refused(tmp_path: Path, prepared: Prepared):
    (tmp_path / "r").mkdir()
    (tmp_path / "r" / "thesis.txt").write_text("mine", encoding="utf-8")
    with pytest.raises(FolderInUse, match="choose another"), opened(tmp_path / "r", prepared, CODE):
        pass
    with (
        pytest.raises(FolderInUse, match="can't be written"),
        opened(tmp_path / "r" / "thesis.txt" / "x", prepared, CODE),
    ):
        pass
    assert [one.name for one in (tmp_path / "r").iterdir()] == ["thesis.txt"]


def test_two_commands_do_not_share_a_folder(tmp_path: Path, prepared: Prepared):
    with (
        opened(tmp_path, prepared, CODE),
        pytest.raises(FolderInUse, match="another"),
        opened(tmp_path, prepared, CODE),
    ):
        pass


def test_a_begin_that_was_killed_is_begun_again(tmp_path: Path, prepared: Prepared):
    (tmp_path / ".campaign.toml.part").write_bytes(b"[camp")
    with opened(tmp_path, prepared, CODE):
        pass
    (tmp_path / "base.toml").unlink()
    with opened(tmp_path, prepared, CODE):
        assert (tmp_path / "base.toml").exists()


def test_a_full_disk_is_named_and_loses_nothing(tmp_path: Path, prepared: Prepared):
    with opened(tmp_path, prepared, CODE) as store:
        kept = {0: store.put(0, record(), {})}
        store.write_tables(kept)
        before = {one: one.read_bytes() for one in tmp_path.rglob("*") if one.is_file()}
        for files in ({}, {"audit.mcap": b"x" * 5000}):
            with full_at(600), pytest.raises(StoreUnwritable, match="disk is full") as caught:
                store.put(1, record(series=100), files)
            assert "1 of 4 trials are kept" in str(caught.value)
            assert str(tmp_path) in str(caught.value)
        with full_at(50), pytest.raises(StoreUnwritable, match="disk is full"):
            store.write_tables({**kept, 1: record(series=100)})
        after = {one: one.read_bytes() for one in tmp_path.rglob("*") if one.is_file()}
        after.pop(tmp_path / "series" / "1.csv", None)
        assert after == before
        # And with room again it goes on.
        store.put(1, record(series=100), {"audit.mcap": b"x"})
        assert set(store.load().records) == {0, 1}


def test_tables_have_a_row_a_trial_in_the_campaigns_order(tmp_path: Path, prepared: Prepared):
    with opened(tmp_path, prepared, CODE) as store:
        store.write_tables({3: record("aborted"), 1: record()})
    lines = (tmp_path / "trials.csv").read_text(encoding="utf-8").splitlines()
    assert lines[0] == (
        "campaign,trial,scenario,seed,planner.ignore_ap,outcome,reason,scenario_kind,complete,"
        "visibility,max_force_n,soft_limit_n,hard_limit_n,crossings,longest_above_ticks,plans,"
        "replans,actions,ticks,grasp_block,grasp_x_m,grasp_y_m,roi_x_m,roi_y_m,lift_m,"
        "patient_max_force_n,patient_above_ticks,missed_ticks,needless_ticks,log"
    )
    assert lines[1].startswith('retraction,1,default,0,true,success,"visible, at last",,true,0.333')
    assert [line.split(",")[1] for line in lines[1:]] == ["1", "3"]
    timing = (tmp_path / "timing.csv").read_text(encoding="utf-8").splitlines()
    assert timing == [
        "trial,worker,wall_s,cpu_s,plan_first_s,plan_median_s,plan_service_s,replan_move_s,"
        "replan_release_s",
        "1,0,1.5,2,,,,,",
        "3,0,1.5,2,,,,,",
    ]
    series = (tmp_path / "series" / "1.csv").read_text(encoding="utf-8")
    assert series == "tick,height_m,force_n,visibility\n0,0,0.1,0\n"


def test_a_cell_is_told_in_one_way():
    told = [cell(one) for one in (None, True, False, 0.1 + 0.2, 1e-7, [11, 13, 2], "a", 3)]
    assert told == ["", "true", "false", "0.3", "1e-07", "11x13x2", "a", "3"]


def test_a_key_knows_code_scenario_and_mesh(prepared: Prepared):
    one, other = (trial.scenario for trial in prepared.trials[:2])
    keys = [key_of("a", one, b""), key_of("b", one, b""), key_of("a", other, b"")]
    keys.append(key_of("a", one, b"mesh"))
    assert len(set(keys)) == 4
    again = msgspec.json.decode(msgspec.json.encode(one), type=type(one))
    assert key_of("a", again, b"") == keys[0]
