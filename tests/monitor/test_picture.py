"""What is known: the latest of each key, of one trial, whatever the order in which keys arrive."""

import msgspec
import pytest

from fras_common.messages import Holds, ReplayMark, ReplayStatus, RobotState
from fras_monitor.mail import WAITING, Mail
from fras_monitor.picture import PLANS_KEPT, Picture, apply, remembered, with_token
from fras_monitor.stop import StopRecord
from fras_monitor.trace import SAMPLES, Trace
from fras_monitor.view import holds_of, view_of
from support import pictures as p


def test_nothing_of_another_trial_shows():
    picture = p.picture_of(p.model("old"), p.robot(trial="old"), p.task(trial="t-1"))
    assert picture.trial == "t-1"
    assert picture.of_trial(picture.model) is None
    assert picture.of_trial(picture.robot) is None
    assert picture.dt_s == 0.0


def test_what_arrives_before_its_trial_is_known_shows_once_it_is():
    picture = p.picture_of(p.task(trial="t-0"), p.model(), p.plan("c1", "grasp(psm1,b(3,4))"))
    assert picture.plan is None
    picture = apply(picture, p.task(), 1.0)
    assert picture.plan is not None
    assert picture.of_trial(picture.model) is not None


def test_without_an_executive_the_arms_say_which_trial_it_is():
    assert p.picture_of(p.robot()).trial == p.TRIAL


def test_plans_are_bounded():
    picture = p.picture_of(*(p.plan(f"c{number}") for number in range(PLANS_KEPT + 5)))
    assert len(picture.plans) == PLANS_KEPT
    assert picture.plans[-1].request_id == f"c{PLANS_KEPT + 4}"


def test_what_the_recorder_remembers_replaces_only_what_was_said_before_it():
    def said(tick: int) -> RobotState:
        return msgspec.structs.replace(p.robot(tick=tick), stamp_ns=tick)

    heard = p.picture_of(said(7))
    assert remembered(heard, said(3)) is heard
    assert remembered(heard, said(7)) is heard
    # In a replay what a recorder remembers is of before.
    replayed = with_token(heard, "alive/replay/1", present=True)
    assert remembered(replayed, said(8)) is replayed
    later = remembered(heard, said(8))
    assert later.robot is not None
    assert later.robot.message.tick == 8
    filled = remembered(Picture(), p.robot(tick=3))
    assert filled.robot is not None
    assert filled.robot.message.tick == 3


def test_what_was_not_heard_is_remembered_by_the_recorder_of_a_live_cell():
    there = with_token(Picture(), "alive/recorder/1", present=True)
    assert (Picture().is_remembered, there.is_remembered) == (False, True)
    assert not with_token(there, "alive/replay/1", present=True).is_remembered


def test_a_verdict_on_states_that_were_not_heard_leaves_them_behind():
    picture = p.picture_of(p.task(), p.model(), p.robot(tick=4), p.tissue(tick=4))
    assert not picture.is_behind
    assert not apply(picture, p.verdict(tick=4), 1.0).is_behind
    assert apply(picture, p.verdict(tick=5), 1.0).is_behind
    assert not apply(picture, p.verdict(tick=5, trial="another"), 1.0).is_behind


def test_a_type_that_no_key_carries_is_a_mistake_of_ours():
    with pytest.raises(TypeError, match="carries a str"):
        apply(Picture(), "text", 0.0)


@pytest.mark.parametrize(("robot_s", "holds_s", "held"), [(1.0, 2.0, {}), (2.0, 1.0, {"cli": "x"})])
def test_who_holds_is_what_motion_said_last(robot_s: float, holds_s: float, held: dict[str, str]):
    picture = apply(Picture(), p.robot(holds={"cli": "x"}), robot_s)
    picture = apply(picture, Holds(holds={}), holds_s)
    assert holds_of(picture) == held


def test_one_of_two_instances_that_goes_leaves_the_other():
    picture = with_token(Picture(), "alive/sim/1", present=True)
    picture = with_token(picture, "alive/sim/2", present=True)
    picture = with_token(picture, "alive/sim/1", present=False)
    assert picture.is_there("sim")
    assert not with_token(picture, "alive/sim/2", present=False).is_there("sim")


# The second of the two ticks of one sample.
PEAK_TICK = 4 * SAMPLES - 99


def replay(log: str, *marks: ReplayMark) -> ReplayStatus:
    return ReplayStatus(
        phase="playing", position_s=0.0, begin_s=0.0, end_s=1.0, duration_s=1.0, log_time_ns=0,
        tick=0, last_tick=1, rate=1.0, loop=False, laps=0, mark=-1, messages=0, of=1, log=log,
        trial="", damage=[], marks=list(marks),
    )  # fmt: skip


def test_in_a_recording_nothing_waits_for_approval():
    waiting = p.picture_of(p.task(phase="awaiting_approval", plan="c1"), p.plan("c1"))
    assert view_of(waiting, StopRecord(), 0.0).waiting_plan == "c1"
    recorded = with_token(waiting, "alive/replay/1", present=True)
    assert view_of(recorded, StopRecord(), 0.0).waiting_plan == ""


def test_the_marks_of_a_log_are_told_once_and_kept():
    mark = ReplayMark(number=0, kind="plan", position_s=0.1, log_time_ns=0, tick=0, text="plan")
    picture = with_token(Picture(), "alive/replay/1", present=True)
    for status in (replay("a", mark), replay("a")):
        picture = apply(picture, status, 0.0)
    assert picture.replay is not None
    assert picture.replay.message.marks == [mark]
    other = apply(picture, replay("b"), 0.0)
    assert other.replay is not None
    assert other.replay.message.marks == []
    assert with_token(picture, "alive/replay/1", present=False).replay is None


def test_the_course_keeps_every_peak_and_is_bounded():
    trace = Trace()
    for tick in range(4 * SAMPLES):
        trace = trace.extended(p.verdict(tick, max_force_n=9.0 if tick == PEAK_TICK else 0.1))
    assert len(trace.samples) == SAMPLES
    assert max(one.force_n for one in trace.samples) == 9.0


def test_a_replay_that_seeks_back_cuts_the_course_and_another_trial_begins_it_anew():
    trace = Trace()
    for tick in (0, 2, 4, 6, 2):
        trace = trace.extended(p.verdict(tick))
    assert [one.tick for one in trace.samples] == [0, 2]
    assert len(trace.extended(p.verdict(9, trial="t-2")).samples) == 1


def test_mail_keeps_the_latest_of_a_state_and_each_of_the_rest_in_order():
    mail = Mail()
    mail.replace("state", "old", 1.0)
    mail.append("first", 2.0)
    mail.replace("state", "new", 3.0)
    mail.append("last", 4.0)
    assert [one for one, _ in mail.take()] == ["first", "new", "last"]
    assert mail.take() == []


def test_mail_that_nobody_takes_is_bounded_and_counted():
    mail = Mail()
    for number in range(WAITING + 3):
        mail.append(number, float(number))
    taken = mail.take()
    assert len(taken) == WAITING
    assert taken[0][0] == 3
    assert (mail.received, mail.dropped) == (WAITING + 3, 3)
