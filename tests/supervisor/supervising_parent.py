"""A supervisor as a process of its own: `supervising_parent.py TABLE ENDPOINT FOLDER`."""

import json
import signal
import sys
import threading
from pathlib import Path

from fras_supervisor import Stack, load_table


def main() -> None:
    table, endpoint, folder = load_table(sys.argv[1]), sys.argv[2], Path(sys.argv[3])
    stopping = threading.Event()
    signal.signal(signal.SIGINT, lambda *_: stopping.set())

    def alive() -> set[str]:
        seen = (path.name.split(".") for path in folder.glob("ready.*"))
        return {f"{token}/{name}" for token, name in seen}

    with Stack(table, "test", endpoint, folder / "logs", alive, cancelled=stopping.is_set) as stack:
        pids = {one.name: one.pid for one in stack.status()}
        print(json.dumps(pids), flush=True)
        while not stopping.is_set() and not stack.watch(0.05):
            pass
        exits = stack.stop()
    print(json.dumps([(one.name, one.by) for one in exits.values()]), flush=True)


main()
