"""Reads the rule files: from the package, from a checkout, or from where the user says."""

import hashlib
from pathlib import Path

from fras_planner.planning import Knowledge, KnowledgeFault, Planner, PlanningScene

_HERE = Path(__file__).resolve().parent
# Wheels carry the rules inside the package; a checkout has them at its root.
_PLACES = (_HERE / "asp", _HERE.parents[2] / "asp")


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
    places = (asp_dir,) if asp_dir is not None else _PLACES
    folder = next((place for place in places if (place / "domain.lp").is_file()), None)
    if folder is None:
        looked = " or ".join(str(place) for place in places)
        raise KnowledgeFault(looked, 0, "no domain.lp here")
    files: dict[str, str] = {}
    for path in sorted(folder.rglob("*.lp")):
        name = path.relative_to(folder).as_posix()
        try:
            files[name] = path.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise KnowledgeFault(str(path), 0, f"cannot be read: {error}") from error
    digest = hashlib.sha256()
    for name, text in files.items():
        for part in (name.encode(), text.encode()):
            digest.update(len(part).to_bytes(8, "little") + part)
    knowledge = Knowledge(files, digest.hexdigest(), origin=str(folder))
    _try_out(knowledge)
    return knowledge


def _try_out(knowledge: Knowledge) -> None:
    """Plan in a tiny scene with each criterion, so that a fault shows before a trial does."""
    if not knowledge.criteria:
        raise KnowledgeFault(f"{knowledge.origin}/preferences", 0, "no criterion here")
    names, rows = ("b(1,1)", "b(1,2)"), ((0.0, 0.0, 0.0), (0.0, 0.01, 0.0))
    statics = ["reachable(psm1,b(1,1))", "fixed(b(1,2))", "above_roi(b(1,2))"]
    scene = PlanningScene.make(names, rows, (0.0, 0.01, 0.0), statics)
    for criterion in knowledge.criteria:
        Planner(knowledge, scene, criterion).plan([])
