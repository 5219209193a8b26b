"""The rounds of `fras bench fuzz`: what gets hostile payloads, and what may not happen then.

Decoders: each payload either is what its key promises, or `MalformedMessage`. Services: the five
shells in one process, in the middle of a trial, get it on their keys and as questions. A trial:
what is refused must not change it. Files: scenarios, process tables, contexts, rules, manifests,
meshes and logs, damaged.
"""

import time
import traceback
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import msgspec
import psutil
from benchmarks.fuzz_files import Readers, file_payload
from benchmarks.fuzz_genuine import TRIAL, UNASKED, genuine_payloads
from benchmarks.fuzz_payloads import Hostile, Payload
from benchmarks.fuzz_stack import Heard, Stack, run_trial, stack

from fras_common.codec import MalformedMessage, decode, encode, read_header
from fras_common.errors import FrasError
from fras_common.messages import ContextRequest, Fault
from fras_common.topics import QUERIES, Qos, topic_of

LIMIT_S: Final = 10.0
"""For one payload, whatever it asks for; a scenario may ask for a mesh at its limits."""
GROWTH_BYTES: Final = 1 * 2**30
ASKED: Final = {query.key: query for query in QUERIES}


@dataclass
class Findings:
    """What went wrong, and what was done."""

    wrong: list[str] = field(default_factory=list[str])
    done: Counter[str] = field(default_factory=Counter[str])
    slowest_s: float = 0.0
    slowest: str = ""

    def add(self, where: str, payload: Payload, problem: str) -> None:
        """Note what must not be."""
        shown = payload.data[:60].hex()
        self.wrong.append(f"{where}: {payload.key} ({payload.kind}, {shown}): {problem}")

    def took(self, where: str, payload: Payload, since_s: float) -> None:
        """Note how long a payload took."""
        took_s = time.perf_counter() - since_s
        if took_s > self.slowest_s:
            self.slowest_s, self.slowest = took_s, f"{where}: {payload.key} ({payload.kind})"
        if took_s > LIMIT_S:
            self.add(where, payload, f"took {took_s:.1f} s, {LIMIT_S:g} are allowed")


# --- decoders -----------------------------------------------------------------------------------


def fuzz_decoders(hostile: Hostile, keys: Sequence[str], payloads: int, found: Findings) -> None:
    """Decode payloads as their keys' types, and as what each other thing reads of them."""
    for number in range(payloads):
        payload = hostile.payload(keys[number % len(keys)])
        since_s = time.perf_counter()
        topic = topic_of(payload.key)
        query = ASKED.get(payload.key.removeprefix("?"))
        kind = query.request if query is not None else topic.type if topic is not None else None
        try:
            read_header(payload.data)
            if kind is not None:
                encode(decode(kind, payload.data, payload.key))
            outcome = "taken"
        except MalformedMessage:
            outcome = "malformed"
        except Exception:  # noqa: BLE001 - whatever it is, it is what is looked for
            outcome = "wrong"
            found.add("decoder", payload, traceback.format_exc(limit=-4))
        found.done[f"decoders: {outcome}"] += 1
        found.took("decoder", payload, since_s)


# --- services -----------------------------------------------------------------------------------


def send(one: Stack, payload: Payload, found: Findings) -> None:
    """Give a payload to whoever reads its key, and look at what becomes of it."""
    since_s = time.perf_counter()
    one.now_s += 10.0
    before = one.malformed
    try:
        expected, answers = _give(one, payload)
        one.turn(rounds=2)
    except Exception:  # noqa: BLE001 - whatever it is, it is what is looked for
        found.add("service", payload, traceback.format_exc(limit=-6))
        found.done["services: wrong"] += 1
        return
    counted = one.malformed - before
    if counted != expected:
        found.add("service", payload, f"counted {counted} times, {expected} services read it")
    for answer in answers:
        if isinstance(answer, Fault) and answer.kind == "InternalFault":
            found.add("service", payload, f"an internal fault: {answer.text}")
    found.done[f"services: {'malformed' if expected else 'taken'}"] += 1
    found.took("service", payload, since_s)


def _give(one: Stack, payload: Payload) -> tuple[int, list[bytes | Fault]]:
    """Send it; how often it must be counted as malformed, and the list of its answers."""
    key = payload.key.removeprefix("?")
    if key == payload.key:
        topic = topic_of(key)
        readers = one.readers(key) if topic is not None else 0
        broken = topic is not None and not _fits(topic.type, payload, topic.max_bytes)
        one.put(key, payload.data)
        return readers if broken else 0, []
    query = ASKED[key]
    broken = not _fits(query.request, payload, query.max_bytes)
    return int(broken), one.ask_raw(key, payload.data)


def _fits(kind: type[Any], payload: Payload, most_bytes: int) -> bool:
    try:
        decode(kind, payload.data, payload.key, most_bytes)
    except MalformedMessage:
        return False
    return True


def fuzz_services(
    hostile: Hostile, keys: Sequence[str], payloads: int, folder: Path, found: Findings
) -> None:
    """Send payloads to shells in the middle of trials; they must answer afterwards."""
    per_stack = 2_000
    for begun in range(0, payloads, per_stack):
        with stack(folder) as one:
            for number in range(begun, min(begun + per_stack, payloads)):
                if number % 200 == 0:
                    one.start(TRIAL, folder / f"trial-{number}")
                    one.turn(rounds=20)
                send(one, hostile.payload(keys[number % len(keys)]), found)
            still_answers(one, found)


def still_answers(one: Stack, found: Findings) -> None:
    """Ask each service something that it can only answer if its loop turns."""
    one.now_s += 10.0
    for key in ("motion/hold", "motion/resume", "recorder/last", "sa/context", "planner/why_not"):
        payload = Payload(f"?{key}", "genuine", encode(_genuine(key)))
        answers = one.ask_raw(key, payload.data)
        one.turn()
        if not answers:
            found.add("service", payload, "no answer after all that")


def _genuine(key: str) -> Any:
    if key == "sa/context":
        return ContextRequest(trial="nobody's", request_id="c", min_tick=0, expected=[])
    return UNASKED[key]


# --- a trial meanwhile --------------------------------------------------------------------------

BESIDE: Final = ("robot/state", "sim/tissue_state", "sim/tissue_model", "sa/verdict")


def fuzz_trial(
    hostile: Hostile, keys: Sequence[str], payloads: int, quiet: Heard, folder: Path,
    found: Findings,
) -> None:  # fmt: skip
    """Run the same trial among payloads that are to be refused: it must go the same way."""
    sent = 0
    with stack(folder) as one:

        def meanwhile() -> None:
            nonlocal sent
            for _ in range(max(1, payloads // 50)):
                payload = hostile.payload(keys[sent % len(keys)])
                if sent < payloads and is_refused(payload):
                    since_s = time.perf_counter()
                    one.now_s += 10.0
                    _give(one, payload)
                    found.took("trial", payload, since_s)
                sent += 1

        heard = run_trial(one, TRIAL, folder / "loud", meanwhile)
        found.done["beside a trial: refused"] += one.malformed
        found.done["beside a trial: of another trial"] += sum(
            host.gate.dropped for host in one.hosts.values()
        )
    for key in BESIDE:
        if difference := _difference(heard.get(key, []), quiet[key]):
            found.wrong.append(f"trial: {key} is not what it is without the noise: {difference}")


def _difference(loud: Sequence[bytes], quiet: Sequence[bytes]) -> str:
    for number, (one, other) in enumerate(zip(loud, quiet, strict=False)):
        here, there = _said(one), _said(other)
        if here != there:
            names = [name for name in here if here[name] != there[name]]
            return f"message {number} differs in {[(n, here[n], there[n]) for n in names]}"
    return "" if len(loud) == len(quiet) else f"{len(loud)} messages, not {len(quiet)}"


def _said(data: bytes) -> dict[str, Any]:
    """All of a message but who said it when, and how long that took."""
    tree = msgspec.msgpack.decode(data)
    if "solver" in tree:
        tree["solver"].pop("wall_s")
    return {name: tree[name] for name in tree if name not in ("stamp_ns", "seq", "source")}


def is_refused(payload: Payload) -> bool:
    """Whether nobody may act on it: it is malformed, or of a trial that there is not."""
    key = payload.key.removeprefix("?")
    query, topic = ASKED.get(key), topic_of(key)
    if key != payload.key and query is not None:
        return not _fits(query.request, payload, query.max_bytes)
    if topic is None or key.startswith(("alive", "ready")):
        return True
    if not _fits(topic.type, payload, topic.max_bytes):
        return True
    header = read_header(payload.data)
    other = header is not None and header.trial.startswith("other-")
    return topic.in_trial and topic.qos is not Qos.COMMAND and other


# --- files --------------------------------------------------------------------------------------


def fuzz_files(seed: int, payloads: int, log: Path, folder: Path, found: Findings) -> None:
    """Read damaged files of each kind."""
    readers = Readers(log, folder)
    for number in range(payloads):
        payload = file_payload(seed, number, readers.genuine)
        since_s = time.perf_counter()
        try:
            readers.read(payload)
            outcome = "read"
        except FrasError:
            outcome = "refused"
        except Exception:  # noqa: BLE001 - whatever it is, it is what is looked for
            outcome = "wrong"
            found.add("file", payload, traceback.format_exc(limit=-6))
        found.done[f"files: {outcome}"] += 1
        found.took("file", payload, since_s)


# --- all of it ----------------------------------------------------------------------------------


def fuzz(payloads: int, seed: int, folder: Path) -> Findings:
    """Do all rounds; of 100 payloads decoders get 60, services 30, a trial 8, files 2."""
    found = Findings()
    rss_bytes = psutil.Process().memory_info().rss
    with stack(folder) as one:
        quiet = run_trial(one, TRIAL, folder / "quiet", lambda: None)
        genuine = genuine_payloads(quiet)
        keys = sorted(genuine)
        served = [key for key in keys if one.hears(key)]
    hostile = Hostile(seed, genuine)
    fuzz_decoders(hostile, keys, payloads * 60 // 100, found)
    fuzz_services(hostile, served, payloads * 30 // 100, folder, found)
    fuzz_trial(hostile, served, payloads * 8 // 100, quiet, folder, found)
    log = folder / "quiet" / "audit.mcap"
    fuzz_files(seed, payloads * 2 // 100, log, folder, found)
    grown = psutil.Process().memory_info().rss - rss_bytes
    found.done["memory grown [MB]"] = grown // 10**6
    if grown > GROWTH_BYTES:
        found.wrong.append(f"memory grew by {grown / 1e6:.0f} MB")
    return found
