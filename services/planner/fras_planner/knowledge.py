"""Reads the rule files: from the package, from a checkout, or from where the user says."""

import re
from collections.abc import Mapping
from pathlib import Path

from fras_common.digests import rules_digest
from fras_common.errors import FrasError
from fras_common.shipped import shipped_places
from fras_planner.planning import Knowledge, KnowledgeFault, Planner, PlanningScene
from fras_planner.planning.naming import refuse_undeclared

# In comments, too: what is a comment is clingo's to say, and rules may come from anywhere.
WHOLE_COPY = "rules are a whole copy of asp/, with what you changed in it"
_OUTSIDE = re.compile(r"#\s*(include|script|begin_lua|begin_python)\b")


class AttachedRulesUnusable(FrasError):
    """Rules that came with a log and that can't be used."""

    def __init__(self, log: str, fault: KnowledgeFault) -> None:
        place = f"{fault.file}:{fault.line}" if fault.line else fault.file
        super().__init__(
            f"{log}: the rules attached to it can't be used: {place}: {fault.message}; give others "
            "with --asp-dir",
            log=log,
        )


def load_knowledge(asp_dir: Path | None = None) -> Knowledge:
    """Read and check the knowledge.

    Parameters
    ----------
    asp_dir : Path, optional
        A folder laid out like `asp/`; without it the knowledge that came with FRAS.

    Raises
    ------
    KnowledgeFault
        If there is no such folder, or clingo finds fault with a file.
    """
    places = (asp_dir,) if asp_dir is not None else shipped_places("asp")
    folder = next((place for place in places if (place / "domain.lp").is_file()), None)
    if folder is None:
        looked = " or ".join(str(place) for place in places)
        problem = (
            "no domain.lp here" if any(map(Path.is_dir, places)) else "there is no such folder"
        )
        raise KnowledgeFault(looked, 0, problem, WHOLE_COPY)
    files: dict[str, str] = {}
    for path in sorted(folder.rglob("*.lp")):
        name = path.relative_to(folder).as_posix()
        try:
            files[name] = path.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise KnowledgeFault(str(path), 0, f"can't be read: {error}") from error
    knowledge, rules = _checked(files, str(folder))
    refuse_undeclared(knowledge, rules)
    return knowledge


def attached_knowledge(files: Mapping[str, str], log: str) -> Knowledge:
    """Check rules that were attached to a log, and make knowledge of them.

    Parameters
    ----------
    files : mapping of str to str
        Text by path below `asp/`.
    log : str
        Where they come from, for messages.

    Raises
    ------
    AttachedRulesUnusable
    """
    try:
        return _checked(files, "asp")[0]
    except KnowledgeFault as error:
        raise AttachedRulesUnusable(log, error) from error


def _checked(files: Mapping[str, str], origin: str) -> tuple[Knowledge, frozenset[str]]:
    for name, text in files.items():
        _refuse_outside(f"{origin}/{name}", text)
    knowledge = Knowledge(files, rules_digest(files), origin=origin)
    return knowledge, _try_out(knowledge)


def _refuse_outside(file: str, text: str) -> None:
    """Refuse what reaches beyond the files: no digest covers it, and no log holds it."""
    if found := _OUTSIDE.search(text):
        line = text.count("\n", 0, found.start()) + 1
        problem = f"#{found[1]} is not allowed: all rules stand in the folder"
        raise KnowledgeFault(file, line, problem)


def _try_out(knowledge: Knowledge) -> frozenset[str]:
    """Plan in a tiny scene with each criterion, so that a fault shows before a trial does.

    Returns
    -------
    frozenset of str
        Names of the rules that were enforced.
    """
    if not knowledge.criteria:
        raise KnowledgeFault(f"{knowledge.origin}/preferences", 0, "no criterion here")
    names, rows = ("b(1,1)", "b(1,2)"), ((0.0, 0.0, 0.0), (0.0, 0.01, 0.0))
    statics = ["reachable(psm1,b(1,1))", "fixed(b(1,2))", "above_roi(b(1,2))"]
    scene = PlanningScene.make(names, rows, (0.0, 0.01, 0.0), statics)
    rules: frozenset[str] = frozenset()
    for criterion in knowledge.criteria:
        try:
            planner = Planner(knowledge, scene, criterion)
            planner.plan([])
            rules |= planner.rules
        except (RuntimeError, ValueError, LookupError) as error:
            # clingo's, where a name stands in place of a number, or the other way round.
            problem = f"a plan by {criterion} can't be told: an atom is not of its form ({error})"
            raise KnowledgeFault(knowledge.origin, 0, problem) from error
    return rules
