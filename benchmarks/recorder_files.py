"""How fast a log is written beside the library alone and the disk alone, and verified."""

import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.recorder_samples import SHAPES, samples, tissue, verdict
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from mcap.writer import CompressionType, Writer

from fras_common.bus import RawSample
from fras_common.codec import json_schema, read_header
from fras_common.messages import Header
from fras_common.topics import topic_of
from fras_log import LogFile, Signer, verify_file
from fras_log.writer import CHUNK_BYTES

_VERIFY_AND_TELL = """
import sys
from pathlib import Path
from benchmarks.memory import memory_mib
from fras_log import verify_file
before = memory_mib("VmRSS")
assert verify_file(Path(sys.argv[1])).intact
print(memory_mib("VmHWM") - before)
"""

Write = Callable[[Path, list[RawSample]], None]


def write_log(path: Path, recorded: list[RawSample]) -> None:
    """Write as the recorder does: copies looked for, chained, signed."""
    file = LogFile(path, {"trial": "bench"}, {}, 1, Signer(Ed25519PrivateKey.generate()))
    for number, sample in enumerate(recorded):
        file.write(sample, number)
    file.close({})


def write_bare(path: Path, recorded: list[RawSample]) -> None:
    """Write with the library alone and the same settings; header fields have to be read, too."""
    with path.open("wb") as stream:
        writer = Writer(
            stream,
            chunk_size=CHUNK_BYTES,
            compression=CompressionType.ZSTD,
            enable_crcs=True,
            enable_data_crcs=True,
        )
        writer.start(profile="fras", library="bench")
        topic = topic_of(recorded[0].key)
        if topic is None:
            raise ValueError(recorded[0].key)
        schema = writer.register_schema(
            topic.type.__name__, "jsonschema", repr(json_schema(topic.type)).encode()
        )
        channel = writer.register_channel(recorded[0].key, "msgpack", schema)
        for number, sample in enumerate(recorded):
            header = read_header(sample.payload)
            if header is None:
                raise ValueError(sample.key)
            writer.add_message(channel, number, sample.payload, header.stamp_ns, header.seq)
        writer.finish()


def write_raw(path: Path, recorded: list[RawSample]) -> None:
    """Write the payloads, in pieces as large as chunks, and nothing else."""
    with path.open("wb", buffering=CHUNK_BYTES) as stream:
        for sample in recorded:
            stream.write(sample.payload)
        stream.flush()


WRITERS: dict[str, Write] = {"log": write_log, "bare": write_bare, "raw": write_raw}


def measure(folder: Path, rounds: int, small: int, states: int) -> dict[str, dict[str, Any]]:
    """Time all writers in turn, and verification, for small messages and for states."""
    made: dict[str, tuple[str, list[Header], int]] = {
        "small": ("sa/verdict", [verdict(tick) for tick in range(SHAPES)], small),
        "states": ("sim/tissue_state", [tissue(tick) for tick in range(SHAPES)], states),
    }
    return {
        name: _measure_one(folder, rounds, samples(key, messages, count))
        for name, (key, messages, count) in made.items()
    }


def verify_peak_mib(folder: Path) -> float:
    """Memory that verifying a log of 300 MB of noise takes at most, in a process of its own."""
    path = folder / "large.mcap"
    file = LogFile(path, {"trial": "bench"}, {}, 1)
    noise = np.random.default_rng(1).bytes(300_000)
    for number in range(1000):
        file.write(RawSample("noise", number.to_bytes(4, "big") + noise, ""), number)
    file.close({})
    command = [sys.executable, "-c", _VERIFY_AND_TELL, str(path)]
    told = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    path.unlink()
    return round(float(told), 1)


def _measure_one(folder: Path, rounds: int, recorded: list[RawSample]) -> dict[str, Any]:
    size = sum(len(sample.payload) for sample in recorded)
    spent: dict[str, list[float]] = {name: [] for name in (*WRITERS, "verify")}
    file_size = 0
    for _ in range(rounds):
        for name, write in WRITERS.items():
            path = folder / f"{name}.bin"
            spent[name].append(_seconds(lambda write=write, path=path: write(path, recorded)))
            if name == "log":
                file_size = path.stat().st_size
                spent["verify"].append(_seconds(lambda path=path: _verify(path)))
            path.unlink()
    median = {name: float(np.median(times)) for name, times in spent.items()}
    return {
        "messages": len(recorded),
        "bytes_each": round(size / len(recorded)),
        "file_over_payload": round(file_size / size, 3),
        "mb_s": {name: round(size / 1e6 / value, 1) for name, value in median.items()},
        "messages_s": {name: round(len(recorded) / value) for name, value in median.items()},
        # Of the same round, so that a busy moment of the machine counts for both.
        "log_over_bare": round(
            float(np.median(np.array(spent["bare"]) / np.array(spent["log"]))), 2
        ),
    }


def _verify(path: Path) -> None:
    found = verify_file(path)
    if not found.intact:
        raise RuntimeError(f"a log that is not intact: {found.findings[:3]}")


def _seconds(work: Callable[[], object]) -> float:
    os.sync()
    began_s = time.perf_counter()
    work()
    return time.perf_counter() - began_s
