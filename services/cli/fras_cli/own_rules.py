"""Rules of one's own, looked at before anything starts: a planner that dies of them says less."""

import importlib
from collections.abc import Mapping
from pathlib import Path

from fras_common.errors import FrasError
from fras_common.extras import require_extra


class UnusableRules(FrasError):
    """Rules that were given and that the planner can't use. Attributes: ``folder``."""


def read_rules(folder: Path) -> Mapping[str, str]:
    """Read and check a folder laid out like `asp/`.

    Returns
    -------
    mapping of str to str
        Text by path below the folder.

    Raises
    ------
    UnusableRules
        With the file, the line and what to do.
    MissingExtra
        The planner's libraries are not installed.
    """
    with require_extra("planner"):
        knowledge = importlib.import_module("fras_planner.knowledge")
    try:
        files: Mapping[str, str] = knowledge.load_knowledge(folder).files
    except FrasError as error:
        raise UnusableRules(str(error), folder=str(folder)) from error
    return files
