"""docs/reference/crtk.md against the code: keys, transitions, refusals, bases."""

from itertools import pairwise
from math import atan2, degrees
from pathlib import Path

from fras_common.messages import Header
from fras_common.topics import CRTK
from fras_motion.crtk import COMMANDS
from fras_motion.crtk.direct import DIRECT_GATES
from fras_motion.kinematics import BASES_IN_WORLD, HOME_TIPS_M

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "reference" / "crtk.md").read_text()
REASONS = {
    "trial_runs",
    "wrong_state",
    "not_homed",
    "held",
    "busy",
    "not_unit",
    "unreachable",
    "profile",
}


def table(first: str) -> list[list[str]]:
    """Rows of the table whose head begins with a word, without backquotes."""
    lines = PAGE.splitlines()
    start = lines.index(next(line for line in lines if line.startswith(f"| {first} |")))
    rows: list[list[str]] = []
    for line in lines[start + 2 :]:
        if not line.startswith("|"):
            break
        rows.append([cell.strip().replace("`", "") for cell in line.strip("|").split("|")])
    return rows


def test_the_table_of_keys_is_the_topic_table() -> None:
    header = set(Header.__struct_fields__)
    for arm in CRTK:
        assert table("key") == [
            [
                topic.key.removeprefix(f"{arm.arm}/"),
                ", ".join(name for name in topic.type.__struct_fields__ if name not in header),
                topic.producer,
                topic.when,
                topic.qos.value,
            ]
            for topic in arm.all
        ]


def test_the_table_of_transitions_is_the_state_machine() -> None:
    said = {command: (start, end) for command, start, end in table("command")}
    assert list(said) == list(COMMANDS)
    for command, legal in COMMANDS.items():
        start, end = said[command]
        assert start.split(", ") == sorted(legal)
        ends = set(legal.values())
        assert end == ("the same" if len(ends) > 1 else ends.pop())


def test_the_table_of_refusals_names_each_reason() -> None:
    named = [reason for reason, _, _ in table("reason")]
    assert sorted(named) == sorted(REASONS | set(DIRECT_GATES))
    source = "".join(
        path.read_text()
        for path in (ROOT / "services" / "motion" / "fras_motion").rglob("*.py")
        if path.name in {"direct.py", "face.py", "state_machine.py", "arm_access.py"}
    )
    for reason in REASONS:
        assert f'"{reason}"' in source, reason


def test_where_the_arms_stand_is_what_the_page_says() -> None:
    for arm, centre, angle, _ in table("arm"):
        base = BASES_IN_WORLD[arm]
        assert tuple(float(x) for x in centre.split(", ")) == base.position_m
        _, _, z, w = base.quaternion_xyzw
        assert float(angle.split()[0]) == round(degrees(2 * atan2(z, w)), 9)
        assert f"({', '.join(f'{x:g}' for x in HOME_TIPS_M[arm])}) for {arm}" in PAGE


def test_links_of_the_page_lead_somewhere() -> None:
    targets = [after.partition(")")[0] for _, after in pairwise(PAGE.split("]("))]
    local = [target for target in targets if not target.startswith("http")]
    assert local
    for target in local:
        assert (ROOT / "docs" / "reference" / target).exists(), target
