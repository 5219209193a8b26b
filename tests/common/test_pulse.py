"""Whether a loop turns, as its own health tells."""

import threading
from collections.abc import Callable
from typing import Any

from fras_common.service.pulse import Pulse
from fras_common.topics import HEALTH


def test_a_job_that_waits_ages_and_one_that_is_done_does_not() -> None:
    inbox: list[Callable[[], None]] = []
    pulse = Pulse(inbox.append)
    assert pulse.lag_s(10.0) == 0.0
    pulse.beat(10.0)
    pulse.beat(10.5)
    assert len(inbox) == 1
    assert pulse.lag_s(12.0) == 2.0
    inbox.pop()()
    assert pulse.lag_s(12.0) == 0.0
    pulse.beat(12.5)
    assert pulse.lag_s(13.0) == 0.5


def test_health_tells_of_a_loop_that_is_stuck_and_of_one_that_turns_again(bench: Any) -> None:
    host, heard, lags = bench.host("sim"), threading.Condition(), []

    def note(message: Any) -> None:
        with heard:
            lags.append(message.loop_lag_s)
            heard.notify()

    bench.bus("witness/1").subscribe(HEALTH, note)
    let_go, stop = threading.Event(), threading.Event()
    host.post(let_go.wait)  # a job that does not end
    threads = [
        threading.Thread(target=host.run, args=(lambda: None,)),
        threading.Thread(target=host.report_health, args=(stop,)),
    ]
    for thread in threads:
        thread.start()
    with heard:
        assert heard.wait_for(lambda: lags and lags[-1] > 0.9, 10.0)
        let_go.set()
        assert heard.wait_for(lambda: lags[-1] == 0.0, 10.0)
    stop.set()
    host.stop()
    for thread in threads:
        thread.join(10.0)
