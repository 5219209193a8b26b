"""Reads a log once, from front to back, and hands what it shows to the writers."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Protocol

from fras_common.extras import require_extra
from fras_common.scenario import Scenario
from fras_log.about import refuse_newer, scenario_of, trial_of
from fras_log.errors import ForeignLog
from fras_log.export.facts import Fact, Moment, Sentence
from fras_log.export.outputs import Format, NothingToExport, appearing, check_outputs
from fras_log.export.teller import Teller
from fras_log.reader import LogReader

Progress = Callable[[float], None]


class Sink(Protocol):
    """A file under way."""

    def write(self, fact: Fact) -> None:
        """Take in what a fact shows."""
        ...

    def close(self, damage: str) -> None:
        """Finish the file; `damage` is what ended the log early."""
        ...


@dataclass(frozen=True)
class Exported:
    """What an export did.

    Parameters
    ----------
    trial : str
    outputs : mapping of Format to Path
    last_tick : int
        -1 where no tick was recorded.
    malformed : int
        Messages that could not be understood, left out.
    damage : str
        What ended the log early; empty where nothing did.
    """

    trial: str
    outputs: Mapping[Format, Path]
    last_tick: int
    malformed: int
    damage: str


def export(
    log: Path,
    outputs: Mapping[Format, Path],
    overwrite: bool = False,
    progress: Progress = lambda share: None,
) -> Exported:
    """Write a log's trial in each of the formats; the files appear when all of them are whole.

    Parameters
    ----------
    log : Path
        Read only.
    outputs : mapping of Format to Path
    overwrite : bool
        Whether files that exist are written over.
    progress : callable
        Told now and then which share of the log has been read.

    Raises
    ------
    NoSuchLog, NotAnMcap, ForeignLog, NewerLog, ScenarioError
        There is nothing to export. Nothing is written.
    NothingToExport, OutputExists, OutputIsLog, OutputUnwritable
    MissingExtra
        A format's library is not installed.
    """
    check_outputs(log, outputs.values(), overwrite)
    with ExitStack() as files:
        reader = LogReader(log)
        facts = _Facts(reader, progress)
        first = next(facts, None)
        if first is None:
            raise facts.nothing()
        places = {kind: files.enter_context(appearing(path)) for kind, path in outputs.items()}
        about = _about(reader)
        sinks = [_open(kind, place, about, facts.scenario, files) for kind, place in places.items()]
        last = first
        for sink in sinks:
            sink.write(first)
        for last in facts:
            for sink in sinks:
                sink.write(last)
        for sink in sinks:
            if reader.damage:
                sink.write(_ending(last.moment, reader.damage))
            sink.close(reader.damage)
    return Exported(
        trial=about["trial"],
        outputs=dict(outputs),
        last_tick=facts.teller.tick,
        malformed=facts.teller.malformed,
        damage=reader.damage,
    )


class _Facts(Iterator[Fact]):
    """The facts of a log, one after the other."""

    teller: Teller
    scenario: Scenario

    def __init__(self, reader: LogReader, progress: Progress) -> None:
        self._reader = reader
        self._progress = progress
        self._messages = 0
        self._source = self._told()

    def __next__(self) -> Fact:
        return next(self._source)

    def nothing(self) -> ForeignLog | NothingToExport:
        """Say why there was no fact."""
        if self._messages and self.teller.known == 0:
            return ForeignLog(self._reader.path, "it holds no message of a key that FRAS knows")
        return NothingToExport(self._reader.path, self._reader.damage)

    def _told(self) -> Iterator[Fact]:
        size = max(1, self._reader.size)
        for message in self._reader.messages():
            if not self._messages:
                self._understand_log()
            self._messages += 1
            yield from self.teller.tell(message)
            self._progress(self._reader.bytes_read / size)
        if not self._messages:
            self._understand_log()

    def _understand_log(self) -> None:
        # The version first: what else a newer log says of itself may not be understood.
        refuse_newer(self._reader)
        trial = trial_of(self._reader)
        self.scenario = scenario_of(self._reader)
        self.teller = Teller(trial, self.scenario)


def _open(
    kind: Format, place: Path, about: dict[str, str], scenario: Scenario, files: ExitStack
) -> Sink:
    """Open a writer; its library is imported only now."""
    if kind is Format.RERUN:
        with require_extra("rerun"):
            from fras_log.export.rerun import RerunFile
        return RerunFile(place, about, scenario.tissue.dt_s)
    with require_extra("export"):
        from fras_log.export.foxglove import FoxgloveFile
    return FoxgloveFile(files.enter_context(place.open("wb")), about)


def _about(reader: LogReader) -> dict[str, str]:
    told = {
        name: reader.metadata[name]
        for name in ("trial", "fras_version", "scenario")
        if name in reader.metadata
    }
    return {**told, "log": reader.path.name, "exported_by": f"fras {version('fras')}"}


def _ending(moment: Moment, damage: str) -> Sentence:
    """Say in the viewer, too, that there is no more."""
    return Sentence(moment, "error", "export", f"the log ends here, early: {damage}")
