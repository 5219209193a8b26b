"""A TCP link that is slow, silent or cut, as its test wants: a relay that works everywhere."""

import asyncio
import threading
from collections.abc import Callable, Coroutine
from contextlib import suppress
from typing import Any, Self, cast

HOST = "127.0.0.1"
CHUNK = 65_536


class SlowLink:
    """Listens on a port of its own and relays to another one.

    Parameters
    ----------
    target : int
        Port to relay to.
    port : int
        Port to listen on.
    delay_s : float [s]
        What each chunk is held back, in each direction; may be set at any time.
    """

    def __init__(self, target: int, port: int, delay_s: float = 0.0) -> None:
        self.delay_s = delay_s
        self.port = port
        self._target = target
        self._loop = asyncio.new_event_loop()
        self._carries = asyncio.Event()
        self._server: asyncio.Server | None = None
        self._pumps: set[asyncio.Task[None]] = set()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)

    def silence(self) -> None:
        """Carry nothing, as a network that is partitioned: what was sent comes after `heal`."""
        self._do(self._silence())

    def cut(self) -> None:
        """End all connections and refuse new ones: what was under way is lost."""
        self._do(self._cut())

    def heal(self) -> None:
        """Carry again."""
        self._do(self._heal())

    def __enter__(self) -> Self:
        self._thread.start()
        self.heal()
        return self

    def __exit__(self, *_: object) -> None:
        self.cut()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    def _do(self, what: Coroutine[Any, Any, None]) -> None:
        asyncio.run_coroutine_threadsafe(what, self._loop).result(10.0)

    async def _silence(self) -> None:
        self._carries.clear()

    async def _heal(self) -> None:
        self._carries.set()
        if self._server is None:
            self._server = await asyncio.start_server(self._relay, HOST, self.port)

    async def _cut(self) -> None:
        if self._server is not None:
            self._server.close()
            self._server = None
        for pump in self._pumps:
            pump.cancel()
        await asyncio.gather(*self._pumps, return_exceptions=True)

    async def _relay(self, near: asyncio.StreamReader, back: asyncio.StreamWriter) -> None:
        task = cast("asyncio.Task[None]", asyncio.current_task())
        self._pumps.add(task)
        try:
            with suppress(OSError, asyncio.CancelledError):
                far, forth = await asyncio.open_connection(HOST, self._target)
                try:
                    async with asyncio.TaskGroup() as both:
                        both.create_task(self._pump(near, forth, task.cancel))
                        both.create_task(self._pump(far, back, task.cancel))
                finally:
                    forth.close()
        finally:
            back.close()
            self._pumps.discard(task)

    async def _pump(
        self, source: asyncio.StreamReader, sink: asyncio.StreamWriter, end: Callable[[], object]
    ) -> None:
        held: asyncio.Queue[tuple[float, bytes]] = asyncio.Queue()

        async def deliver() -> None:
            while True:
                due_s, data = await held.get()
                await asyncio.sleep(due_s - self._loop.time())
                await self._carries.wait()
                if not data:
                    end()  # one side has closed: so does the other
                    return
                try:
                    sink.write(data)
                    await sink.drain()
                except ConnectionError:
                    end()
                    return

        delivery = self._loop.create_task(deliver())
        try:
            data = b"-"
            while data:
                await self._carries.wait()
                try:
                    data = await source.read(CHUNK)
                except ConnectionError:
                    data = b""  # whoever was killed says no more
                held.put_nowait((self._loop.time() + self.delay_s, data))
            await delivery
        finally:
            delivery.cancel()
