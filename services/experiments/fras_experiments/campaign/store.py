"""The results folder of a campaign: each trial kept as it comes, nothing written over."""

import errno
import fcntl
import os
import shutil
from collections.abc import Generator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Final

import msgspec

from fras_cli.run import FolderInUse
from fras_common.errors import FrasError
from fras_common.scenario import to_toml as scenario_to_toml
from fras_experiments.campaign import tables
from fras_experiments.campaign.reading import Prepared, stored_in, to_toml
from fras_experiments.campaign.records import Record, key_of

CAMPAIGN: Final = "campaign.toml"
BASE: Final = "base.toml"
RULES: Final = "asp"
PART: Final = ".part"
FULL: Final = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


class OtherCampaign(FolderInUse):
    """The folder holds the results of another campaign. Attributes: ``path``."""


class StoreUnwritable(FrasError):
    """Results can't be kept; those kept so far are whole. Attributes: ``path``."""


@dataclass(frozen=True)
class Found:
    """What a folder holds already.

    Attributes
    ----------
    records : dict of int to Record
        By the number of the trial.
    spoilt : int
        Records that can't be read; their trials are run again.
    foreign : int
        Records of another build, or of nothing that is asked for; left where they are.
    """

    records: dict[int, Record]
    spoilt: int
    foreign: int


class Store:
    """The results folder of one campaign; made by `opened`."""

    def __init__(self, folder: Path, prepared: Prepared, code: str) -> None:
        self.folder = folder
        self.code = code
        self._prepared = prepared
        self._records = folder / "records"
        self._keys = {
            one.number: key_of(code, one.scenario, prepared.mesh) for one in prepared.trials
        }

    def load(self) -> Found:
        """Read what is there."""
        decoder = msgspec.json.Decoder(Record)
        records: dict[int, Record] = {}
        spoilt = 0
        for number, key in self._keys.items():
            try:
                records[number] = decoder.decode(self._file(key).read_bytes())
            except FileNotFoundError:
                continue
            except (msgspec.DecodeError, OSError):
                spoilt += 1
        known = set(self._keys.values())
        foreign = sum(one.stem not in known for one in self._records.glob("*.json"))
        return Found(records, spoilt, foreign)

    def put(self, number: int, record: Record, files: Mapping[str, bytes]) -> Record:
        """Keep a trial, with the files of its log; whole or not at all.

        Returns
        -------
        Record
            With the place of its log.

        Raises
        ------
        StoreUnwritable
            The disk is full, or the like; what was kept before is not touched.
        """
        folder = self.folder / "logs" / str(number)
        try:
            if files:
                shutil.rmtree(folder, ignore_errors=True)
                folder.mkdir(parents=True)
                for name, content in files.items():
                    (folder / name).write_bytes(content)
                log = next((name for name in files if name.endswith(".mcap")), "")
                where = f"logs/{number}/{log}" if log else ""
                record = msgspec.structs.replace(record, log=where)
            _write(self._file(self._keys[number]), msgspec.json.encode(record))
        except OSError as error:
            shutil.rmtree(folder, ignore_errors=True)
            raise self.unwritable(error) from error
        return record

    def write_tables(self, records: Mapping[int, Record]) -> None:
        """Write all tables anew from the records.

        Raises
        ------
        StoreUnwritable
        """
        campaign, trials = self._prepared.campaign, self._prepared.trials
        content = {
            f"series/{number}.csv": tables.series_csv(record.series)
            for number, record in records.items()
        }
        content["timing.csv"] = tables.timing_csv(trials, records)
        content["trials.csv"] = tables.trials_csv(
            campaign.name, self._prepared.base.name, campaign.varied, trials, records
        )
        try:
            (self.folder / "series").mkdir(exist_ok=True)
            for name, text in content.items():
                _write(self.folder / name, text.encode(), sync=not name.startswith("series/"))
        except OSError as error:
            raise self.unwritable(error) from error

    def _file(self, key: str) -> Path:
        return self._records / f"{key}.json"

    def unwritable(self, error: OSError) -> StoreUnwritable:
        """Tell why nothing can be kept, and what is kept."""
        kept = sum(self._file(key).exists() for key in self._keys.values())
        full = "the disk is full" if error.errno in FULL else "it can't be written"
        return StoreUnwritable(
            f"{self.folder}: {full} ({error.strerror or error}); {kept} of {len(self._keys)} "
            "trials are kept and whole: make room, and give the same command with "
            f"--out {self.folder} to go on",
            path=self.folder,
        )


@contextmanager
def opened(folder: Path, prepared: Prepared, code: str) -> Generator[Store]:
    """Open a results folder, new or of the same campaign; nobody else may within the block.

    Parameters
    ----------
    code : str
        What computes the trials, see `code_version`.

    Raises
    ------
    OtherCampaign
        The folder holds another campaign's results, or this one's of another version of its file.
    FolderInUse
        It holds something else, can't be made, or another command is at work in it.
    StoreUnwritable
    """
    store = Store(folder, prepared, code)
    marker = folder / CAMPAIGN
    try:
        if not marker.exists():
            if folder.exists() and any(one.suffix != PART for one in folder.iterdir()):
                raise FolderInUse(
                    f"{folder} is not empty, and holds no campaign: choose another --out",
                    path=folder,
                )
            _begin(folder, prepared, code)
        name, stored = stored_in(marker)
        if stored.get("digest") != prepared.digest:
            raise OtherCampaign(_other(folder, name, stored, prepared), path=folder)
        _complete(folder, prepared)
        lock = marker.open("rb")
    except OSError as error:
        if error.errno in FULL:
            raise store.unwritable(error) from error
        raise FolderInUse(
            f"{folder}: can't be written ({error.strerror or error}): choose another --out",
            path=folder,
        ) from error
    with lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            text = f"{folder}: another `fras experiment` is at work in it: wait for its end"
            raise FolderInUse(text, path=folder) from error
        for part in (folder / "records").glob(f".*{PART}"):
            part.unlink(missing_ok=True)
        yield store


def _begin(folder: Path, prepared: Prepared, code: str) -> None:
    """Write what the folder is of."""
    campaign = prepared.campaign
    if campaign.scenario.endswith(".toml"):
        campaign = replace(campaign, scenario=BASE)
    folder.mkdir(parents=True, exist_ok=True)
    noted = {"digest": prepared.digest, "fras": version("fras"), "code": code}
    _write(folder / CAMPAIGN, to_toml(campaign, noted).encode())


def lay_out_rules(folder: Path, rules: Mapping[str, str]) -> Path:
    """Write rules into a folder that `--asp-dir` takes; return it."""
    for name, text in rules.items():
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        _write(file, text.encode(), sync=False)
    return folder


def _complete(folder: Path, prepared: Prepared) -> None:
    """Write base scenario and rules beside, if whoever began the folder was killed before."""
    (folder / "records").mkdir(exist_ok=True)
    lay_out_rules(folder / RULES, prepared.rules)
    if (folder / BASE).exists():
        return
    base = prepared.base
    if base.tissue.mesh_file is not None:
        bare = Path(base.tissue.mesh_file).name
        tissue = msgspec.structs.replace(base.tissue, mesh_file=bare)
        base = msgspec.structs.replace(base, tissue=tissue)
        _write(folder / bare, prepared.mesh)
    _write(folder / BASE, scenario_to_toml(base).encode())


def _other(folder: Path, name: str, stored: Mapping[str, str], prepared: Prepared) -> str:
    asked = prepared.campaign.name
    there = f"the campaign {name!r} ({stored.get('digest', '')[:12]})"
    which = "other trials of it" if name == asked else f"those of {asked!r}"
    return (
        f"{folder} holds results of {there}, and {which} are asked for ({prepared.digest[:12]}): "
        "choose another --out, or give the options that it was begun with"
    )


def _write(path: Path, content: bytes, sync: bool = True) -> None:
    """Write a file whole, or leave the one before."""
    part = path.with_name(f".{path.name}{PART}")
    try:
        with part.open("wb") as file:
            file.write(content)
            file.flush()
            if sync:
                os.fsync(file.fileno())
        part.replace(path)
    except OSError:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        raise
