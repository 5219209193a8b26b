"""Damaged files for every reader of files."""

import random
import re
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

import msgspec
from benchmarks.fuzz_payloads import NESTED, Payload

from fras_audit.reading import read_recorded
from fras_common.scenario import load
from fras_log import LogReader, scan_log, verify_file
from fras_log.attachments import read_attachments, rules_in
from fras_log.parts import Manifest, Part, read_manifest
from fras_planner.knowledge import load_knowledge
from fras_planner.offline import plan_file
from fras_replay.recording import read_recording
from fras_replay.selection import Selection
from fras_sim.mesh_file import read_mesh
from fras_supervisor.table import load_table

ROOT: Final = Path(__file__).resolve().parents[1]
WORDS: Final = (
    *(b"nan", b"inf", b"-1", b"1e999", b"9" * 5_000, b"true", b'""', b"[]", b"{}", b"null", b"\0"),
    *(b"[" * NESTED, b'{"a":' * NESTED, b"a." * NESTED, b"\xff\xfe", b"..", b"*INCLUDE, INPUT=x"),
    *(b"b(1,1)", b"psm1", b"#include", b":- ", b'"\\u0000"', b"2147483648", b"0x7fffffffffffffff"),
)
_NUMBER: Final = re.compile(rb"-?\d+(\.\d+)?")


def file_payload(seed: int, number: int, genuine: Mapping[str, bytes]) -> Payload:
    """Damage a file; meshes seldom, for each is read by a process of its own."""
    chance = random.Random(f"{seed}.{number}")
    names = [name for name in genuine if not name.startswith("mesh") or number % 10 == 0]
    name = chance.choice(names)
    data = genuine[name]
    place = chance.randrange(len(data) + 1)
    match chance.choice(("cut", "flipped", "word", "number", "number", "taken out", "random")):
        case "cut":
            return Payload(name, "cut", data[:place])
        case "flipped":
            changed = bytearray(data)
            for _ in range(chance.choice((1, 4, 40))):
                changed[chance.randrange(len(changed))] ^= 1 << chance.randrange(8)
            return Payload(name, "flipped", bytes(changed))
        case "word":
            return Payload(name, "word", data[:place] + chance.choice(WORDS) + data[place:])
        case "number" if found := _NUMBER.search(data, place):
            other = chance.choice(WORDS)
            return Payload(name, "number", data[: found.start()] + other + data[found.end() :])
        case "taken out":
            return Payload(name, "taken out", data[:place] + data[place + chance.randrange(200) :])
        case _:
            return Payload(name, "random", chance.randbytes(chance.randrange(2_000)))


class Readers:
    """Who reads files, by what they are.

    Parameters
    ----------
    log : Path
        Of a trial.
    folder : Path
        Where the damaged files are put.

    Attributes
    ----------
    genuine : dict of str to bytes
        Undamaged, by name.
    """

    def __init__(self, log: Path, folder: Path) -> None:
        self._folder = folder
        self._rules = folder / "asp"
        shutil.copytree(ROOT / "asp", self._rules)
        part = Part(
            file=log.name, messages=9, bytes=1, head="00", began_ns=1, ended_ns=2, reason="size"
        )
        self.genuine = {
            "scenario.toml": (ROOT / "compose/scenarios/default.toml").read_bytes(),
            "drawn.toml": (ROOT / "compose/scenarios/b.toml").read_bytes(),
            "table.toml": (ROOT / "compose/local.toml").read_bytes(),
            "contexts.json": (ROOT / "examples/contexts.json").read_bytes(),
            "manifest.json": msgspec.json.encode(Manifest(trial="t", parts=(part, part))),
            "audit.mcap": log.read_bytes(),
            "mesh.vtu": (ROOT / "compose/meshes/slab.vtu").read_bytes(),
            **{
                f"asp/{name}": (ROOT / "asp" / name).read_bytes()
                for name in ("domain.lp", "effects.lp", "constraints.lp", "verify.lp")
            },
        }
        self._read: dict[str, Callable[[Path], object]] = {
            "scenario.toml": load,
            "drawn.toml": load,
            "table.toml": load_table,
            "contexts.json": _plan,
            "manifest.json": read_manifest,
            "audit.mcap": _read_log,
            "mesh.vtu": lambda path: read_mesh(path.read_bytes(), path.name),
        }

    def read(self, payload: Payload) -> None:
        """Put a damaged file where it is read from, and have it read.

        Raises
        ------
        FrasError
            It is refused, as it may be.
        """
        path = self._folder / payload.key
        path.write_bytes(payload.data)
        if not payload.key.startswith("asp/"):
            self._read[payload.key](path)
            return
        try:
            load_knowledge(self._rules)
        finally:
            path.write_bytes(self.genuine[payload.key])


def _plan(path: Path) -> None:
    plan_file(
        path.read_bytes(),
        path.name,
        criterion="weighted",
        goal="visible",
        asp_dir=None,
        questions=[],
    )


def _read_log(path: Path) -> None:
    for _ in scan_log(path):
        pass
    verify_file(path)
    rules_in(read_attachments(path), path)
    for read in (lambda: read_recording(path, Selection()), lambda: read_recorded(path)):
        read()
    for _ in LogReader(path).messages():
        pass
