"""A trial on a stack that is kept: begun, followed to its end, ended early where it must be."""

from collections.abc import Callable
from pathlib import Path

from fras_cli.options import TrialInput
from fras_cli.trial import TrialFollower, TrialView
from fras_common.scenario import to_toml

LOG = "audit.mcap"


def lay_out(folder: Path, given: TrialInput) -> Path:
    """Make a trial's folder, with its scenario; return where its log will be.

    Raises
    ------
    OSError
        The folder is there already, or can't be made.
    """
    folder.mkdir(parents=True)
    (folder / "scenario.toml").write_text(to_toml(given.scenario), encoding="utf-8")
    return folder / LOG


def follow_to_end(
    follower: TrialFollower,
    trial: str,
    given: TrialInput,
    folder: Path,
    until: Callable[[TrialView], str],
    give_up: Callable[[], bool] = lambda: False,
) -> bool:
    """Run a trial until its log is closed.

    Parameters
    ----------
    trial : str
        Its name.
    folder : Path
        Of its log.
    until : callable
        Says why the trial is to be aborted, or nothing while it is to go on.
    give_up : callable
        True leaves it where it is, also while it is being aborted.

    Returns
    -------
    bool
        Whether it has ended; false if it was given up.

    Raises
    ------
    StackDied
        A process was given up, or has ended.
    TrialRefused, NoAnswer
    """
    follower.start(trial, given.scenario, folder, given.mesh)
    why = ""

    def look(view: TrialView) -> None:
        nonlocal why
        why = why or until(view)

    if follower.follow(look, stop=lambda: bool(why) or give_up()):
        return True
    if give_up():
        return False
    follower.abort(why)
    return follower.follow(look, stop=give_up)
