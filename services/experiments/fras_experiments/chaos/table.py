"""The process table of a stack that is disturbed, made of the one that is not."""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, cast

import tomlkit

from fras_experiments.chaos.clocked import LAUNCH

STABLE_S: Final = 1.0
BUDGET: Final = 1000
"""Each trial finds a stack on which nothing counts against anybody yet, as a fresh one."""


def disturbed(table: str, links: Mapping[str, str], clocks: Mapping[str, Path]) -> str:
    """Return the table in which services have links and clocks of their own.

    Parameters
    ----------
    table : str
        As in `compose/local.toml`.
    links : mapping of str to str
        By process, the endpoint at which it finds the router.
    clocks : mapping of str to Path
        By process, the file that sets its clock.
    """
    plain = tomllib.loads(table)
    processes = cast("dict[str, dict[str, Any]]", plain["process"])
    for name, process in processes.items():
        process.update(stable_s=STABLE_S, restart_budget=BUDGET)
        command: list[str] = process["command"]
        if name in links:
            command = [word.replace("{connect}", links[name]) for word in command]
        if name in clocks:
            at = command.index("-m")
            place = str(clocks[name]).replace("{", "{{").replace("}", "}}")
            command = [*command[:at], "-c", LAUNCH, place, *command[at + 1 :]]
        process["command"] = command
    return tomlkit.dumps(plain)
