"""What `fras status` makes of what it heard."""

from typing import Any

import msgspec
import pytest
from rich.console import Console

from fras_cli.status_view import COLUMNS, Heard, page_remarks, remarks, render, rows
from fras_common.messages import Health, ProcessReport, SupervisorStatus, TaskStatus
from fras_common.topics import SERVICES


def health(service: str, **fields: Any) -> Health:
    usual = Health(
        service=service, state="ready", rss_bytes=50_000_000, cpu_percent=1.6, received=0,
        published=0, malformed=0, refused=0, wrong_trial=0, queue_depth=0, queue_dropped=0, gaps=0,
        facts={}, source=f"{service}/1",
    )  # fmt: skip
    return msgspec.structs.replace(usual, **fields)


def report(name: str, **fields: Any) -> ProcessReport:
    usual = ProcessReport(
        name=name, state="ready", pid=41, restarts=0, last_exit="", starts_in_s=0.0, up_s=3.0,
        cpu_percent=12.4, rss_bytes=80_000_000, log_lost_bytes=0,
    )  # fmt: skip
    return msgspec.structs.replace(usual, **fields)


def supervised(*processes: ProcessReport, **fields: Any) -> SupervisorStatus:
    usual = SupervisorStatus(
        verdict="whole", reason="", held=False, log_dir="/logs", processes=list(processes)
    )
    return msgspec.structs.replace(usual, **fields)


def row(heard: Heard, name: str, tokens: set[str] | None = None) -> dict[str, str]:
    cells = next(one for one in rows(heard, tokens or set()) if one[0] == name)
    return dict(zip(COLUMNS, cells, strict=True))


def test_a_row_a_process_of_the_table_the_router_too() -> None:
    heard = Heard()
    heard.on_supervisor(supervised(report("router"), report("sim", restarts=2), report("arms")))
    assert [one[0] for one in rows(heard, set())] == ["router", "sim", "arms"]
    assert row(heard, "sim") | {"process": ""} == {
        **dict.fromkeys(COLUMNS, ""),
        **{"state": "ready", "pid": "41", "again": "2", "cpu": "12 %", "memory": "80 MB"},
    }


def test_rates_queue_lag_and_drops_are_of_the_last_two_reports_of_health() -> None:
    heard = Heard()
    heard.on_supervisor(supervised(report("sim"), report("sa")))
    heard.on_health(health("sim", stamp_ns=0, received=10, published=100, tick=90))
    heard.on_health(
        health(
            "sim", stamp_ns=500_000_000, received=35, published=150, tick=100, queue_depth=3,
            malformed=1, refused=2, wrong_trial=4, queue_dropped=8, gaps=5,
        )
    )  # fmt: skip
    heard.on_health(health("sa", tick=97))
    sim, sa = row(heard, "sim"), row(heard, "sa")
    assert (sim["in/s"], sim["out/s"]) == ("50", "100")
    assert (sim["tick"], sim["lag"], sim["queue"], sim["drops"], sim["gaps"]) == (
        *("100", "0"),
        *("3", "15", "5"),
    )
    assert (sa["tick"], sa["lag"], sa["in/s"]) == ("97", "3", "-")


def test_a_new_life_does_not_give_a_rate_with_the_last_one() -> None:
    heard = Heard()
    heard.on_health(health("sim", stamp_ns=0, received=1000))
    heard.on_health(health("sim", stamp_ns=500_000_000, received=2, source="sim/2"))
    assert row(heard, "sim")["in/s"] == "-"
    assert not heard.is_full()


@pytest.mark.parametrize(
    ("state", "said"),
    [
        ({"state": "waiting", "starts_in_s": 3.21, "pid": 0}, "starts again in 3.2 s"),
        ({"state": "given_up", "pid": 0}, "given up"),
        ({"state": "starting"}, "starting"),
    ],
)
def test_what_the_supervisor_says_goes_before_the_last_health(
    state: dict[str, Any], said: str
) -> None:
    heard = Heard()
    heard.on_health(health("sim"))
    heard.on_supervisor(supervised(report("sim", **state)))
    assert row(heard, "sim")["state"] == said


def test_a_ready_process_that_waits_for_another_says_so() -> None:
    heard = Heard()
    heard.on_supervisor(supervised(report("motion")))
    heard.on_health(health("motion", state="waiting: sa"))
    assert row(heard, "motion")["state"] == "waiting: sa"


def test_one_that_does_not_run_uses_nothing() -> None:
    heard = Heard()
    heard.on_supervisor(supervised(report("sim", state="given_up", pid=0)))
    assert [row(heard, "sim")[one] for one in ("pid", "cpu", "memory")] == ["-", "-", "-"]


def test_without_a_supervisor_there_are_the_services_and_their_health() -> None:
    heard = Heard()
    heard.on_health(health("sa"))
    assert [one[0] for one in rows(heard, set())] == list(SERVICES)
    assert (row(heard, "sa")["state"], row(heard, "sa")["memory"]) == ("ready", "50 MB")
    assert row(heard, "sim")["state"] == "absent"
    assert row(heard, "sim", {"ready/sim"})["state"] == "ready, no health yet"


def test_there_is_all_once_every_service_was_heard_twice_and_the_supervisor() -> None:
    heard = Heard()
    for _ in range(2):
        for service in SERVICES:
            assert not heard.is_full()
            heard.on_health(health(service))
    assert not heard.is_full()
    heard.on_supervisor(supervised(report("sim")))
    assert heard.is_full()


def test_below_stand_the_verdict_the_ends_the_holds_and_the_task() -> None:
    heard = Heard()
    lost = report("sim", state="given_up", last_exit="by signal 9")
    heard.on_supervisor(
        supervised(lost, verdict="safe_hold", reason="sim was given up: 5 times", held=True)
    )
    heard.on_health(health("motion", facts={"holds": "supervisor: sim"}))
    heard.on_task(
        TaskStatus(
            phase="idle", action="", goal_id="", tried=[], plans=1, replans=0, outcome="aborted",
            reason="hold:sim", scenario_kind="A", actions=[], violations=[], trial="t",
        )
    )  # fmt: skip
    assert [text for text, _ in remarks(heard)] == [
        "safe hold: sim was given up: 5 times; motion holds the arms",
        "sim last ended by signal 9",
        "the arms are stopped by supervisor: sim: lift it with `fras resume`",
        "task t: idle aborted hold:sim",
    ]


def test_it_fits_a_terminal_of_eighty_columns() -> None:
    heard = Heard()
    names = ("recorder", "planner")
    heard.on_supervisor(supervised(*(report(one, pid=1_234_567) for one in names)))
    for name in names:
        for stamp_ns in (0, 500_000_000):
            heard.on_health(health(name, stamp_ns=stamp_ns, received=stamp_ns // 10**6, tick=9_999))
    console = Console(width=80, record=True)
    console.print(render("cell", heard, set()))
    # Title, head, two rows: nothing was folded.
    assert len(console.export_text().splitlines()) == 4


def test_what_was_dropped_and_refused_is_told_by_name() -> None:
    heard = Heard()
    heard.on_health(health("sim"))
    heard.on_health(health("sa", malformed=1, wrong_trial=4))
    heard.on_health(
        health("motion", refused=2, queue_dropped=8, refusals={"hold": 3, "too_many_queries": 30})
    )
    assert [text for text, _ in remarks(heard)] == [
        "motion dropped 2 refused, 8 for lack of room; "
        "refused or stopped: hold 3, too_many_queries 30",
        "sa dropped 1 malformed, 4 of another trial",
    ]


def test_two_hosts_are_shown_together_and_one_that_is_silent_by_its_services() -> None:
    heard = Heard()
    heard.on_supervisor(supervised(report("router-a"), report("motion"), host="A"))
    assert {"motion", "sim", "sa"} < {one[0] for one in rows(heard, set())}
    assert row(heard, "sim")["state"] == "absent"
    lost = report("sim", state="given_up", pid=0)
    b = supervised(lost, report("sa"), host="B", verdict="safe_hold", reason="sim was given up")
    heard.on_supervisor(b)
    assert row(heard, "sim")["state"] == "given up"
    assert row(heard, "router-a")["state"] == "ready"
    assert ("host B, safe hold: sim was given up", "bold red") in remarks(heard)
    assert not any(text.startswith("host A") for text, _ in remarks(heard))


def test_a_page_beside_the_stack_has_a_row_with_its_process_for_as_long_as_it_is_there() -> None:
    heard = Heard()
    heard.on_supervisor(supervised(report("sim")))
    facts = {"pid": "4711", "address": "http://127.0.0.1:8080/", "pages": "2"}
    heard.on_health(health("monitor", facts=facts))
    there = {"alive/monitor", "ready/monitor"}
    assert [one[0] for one in rows(heard, there)] == ["sim", "monitor"]
    page = row(heard, "monitor", there)
    assert (page["state"], page["pid"], page["memory"]) == ("ready", "4711", "50 MB")
    assert page_remarks(heard, there) == [
        ("the surgeon's page: http://127.0.0.1:8080/, open now: 2", "")
    ]
    # What it said last is no sign that it is still there.
    assert [one[0] for one in rows(heard, set())] == ["sim"]
    assert page_remarks(heard, set()) == []


def test_a_page_that_is_heard_is_waited_for_until_it_has_rates() -> None:
    heard = Heard()
    heard.on_supervisor(supervised(report("sim")))
    for service in (*SERVICES, *SERVICES, "monitor"):
        heard.on_health(health(service))
    assert not heard.is_full()
    heard.on_health(health("monitor"))
    assert heard.is_full()
