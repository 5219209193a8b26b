"""docs/hostile-input.md gives the limits that the code has."""

import re
from importlib import import_module
from pathlib import Path

import pytest

from fras_common.topics import BULK, QUERIES, SMALL, TOPICS, Qos

PAGE = Path(__file__).resolve().parents[2] / "docs" / "hostile-input.md"
ROWS = re.findall(r"^\| .* \| (\d+)(?: bytes)? \| `(\w+)\.(\w+)` \|$", PAGE.read_text(), re.M)
MODULES = {
    "rows": "fras_common.rows",
    "base": "fras_common.messages.base",
    "rates": "fras_common.service.rates",
    "host": "fras_common.service.host",
    "holds": "fras_motion.holds",
    "limits": "fras_common.scenario.limits",
    "contents": "fras_recorder.contents",
    "files": "fras_common.files",
    "mesh_input": "fras_cli.mesh_input",
    "chunks": "fras_log.chunks",
    "parts": "fras_log.parts",
    "custody": "fras_log.custody",
    "audit_log": "fras_log.audit_log",
    "streams": "fras_log.streams",
    "memory": "fras_recorder.memory",
    "gaps": "fras_common.service.gaps",
}


def test_the_table_is_read() -> None:
    assert len(ROWS) >= 26


@pytest.mark.parametrize(("limit", "module", "name"), ROWS, ids=lambda one: str(one))
def test_a_limit_is_the_codes(limit: str, module: str, name: str) -> None:
    assert float(limit) == getattr(import_module(MODULES[module]), name)


def test_commands_and_questions_are_small_unless_they_carry_a_mesh() -> None:
    assert all(topic.max_bytes == SMALL for topic in TOPICS if topic.qos is Qos.COMMAND)
    for query in QUERIES:
        carries = "mesh" in query.request.__struct_fields__
        assert query.max_bytes == (BULK if carries else SMALL), query.key
