"""A wire between two network namespaces, with delay and loss, for kernels without `netem`, too.

Two TAP devices, one in each namespace, and a thread that carries Ethernet frames between them: both
ends are whole TCP stacks of the kernel, so loss is mended by real retransmissions.
"""

import fcntl
import os
import random
import select
import shutil
import struct
import subprocess
import threading
import time
from collections import deque
from contextlib import ExitStack
from pathlib import Path
from typing import Final, Self

TUN: Final = Path("/dev/net/tun")
TUNSETIFF: Final = 0x400454CA
IFF_TAP_WITHOUT_HEADER: Final = 0x0002 | 0x1000
FRAME: Final = 65_536
IDLE_S: Final = 0.2
ADDRESSES: Final = {"A": "10.0.0.1", "B": "10.0.0.2"}


class NotPermitted(Exception):
    """This machine does not let us make namespaces and devices."""


def require_permission() -> None:
    """Say what is missing before anything is made.

    Raises
    ------
    NotPermitted
    """
    if os.geteuid() != 0:
        raise NotPermitted("network namespaces need root, and this is user " + str(os.geteuid()))
    if shutil.which("ip") is None:
        raise NotPermitted("the program `ip` (iproute2) is not installed")
    if not TUN.exists():
        raise NotPermitted(f"{TUN} is not there: the kernel has no TUN/TAP devices")


class Wire:
    """Hosts A (10.0.0.1) and B (10.0.0.2), each a namespace, and what carries between them.

    Attributes
    ----------
    delay_s : float [s]
        What each frame is held back, in each direction.
    loss : float
        Share of frames that are dropped.
    carries : bool
        False: a partition; every frame is dropped.

    Raises
    ------
    NotPermitted
    """

    def __init__(self) -> None:
        require_permission()
        self.delay_s = 0.0
        self.loss = 0.0
        self.carries = True
        self._chance = random.Random(0)
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._carry, name="wire", daemon=True)
        self._devices: list[int] = []
        self._undo = ExitStack()

    def namespace(self, host: str) -> str:
        """Name of a host's namespace."""
        return f"fras-{host}-{os.getpid()}"

    def command(self, host: str, *words: str) -> list[str]:
        """Make a command that runs on a host."""
        return ["ip", "netns", "exec", self.namespace(host), *words]

    def options(self, host: str) -> list[str]:
        """Tell `fras up` on a host where they are."""
        del host
        return ["--address", f"A={ADDRESSES['A']}"]

    def __enter__(self) -> Self:
        try:
            for host, address in ADDRESSES.items():
                self._make(host, address)
        except BaseException:
            self._undo.close()
            raise
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ends.set()
        self._thread.join()
        self._undo.close()

    def _make(self, host: str, address: str) -> None:
        namespace, device = self.namespace(host), f"fras{host}{os.getpid() % 100_000}"
        _ip("netns", "add", namespace)
        self._undo.callback(_ip, "netns", "del", namespace)
        try:
            descriptor = os.open(TUN, os.O_RDWR | os.O_NONBLOCK)
            self._undo.callback(os.close, descriptor)
            request = struct.pack("16sH22x", device.encode(), IFF_TAP_WITHOUT_HEADER)
            fcntl.ioctl(descriptor, TUNSETIFF, request)
        except OSError as error:
            raise NotPermitted(f"no TAP device can be made: {error}") from error
        self._devices.append(descriptor)
        _ip("link", "set", device, "netns", namespace)
        _ip("-n", namespace, "link", "set", "lo", "up")
        _ip("-n", namespace, "addr", "add", f"{address}/24", "dev", device)
        _ip("-n", namespace, "link", "set", device, "up")

    def _carry(self) -> None:
        held: deque[tuple[float, int, bytes]] = deque()
        across = dict(zip(self._devices, reversed(self._devices), strict=True))
        while not self._ends.is_set():
            wait_s = max(0.0, held[0][0] - time.monotonic()) if held else IDLE_S
            readable, _, _ = select.select(self._devices, [], [], wait_s)
            now_s = time.monotonic()
            for device in readable:
                frame = os.read(device, FRAME)
                if self.carries and self._chance.random() >= self.loss:
                    held.append((now_s + self.delay_s, across[device], frame))
            while held and held[0][0] <= time.monotonic():
                _, device, frame = held.popleft()
                if self.carries:
                    os.write(device, frame)


def _ip(*words: str) -> None:
    done = subprocess.run(["ip", *words], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise NotPermitted(f"`ip {' '.join(words)}`: {done.stderr.strip()}")
