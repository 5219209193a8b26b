"""Decoders that several threads ask for at once, in a process of its own: a fault would end it."""

import subprocess
import sys

ROUNDS = """
import sys, threading
from typing import Literal
import msgspec
from fras_common.codec import decode, encode

sys.setswitchinterval(1e-6)
PAYLOAD = encode({"tick": 1, "arms": {"psm1": {"pose": {"m": [1.0, 2.0, 3.0]}, "state": "ON"}}})

def fresh():
    class Pose(msgspec.Struct):
        m: tuple[float, float, float]
    class Arm(msgspec.Struct):
        pose: Pose
        state: Literal["ON", "OFF"]
        height: float | None = None
    class Header(msgspec.Struct):
        tick: int = 0
    class State(Header, kw_only=True):
        arms: dict[str, Arm]
    return State

for _ in range(400):
    kind, together = fresh(), threading.Barrier(4)
    def once():
        together.wait()
        assert decode(kind, PAYLOAD, "key").arms["psm1"].pose.m == (1.0, 2.0, 3.0)
    threads = [threading.Thread(target=once) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
print("all of them")
"""


def test_a_kind_that_several_threads_meet_first_at_once_is_decoded():
    command = [sys.executable, "-c", ROUNDS]
    done = subprocess.run(command, capture_output=True, text=True, timeout=250, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "all of them\n", "")
