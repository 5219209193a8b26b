"""Logs from elsewhere: planned by other rules, computed on another build; and forged ones."""

import io
import math
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import pytest
from mcap.opcode import Opcode
from mcap.records import Attachment
from rich.console import Console

from fras_audit import Report, Tally, audit_log
from fras_audit.decisions import decide_by
from fras_audit.reading import read_recorded
from fras_cli.layout import Layout
from fras_cli.log_extract import extract
from fras_cli.log_verify import verify_log
from fras_cli.options import build_trial
from fras_cli.stack import own_stack
from fras_cli.trial import TrialFollower, TrialView
from fras_common.bus import RawSample
from fras_common.codec import decode, encode
from fras_common.digests import own_table_digest
from fras_common.messages import (
    Array,
    ContextRequest,
    Health,
    Plan,
    RobotState,
    RpcRecord,
    TargetReply,
    TissueModel,
    Verdict,
    WhyNotReply,
    WhyNotRequest,
)
from fras_common.topics import PLAN, WHY_NOT
from fras_log import LogFile, LogReader
from fras_log.attachments import read_attachments, rules_in
from fras_planner.knowledge import load_knowledge
from support.forger import attachment, put_together, read, take_apart
from support.forging import rewrite

ASP = Path(__file__).parents[2] / "asp"


@pytest.fixture(scope="module")
def crossed(trials: Any) -> Path:
    """A trial by the rules that come with FRAS."""
    return trials.kept("b")[1]


@pytest.fixture(scope="module")
def rules(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Rules of somebody's own: another preference, and specifications in other words."""
    folder = Path(shutil.copytree(ASP, tmp_path_factory.mktemp("rules") / "mine"))
    shutil.copy(folder / "preferences" / "sum.lp", folder / "preferences" / "weighted.lp")
    verify = folder / "verify.lp"
    verify.write_text(verify.read_text().replace("with its gripper closed", "with its jaw shut"))
    return folder


@pytest.fixture(scope="module")
def elsewhere(rules: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A trial by those, as real processes decided it; the folder with the rules is gone."""
    folder = tmp_path_factory.mktemp("elsewhere")
    theirs = Path(shutil.copytree(rules, folder / "theirs"))
    with own_stack("other-rules", None, folder / "logs", layout=Layout("local", theirs)) as stack:
        follower = TrialFollower(stack)
        trial = build_trial("a", pace=0, mesh="11,13,2")
        follower.start("elsewhere", trial.scenario, folder / "run", trial.mesh)
        asked: list[WhyNotReply] = []

        def ask(view: TrialView) -> None:
            if not asked and view.robot is not None and view.robot.tick > 0:
                question = WhyNotRequest(question="b(1,1)")
                asked.append(stack.link.bus.query(WHY_NOT, question, 5.0))

        assert follower.follow(ask, stop=lambda: False)
        assert asked
    shutil.rmtree(theirs)
    return folder / "run" / "audit.mcap"


def audited(log: Path, service: str = "planner") -> Report:
    return audit_log(log, [service], lambda service, done, total: None)


def tally_of(report: Report, what: str) -> Tally:
    return next(tally for tally in report.tallies if tally.what == what)


def verified(log: Path, asp_dir: Path | None = None) -> tuple[int, str]:
    told = io.StringIO()
    status = verify_log(log, asp_dir, Console(file=told, width=200))
    return status, told.getvalue()


def test_a_log_by_other_rules_is_derived_by_its_own(elsewhere: Path, rules: Path) -> None:
    digest = load_knowledge(rules).digest
    recorded = read_recorded(elsewhere)
    assert recorded.metadata["asp_digest"] == digest != load_knowledge().digest
    assert {plan.asp_digest for plan in recorded.of(PLAN)} == {digest}
    report = audited(elsewhere)
    assert [tally.first for tally in report.tallies if tally.first] == []
    assert report.passed
    assert all(not tally.notes for tally in report.tallies)
    # It matters by which: those of this machine would have decided otherwise.
    assert decide_by(recorded, ASP).differing
    assert decide_by(recorded, rules).differing == ()


def test_a_log_by_other_rules_is_held_against_its_own_specifications(
    elsewhere: Path, rules: Path
) -> None:
    status, text = verified(elsewhere)
    assert status == 0
    theirs, ours = load_knowledge(rules).digest[:12], load_knowledge().digest[:12]
    assert f"Specifications: those attached to the log (rules {theirs}), NOT this" in text
    assert f"machine's (rules {ours})" in " ".join(text.split())
    status, text = verified(elsewhere, ASP)
    assert status == 0
    assert f"Specifications: those in {ASP} (rules {ours})." in " ".join(text.split())


def test_whose_specifications_were_taken_is_said(crossed: Path, tmp_path: Path) -> None:
    status, text = verified(crossed)
    assert status == 0
    assert "attached to the log" in text
    assert "the same as this machine's." in text
    attached = read_attachments(crossed)
    none = {name: data for name, data in attached.items() if not name.startswith("asp/")}
    _, text = verified(rewritten_with(crossed, tmp_path / "1.mcap", none))
    assert "this machine's" in text
    assert "for the log attaches none." in text

    def by_other_rules(plan: Plan) -> Plan:
        return msgspec.structs.replace(plan, asp_digest="0123456789abcdef")

    other = rewrite(tmp_path / "1.mcap", tmp_path / "2.mcap", "planner/plan", by_other_rules)
    assert "it was planned by other rules (0123456789ab)" in verified(other)[1]


def test_an_attachment_that_was_tampered_with_is_caught_by_the_chain(
    crossed: Path, tmp_path: Path
) -> None:
    """A promise taken back afterwards: the very case that the chain is for."""
    attached = read_attachments(crossed)
    text = attached["asp/verify.lp"]
    path = tmp_path / "audit.mcap"
    pieces = take_apart(crossed.read_bytes())
    for number, piece in enumerate(pieces):
        if piece.opcode == Opcode.ATTACHMENT:
            record = read(piece)
            assert isinstance(record, Attachment)
            if record.name == "asp/verify.lp":
                lax = text.replace(b"with its gripper closed", b"with its gripper shut")
                pieces[number] = attachment(record.name, lax, record)
    path.write_bytes(put_together(pieces))
    assert read_attachments(path)["asp/verify.lp"] != text
    status, said = verified(path)
    assert status == 1
    assert "the opening record or an attachment was changed" in " ".join(said.split())
    assert "The log is NOT what was recorded." in said


def test_what_is_extracted_are_the_rules(elsewhere: Path, rules: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert extract(elsewhere, out, Console(file=io.StringIO())) == 0
    assert load_knowledge(out / "asp").digest == load_knowledge(rules).digest
    assert build_trial(str(out / "scenario.toml")).scenario == read_recorded(elsewhere).scenario


# --- logs that lie about rules ------------------------------------------------------------


def rewritten_with(
    log: Path, out: Path, attachments: dict[str, bytes], **opening: str | None
) -> Path:
    """The same messages under other attachments and another opening record; None takes out."""
    reader = LogReader(log)
    messages = list(reader.messages())
    changed = {**reader.metadata, **opening}
    file = LogFile(out, {k: v for k, v in changed.items() if v is not None}, attachments, 0)
    for message in messages:
        file.write(RawSample(message.key, message.payload, "application/msgpack"), 0)
    file.close({})
    return out


def test_the_log_holds_the_rules_that_the_planner_decided_by(crossed: Path) -> None:
    knowledge = load_knowledge()
    recorded = read_recorded(crossed)
    assert rules_in(recorded.attachments, crossed) == knowledge.files
    assert recorded.metadata["asp_digest"] == knowledge.digest
    assert {plan.asp_digest for plan in recorded.of(PLAN)} == {knowledge.digest}
    assert recorded.metadata["topics_digest"] == own_table_digest()
    assert recorded.metadata["build"] == recorded.facts("planner")["build"]
    rules = tally_of(audited(crossed), "rules")
    assert (rules.compared, rules.equal) == (1, 1)


def test_a_rule_altered_in_the_log_is_found(crossed: Path, tmp_path: Path) -> None:
    attached = read_attachments(crossed)
    attached["asp/preferences/weighted.lp"] = attached["asp/preferences/nearest.lp"]
    report = audited(rewritten_with(crossed, tmp_path / "1.mcap", attached))
    assert not report.passed
    rules = tally_of(report, "rules")
    assert rules.first is not None
    assert rules.first.recorded == load_knowledge().digest
    plans = tally_of(report, "plans")
    assert plans.differences == plans.compared == 3
    assert any("than those attached to the log" in note for note in plans.notes)
    # What the planner sent, as its query tells it, is not what is attached.
    asked = tally_of(report, "questions and requests").first
    assert asked is not None
    assert asked.path == "rules.preferences/weighted.lp"


def test_a_digest_altered_in_the_opening_record_is_found(crossed: Path, tmp_path: Path) -> None:
    attached = read_attachments(crossed)
    forged = rewritten_with(crossed, tmp_path / "1.mcap", attached, asp_digest="00" * 32)
    report = audited(forged)
    assert not report.passed
    differing = {tally.what: tally.differences for tally in report.tallies if tally.differences}
    assert differing == {"rules": 1}


def test_rules_that_are_lost_are_told(crossed: Path, tmp_path: Path) -> None:
    attached = read_attachments(crossed)
    few = {name: data for name, data in attached.items() if name != "asp/effects.lp"}
    report = audited(rewritten_with(crossed, tmp_path / "1.mcap", few))
    assert not report.passed
    assert "asp/effects.lp: this file is missing" in report.tallies[0].notes[0]
    none = {name: data for name, data in attached.items() if not name.startswith("asp/")}
    report = audited(rewritten_with(crossed, tmp_path / "2.mcap", none))
    assert report.passed
    assert "does not hold them" in tally_of(report, "rules").notes[0]


def test_a_log_of_before_there_were_attached_rules_is_audited_by_this_machines(
    crossed: Path, tmp_path: Path
) -> None:
    def without(mirror: RpcRecord) -> RpcRecord:
        asked = msgspec.msgpack.decode(mirror.request)
        del asked["rules"]
        return msgspec.structs.replace(mirror, request=msgspec.Raw(encode(asked)))

    scenario = {"scenario.toml": read_attachments(crossed)["scenario.toml"]}
    bare = rewritten_with(
        crossed, tmp_path / "1.mcap", scenario, asp_digest=None, topics_digest=None
    )
    old = rewrite(bare, tmp_path / "2.mcap", "rpc/recorder/open", without)
    report = audited(old)
    assert [tally.first for tally in report.tallies if tally.first] == []
    assert report.passed
    assert "rules" not in {tally.what for tally in report.tallies}
    assert all(not tally.notes for tally in report.tallies)

    def by_other_rules(plan: Plan) -> Plan:
        return msgspec.structs.replace(plan, asp_digest="0123456789abcdef")

    other = rewrite(old, tmp_path / "3.mcap", "planner/plan", by_other_rules)
    plans = tally_of(audited(other), "plans")
    assert "(digest 0123456789ab) than this machine's" in plans.notes[0]
    assert "the log attaches none" in plans.notes[0]


# --- logs that lie about what was asked and answered, and of the tissue at rest ---------------


def answered(key: str, kind: type[Any], change: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Change what the first query of a key was answered."""
    done: list[int] = []

    def forged(mirror: RpcRecord) -> RpcRecord:
        if done or mirror.fault is not None:
            return mirror
        done.append(mirror.seq)
        reply = change(decode(kind, bytes(mirror.reply), key))
        return msgspec.structs.replace(mirror, reply=msgspec.Raw(encode(reply)))

    return forged


def farther(reply: TargetReply) -> TargetReply:
    assert reply.position_m is not None
    x, y, z = reply.position_m
    return TargetReply(position_m=(math.nextafter(x, 1.0), y, z))


def otherwise(reply: WhyNotReply) -> WhyNotReply:
    return msgspec.structs.replace(reply, sentences=["It is fixed.", *reply.sentences[1:]])


def bent(model: TissueModel) -> TissueModel:
    nodes = model.nodes_m.view().copy()
    nodes[3, 2] = math.nextafter(nodes[3, 2], 1.0)
    return msgspec.structs.replace(model, nodes_m=Array.of(nodes, "<f8"))


def of_another_tick(mirror: RpcRecord) -> RpcRecord:
    asked = decode(ContextRequest, bytes(mirror.request), mirror.key)
    if asked.request_id != "c2":
        return mirror
    changed = msgspec.structs.replace(asked, min_tick=asked.min_tick + 1)
    return msgspec.structs.replace(mirror, request=msgspec.Raw(encode(changed)))


LIES: list[tuple[str, str, Callable[[Any], Any], str, str]] = [
    ("rpc/sa/target", "sa", answered("sa/target", TargetReply, farther), "targets", "position_m"),
    ("rpc/sa/context", "planner", of_another_tick, "questions and requests", "min_tick"),
    (
        "rpc/planner/why_not",
        "planner",
        answered("planner/why_not", WhyNotReply, otherwise),
        "answers to why not",
        "sentences[0]",
    ),
    ("sim/tissue_model", "sim", bent, "models", "nodes_m[3][2]"),
]


@pytest.mark.parametrize(("key", "service", "change", "what", "field"), LIES)
def test_a_lie_about_what_was_asked_or_answered_is_found(
    elsewhere: Path,
    tmp_path: Path,
    key: str,
    service: str,
    change: Callable[[Any], Any],
    what: str,
    field: str,
) -> None:
    assert audited(elsewhere, service).passed
    report = audited(rewrite(elsewhere, tmp_path / "1.mcap", key, change), service)
    assert not report.passed
    differing = {tally.what: tally.differences for tally in report.tallies if tally.differences}
    assert differing == {what: 1}
    first = tally_of(report, what).first
    assert first is not None
    assert first.path.startswith(field)


# --- other builds ---------------------------------------------------------------------------


def of_other_build(health: Health) -> Health:
    return msgspec.structs.replace(health, facts={**health.facts, "build": "another machine"})


def stronger(by_n: float) -> Callable[[Any], Any]:
    def change(verdict: Verdict) -> Verdict:
        if verdict.tick != 60:
            return verdict
        return msgspec.structs.replace(verdict, max_force_n=verdict.max_force_n + by_n)

    return change


def further(by: float) -> Callable[[Any], Any]:
    def change(state: RobotState) -> RobotState:
        if state.tick != 50:
            return state
        arm = state.arms["psm1"]
        joints = (arm.setpoint_joints[0] + by, *arm.setpoint_joints[1:])
        moved = msgspec.structs.replace(arm, setpoint_joints=joints)
        return msgspec.structs.replace(state, arms={**state.arms, "psm1": moved})

    return change


@pytest.mark.parametrize(
    ("service", "key", "what", "change"),
    [
        ("sa", "sa/verdict", "verdicts", stronger),
        ("motion", "robot/state", "robot states", further),
    ],
)
def test_numbers_of_another_build_are_held_to_the_stated_tolerance(
    crossed: Path,
    tmp_path: Path,
    service: str,
    key: str,
    what: str,
    change: Callable[[float], Callable[[Any], Any]],
) -> None:
    """1e-9, as docs/audit.md states it; on the same build the last bit."""
    other = rewrite(crossed, tmp_path / "0.mcap", f"health/{service}", of_other_build)
    near = rewrite(other, tmp_path / "1.mcap", key, change(1e-10))
    report = audited(near, service)
    assert report.passed
    assert tally_of(report, what).tolerated == 1
    beyond = rewrite(other, tmp_path / "2.mcap", key, change(1e-8))
    assert tally_of(audited(beyond, service), what).differences == 1
    same = rewrite(crossed, tmp_path / "3.mcap", key, change(1e-10))
    assert tally_of(audited(same, service), what).differences == 1
