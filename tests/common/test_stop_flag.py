"""A process stops on SIGINT, on SIGTERM, and when its supervisor dies; once, and for sure."""

import os
import signal
import subprocess
import sys
import threading

import pytest

from fras_common.signals import StopFlag, silent_interrupt

WAITER = """
from fras_common.signals import StopFlag
stop = StopFlag()
stop.install()
stop.on_set = lambda: print("asked", flush=True)
print("up", flush=True)
stop.wait()
stop.wait()
print("set" if stop.is_set() else "unset", flush=True)
"""

STUCK = """
import signal
import fras_common.signals as signals
signals.GRACE_S = 0.05
stop = signals.StopFlag()
stop.install()
print("up", flush=True)
while True:
    signal.pause()
"""

# A lock that is not reentrant would stand still here sooner or later.
HAIL = """
import signal
from fras_common.signals import StopFlag
flag = StopFlag()
signal.signal(signal.SIGALRM, lambda number, frame: flag.set())
print("up", flush=True)
signal.setitimer(signal.ITIMER_REAL, 1e-4, 1e-4)
for _ in range(10_000):
    flag = StopFlag()
    flag.wait()
signal.setitimer(signal.ITIMER_REAL, 0)
print("all stopped", flush=True)
"""


def start(code: str, parent: str = "") -> subprocess.Popen[str]:
    environment = {name: value for name, value in os.environ.items() if name != "FRAS_PARENT"}
    if parent:
        environment["FRAS_PARENT"] = parent
    process = subprocess.Popen(
        [sys.executable, "-c", code],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=environment,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "up\n"
    return process


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_asks_for_the_stop(number: signal.Signals):
    with start(WAITER) as process:
        process.send_signal(number)
        assert process.communicate(timeout=20)[0] == "asked\nset\n"
    assert process.returncode == 0


def test_signals_that_interrupt_each_other_neither_block_nor_break():
    with start(HAIL) as process:
        assert process.communicate(timeout=30)[0] == "all stopped\n"
    assert process.returncode == 0


def test_the_supervisors_death_asks_for_the_stop():
    # Told on a thread of its own, which may not come to say so before the main one is through.
    with start(WAITER.replace('print("asked", flush=True)', "None"), parent="stdin") as process:
        assert process.stdin is not None
        process.stdin.write("still here\n")
        process.stdin.flush()
        assert process.poll() is None
        assert process.communicate(timeout=20)[0] == "set\n"
    assert process.returncode == 0


def test_an_orphan_whose_main_thread_is_stuck_ends_all_the_same():
    with start(STUCK, parent="stdin") as process:
        process.communicate(timeout=20)
    assert process.returncode == 1


def test_without_a_supervisor_stdin_means_nothing():
    with start(WAITER) as process:
        assert process.stdin is not None
        process.stdin.close()
        process.stdin = None
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(0.2)
        process.send_signal(signal.SIGINT)
        assert process.communicate(timeout=20)[0] == "asked\nset\n"


def test_all_who_wait_are_woken():
    stop = StopFlag()
    waiters = [threading.Thread(target=stop.wait) for _ in range(3)]
    for waiter in waiters:
        waiter.start()
    assert not stop.is_set()
    stop.set()
    for waiter in waiters:
        waiter.join(10.0)
        assert not waiter.is_alive()
    assert stop.is_set()


def test_an_interrupt_raises_again_once_libraries_are_loaded():
    before = signal.getsignal(signal.SIGINT)
    try:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        with silent_interrupt():
            assert signal.getsignal(signal.SIGINT) is signal.SIG_DFL
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
        # Whoever is to ignore it, as a job in the background, still does.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        with silent_interrupt():
            assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)
