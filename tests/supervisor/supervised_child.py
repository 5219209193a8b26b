"""A process to supervise: does what its arguments say, on the standard library alone."""

import argparse
import json
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

parser = argparse.ArgumentParser()
parser.add_argument("name")
parser.add_argument("folder", type=Path)
parser.add_argument("--tell", nargs="*", default=["ready"])
parser.add_argument("--say", default="")
parser.add_argument("--mutter", default="")
parser.add_argument("--flood-lines", type=int, default=0)
parser.add_argument("--die", type=int)
parser.add_argument("--ignore", nargs="*", default=[])
parser.add_argument("--die-after", type=int, default=0, help="only after so many lives")
parser.add_argument("--fill-mb", type=int, default=0)
parser.add_argument("--linger", action="store_true", help="end only when the file `go` is there")
parser.add_argument("--deaf", action="store_true", help="never look at standard input")
parser.add_argument("--listen", help="an endpoint tcp/HOST:PORT")
parser.add_argument("--grandchild", action="store_true")
parser.add_argument("--environment", action="store_true")
options = parser.parse_args()
folder: Path = options.folder


for kind in ("alive", "ready"):  # left by an earlier life
    (folder / f"{kind}.{options.name}").unlink(missing_ok=True)


def note(kind: str, text: str = "") -> None:
    """Leave a file that is there at once with all its content."""
    draft = folder / f".{kind}.{options.name}"
    draft.write_text(text)
    draft.replace(folder / f"{kind}.{options.name}")


def end(cause: str) -> None:
    if options.linger:
        note("ending")
        while not (folder / "go").exists():
            time.sleep(0.005)
    with (folder / "ended").open("a") as journal:
        journal.write(f"{options.name} {cause}\n")
    sys.exit(0)


for number in (signal.SIGINT, signal.SIGTERM):
    if number.name in options.ignore:
        signal.signal(number, signal.SIG_IGN)
    else:
        signal.signal(number, lambda number, _: end(signal.Signals(number).name))

if options.grandchild:
    arguments = [f"{options.name}-child", str(folder), "--deaf", "--ignore", "SIGINT", "SIGTERM"]
    subprocess.Popen([sys.executable, "-I", "-S", __file__, *arguments])
if options.listen:
    host, _, port = options.listen.removeprefix("tcp/").rpartition(":")
    server = socket.socket()
    server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    server.bind((host, int(port)))
    server.listen()
if options.environment:
    note("environment", json.dumps(dict(os.environ)))
if options.say:
    print(options.say, flush=True)
if options.mutter:
    print(options.mutter, end="", flush=True)
if options.flood_lines:
    for index in range(options.flood_lines):
        print(f"line {index:07d} {'x' * 80}")
    sys.stdout.flush()
with (folder / f"lives.{options.name}").open("a") as lives:
    lives.write("x")
    number = lives.tell()
if options.die is not None and number > options.die_after:
    sys.exit(options.die)
filling = bytearray(b"x" * (options.fill_mb * 1_000_000))
note("pid", str(os.getpid()))
for token in options.tell:
    note(token)
while options.deaf:
    signal.pause()
while os.read(0, 1):
    pass
end("EOF")
