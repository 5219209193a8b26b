"""What a worker of a campaign does: it keeps a stack, and runs one trial after the other on it."""

import asyncio
import os
import shutil
import signal
import threading
import time
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Final

import msgspec
import psutil
from distributed import Worker, WorkerPlugin, get_worker

from fras_cli.layout import Layout
from fras_cli.options import TrialInput
from fras_cli.report import read_trial
from fras_cli.stack import UsedStack, own_stack
from fras_cli.trial import TrialFollower, TrialView
from fras_common.errors import FrasError
from fras_common.scenario import Scenario
from fras_experiments.campaign.code import code_digest, code_version
from fras_experiments.campaign.measure import measure, planning_in, series_of
from fras_experiments.campaign.records import (
    PLANNED,
    SUCCESS,
    Record,
    Timing,
    until_plan,
    without_result,
)
from fras_experiments.campaign.spec import Until
from fras_experiments.campaign.store import lay_out_rules
from fras_experiments.following import LOG, follow_to_end, lay_out

READY_S: Final = 60.0
PATIENCE_S: Final = 900.0
IDLE_S: Final = 60.0
ROOM_BYTES: Final = 256 * 2**20
TOO_LONG: Final = "campaign: the trial takes too long"
HAS_PLAN: Final = "campaign: it was to end with its first plan"
WELL: Final = (SUCCESS, PLANNED)


@dataclass(frozen=True)
class Task:
    """A trial to run; `scenario` is one as JSON, resolved."""

    campaign: str
    number: int
    scenario: bytes
    until: Until = "end"


@dataclass(frozen=True)
class Done:
    """What a worker has to say of a task.

    Attributes
    ----------
    record : Record or None
        None where this worker can't run trials.
    files : dict of str to bytes
        Of its log, if that is to be kept.
    problem : str
        Why there is no record.
    """

    number: int
    record: Record | None
    files: dict[str, bytes]
    problem: str = ""


@dataclass(frozen=True)
class _Held:
    """A stack that runs."""

    used: UsedStack
    follower: TrialFollower
    logs: Path
    patient: bool


class Keeper(WorkerPlugin):
    """Keeps a worker's stack: started for its first trial, ended with the worker.

    One that died is replaced for the next trial. A stack that has had nothing to do for a minute
    ends, too: whoever handed out the trials may have been killed.

    Parameters
    ----------
    name : str
        Of the campaign on its cluster.
    mesh : bytes
        Content of the mesh file of all scenarios.
    keep : {"failed", "all", "none"}
        Which logs travel back.
    code : str
        Digest of the code that is to compute.
    own : bool
        Whether the worker is ours, and a Ctrl-C at the terminal not meant for it.
    rules : mapping of str to str
        Of the planner, where they are not those supplied: text by path.
    """

    def __init__(
        self,
        name: str,
        mesh: bytes,
        keep: str,
        code: str,
        *,
        own: bool,
        rules: Mapping[str, str] = MappingProxyType({}),
    ) -> None:
        self.name = name
        self._mesh = mesh
        self._keep = keep
        self._code = code
        self._own = own
        # A mapping proxy does not travel.
        self._rules = dict(rules)
        self._over = False
        self._lives = 0
        self._held: _Held | None = None

    def setup(self, worker: Worker) -> None:
        """Begin on a worker; its stack starts with its first trial."""
        if self._own and threading.current_thread() is threading.main_thread():
            # Whoever started it ends it, in order.
            signal.signal(signal.SIGINT, signal.SIG_IGN)
            signal.signal(signal.SIGHUP, signal.SIG_IGN)
        self._worker = str(worker.name)
        self._folder = Path(worker.local_directory) / self.name
        self._turn = threading.Lock()
        self._inside = ExitStack()
        self._idle: threading.Timer | None = None

    async def teardown(self, worker: Worker) -> None:
        """End the trial under way and the stack."""
        self._over = True
        if self._idle is not None:
            self._idle.cancel()
        await asyncio.to_thread(self._end)

    def run(self, task: Task) -> Done:
        """Run a trial; whatever becomes of it is told, not raised."""
        with self._turn:
            if self._over:
                return self._unable(task, "it was told to end")
            if self._idle is not None:
                self._idle.cancel()
            try:
                return self._run(task)
            finally:
                self._idle = threading.Timer(IDLE_S, self._end)
                self._idle.daemon = True
                self._idle.start()

    def _run(self, task: Task) -> Done:
        if code_digest() != self._code:
            return self._unable(task, "its FRAS is another version than the one that asks")
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            if full := self._full():
                return self._unable(task, full)
            given = TrialInput(msgspec.json.decode(task.scenario, type=Scenario), self._mesh)
            held = self._stack(patient=given.scenario.has_patient)
        except (FrasError, OSError) as error:
            return self._unable(task, f"no stack could be started: {error}")
        folder = self._folder / f"trial-{task.number}"
        shutil.rmtree(folder, ignore_errors=True)
        began_s, cpu_began_s = time.monotonic(), _cpu_s()
        died = self._play(held, f"{self.name}-{task.number}", given, folder, task.until)
        if self._over:
            return self._unable(task, "it was told to end")
        timing = Timing(worker=self._worker, wall_s=0.0, cpu_s=0.0)
        record = _record(given.scenario, folder / LOG, died, timing)
        timing = msgspec.structs.replace(
            record.timing,
            wall_s=round(time.monotonic() - began_s, 3),
            cpu_s=round(max(0.0, _cpu_s() - cpu_began_s), 3),
        )
        record = msgspec.structs.replace(record, timing=timing)
        if record.result.outcome == "aborted" and (full := self._full()):
            # It says nothing of the scene, and would not be run again.
            return self._unable(task, full)
        ended_well = not died and record.result.complete and record.result.outcome in WELL
        files: dict[str, bytes] = {}
        if self._keep == "all" or (self._keep == "failed" and not ended_well):
            files = _packed(folder, held.logs if died else None)
        shutil.rmtree(folder, ignore_errors=True)
        if died or not held.used.link.wait_complete(READY_S):
            self._close()
        return Done(task.number, record, files)

    def _full(self) -> str:
        """Tell that a log may find no room; empty while it does."""
        room = shutil.disk_usage(self._folder).free
        short = room < ROOM_BYTES
        return f"the disk is full: {room >> 20} MiB free in {self._folder}" if short else ""

    def _play(self, held: _Held, trial: str, given: TrialInput, folder: Path, until: Until) -> str:
        """Run a trial; return why its stack serves no more, or nothing."""
        until_s = time.monotonic() + PATIENCE_S

        def why_end(view: TrialView) -> str:
            # A plan without actions ends the trial by itself: there is none, or nothing to do.
            if until == "plan" and view.plan is not None and view.plan.actions:
                return HAS_PLAN
            return TOO_LONG if time.monotonic() > until_s else ""

        try:
            lay_out(folder, given)
            ended = follow_to_end(
                held.follower,
                trial,
                given,
                folder,
                until=why_end,
                give_up=lambda: self._over or time.monotonic() > until_s + READY_S,
            )
        except (FrasError, OSError) as error:
            return str(error)
        return "" if ended else TOO_LONG

    def _stack(self, *, patient: bool) -> _Held:
        """Return the stack that is there, or start one.

        One with a patient serves trials without, too.

        Raises
        ------
        FrasError
            None could be started, tried twice.
        """
        if self._held is not None and self._held.used.watch():
            self._close()
        if self._held is not None and patient and not self._held.patient:
            self._close()
        rules = lay_out_rules(self._folder / "asp", self._rules) if self._rules else None
        for last in (False, True):
            if self._held is not None:
                break
            self._lives += 1
            cell = f"{self.name}-{os.getpid()}-{self._lives}"
            logs = self._folder / f"stack-{self._lives}"
            try:
                used = self._inside.enter_context(
                    own_stack(
                        cell,
                        None,
                        logs,
                        cancelled=lambda: self._over,
                        layout=Layout(asp_dir=rules, patient=patient),
                    )
                )
            except FrasError:
                # Somebody may have taken the port in between.
                if last or self._over:
                    raise
            else:
                self._held = _Held(used, TrialFollower(used), logs, patient)
        if self._held is None:
            raise AssertionError
        return self._held

    def _end(self) -> None:
        with self._turn:
            self._close()
            if self._over:
                shutil.rmtree(self._folder, ignore_errors=True)

    def _close(self) -> None:
        self._held = None
        self._inside.close()

    def _unable(self, task: Task, why: str) -> Done:
        return Done(task.number, None, {}, f"worker {self._worker}: {why}")


def run_task(task: Task) -> Done:
    """Run a trial on the stack of the worker that this is called on."""
    plugin = get_worker().plugins.get(task.campaign)
    if not isinstance(plugin, Keeper):
        return Done(task.number, None, {}, "a worker was not told of the campaign")
    return plugin.run(task)


def _record(scenario: Scenario, log: Path, died: str, timing: Timing) -> Record:
    if died:
        return Record(
            code=code_version(), result=without_result(scenario, f"stack: {died}"), timing=timing
        )
    try:
        trial = read_trial(log)
    except FrasError as error:
        result = without_result(scenario, f"stack: its log can't be read: {error.kind}")
        return Record(code=code_version(), result=result, timing=timing)
    result, series = measure(trial), series_of(trial)
    if (result.outcome, result.reason) == ("aborted", HAS_PLAN):
        result, series = until_plan(scenario, complete=result.complete), ()
    timing = planning_in(trial, timing)
    return Record(code=code_version(), result=result, timing=timing, series=series)


def _packed(folder: Path, logs: Path | None) -> dict[str, bytes]:
    """Read the files of a trial, with those of a stack that died of it."""
    found = {one.name: one for one in sorted(folder.glob("*")) if one.is_file()}
    if logs is not None:
        found |= {f"stack-{one.name}": one for one in sorted(logs.glob("*")) if one.is_file()}
    return {name: one.read_bytes() for name, one in found.items()}


def _cpu_s() -> float:
    """Processor time so far of this process and all that descend from it and live [s]."""
    me = psutil.Process()
    total_s = 0.0
    for one in (me, *me.children(recursive=True)):
        try:
            times = one.cpu_times()
        except psutil.NoSuchProcess:
            continue  # it has ended meanwhile
        total_s += times.user + times.system
    return total_s
