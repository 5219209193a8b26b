"""The page's shell: draws 20 times a second what it hears, passes on what buttons ask."""

import os
import time
from collections.abc import Callable
from typing import Final

import msgspec
import rich

from fras_common.service import ServiceHost
from fras_monitor.access import Policy, query_of, require_closed
from fras_monitor.audience import Audience
from fras_monitor.commands import AnyCommand, Colouring, Look, Stop
from fras_monitor.desk import Desk
from fras_monitor.listening import Listener
from fras_monitor.pace import Due, Frames, give_way
from fras_monitor.page.door import Door
from fras_monitor.page.hub import Hub
from fras_monitor.page.scene import Scene
from fras_monitor.picture import Picture
from fras_monitor.replay_watch import ReplayWatch
from fras_monitor.stop import Stopper
from fras_monitor.view import course_of, holds_of, view_of

VIEW_S: Final = 0.1
COURSE_S: Final = 0.25
BEATS_A_SECOND: Final = 4


class MonitorService:
    """Serves the surgeon's page.

    Parameters
    ----------
    host : ServiceHost
    bind, port : str, int
        Where the page listens.
    policy : Policy
    announce : callable
        Told the page's address once it can be opened.

    Raises
    ------
    OpenToAll, PortInUse
    """

    def __init__(
        self,
        host: ServiceHost,
        bind: str,
        port: int,
        policy: Policy,
        announce: Callable[[str], None],
    ) -> None:
        require_closed(bind, policy)
        self._host = host
        self._frames, self._view, self._course = Frames(), Due(VIEW_S), Due(COURSE_S)
        # No supervisor keeps the page, and so none says which process it is.
        host.facts["pid"] = str(os.getpid())
        self._audience = Audience(host)
        self.stopper = Stopper(host.bus)
        self._hub = Hub(f"{time.time_ns():x}", self._on_command)
        door = Door(bind, port, policy, self._hub.attend)
        self._server = door.open()
        self._scene = Scene(self._server, self._on_block)
        self._listener = Listener(host)
        self._replay = ReplayWatch(host, self._listener)
        self._desk = Desk(
            host.bus,
            self.stopper,
            self._hub.say,
            lambda: self._listener.picture.trial,
            lambda: holds_of(self._listener.picture),
            self._listener.note,
            self._colour,
        )
        self.address = door.address
        announce(self.address)

    def _on_command(self, command: AnyCommand) -> None:
        """Do what a button asks; the stop at once, on the thread that got it."""
        if isinstance(command, Stop):
            self.stopper.press()
        elif isinstance(command, Look):
            self._scene.look(command.page, command.place)
        else:
            self._host.post(lambda: self._desk.do(command))

    def _on_block(self, block: str) -> None:
        self._host.post(lambda: self._desk.why_not(block))

    def _colour(self, by: Colouring) -> None:
        self._scene.colouring = by

    def wake(self) -> float | None:
        """Draw what is due; return the seconds until the next time."""
        now_s, began_s = time.monotonic(), time.thread_time()
        if (wait_s := self._frames.wait_s(now_s)) > 0.0:
            return wait_s
        self._audience.tell(self._hub, self.address, now_s)
        if not self._listener.has_states(now_s):
            return self._frames.glance(now_s)
        picture = self._listener.look()
        self._host.tick = picture.tick
        if picture.holds is not None:
            self.stopper.see_holds(picture.holds.message.holds, picture.holds.at_s)
        if self._view.take(now_s):
            self._show(picture, now_s)
        self._scene.draw(picture)
        self._frames.drawn(now_s, time.thread_time() - began_s, picture.simulated_s)
        sparingly = self._frames.fast and picture.is_remembered
        self._listener.hear(sparingly=sparingly)
        self.stopper.hear(sparingly=sparingly)
        return self._frames.wait_s(time.monotonic())

    def _show(self, picture: Picture, now_s: float) -> None:
        view = msgspec.to_builtins(view_of(picture, self.stopper.record, now_s))
        beat = int(now_s * BEATS_A_SECOND)
        self._hub.publish({**view, "colouring": self._scene.colouring, "beat": beat})
        if self._course.take(now_s):
            self._hub.publish({"course": msgspec.to_builtins(course_of(picture))})
        self._replay.ask(picture, now_s)

    def close(self) -> None:
        """End the page; who has it open sees that."""
        self._server.stop()
        self.stopper.close()


def build(
    host: ServiceHost, *, host_name: str, port: int, token: str, view_token: str, read_only: bool
) -> MonitorService:
    """Make the shell of what the command line says.

    Raises
    ------
    OpenToAll, PortInUse, BadToken
    """
    policy = Policy(token, view_token, read_only)
    # viser prints where it listens, its address without a token, and when it ends.
    rich.reconfigure(quiet=True)

    def announce(address: str) -> None:
        print(f"the surgeon's page: {address}{query_of(policy)}", flush=True)

    service = MonitorService(host, host_name, port, policy, announce)
    # The host's own thread draws; the server's, on which a stop comes, is there already.
    give_way()
    return service
