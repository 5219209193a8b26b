"""docs/reference/safety.md says what the table of safeguards says, and what it names exists."""

import ast
import re
from functools import cache

import msgspec
import pytest

from fras_common.scenario import Scenario
from fras_motion.safety import CHECKS, GATES, SAFEGUARDS
from support.safety_page import ROOT, Row, rows

ROWS = rows()


@cache
def functions_of(path: str) -> set[str]:
    tree = ast.parse((ROOT / path).read_text(encoding="utf-8"))
    return {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


def test_page_has_every_safeguard_in_the_tables_order_and_words():
    assert [(row.name, row.guards) for row in ROWS] == [
        (one.name, one.guards) for one in SAFEGUARDS.values()
    ]


def test_gates_and_checks_are_those_of_the_table():
    assert list(GATES) == [n for n, one in SAFEGUARDS.items() if one.acts_on == "setpoint"]
    assert all(SAFEGUARDS[name].acts_on == "goal" for name in CHECKS)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.name)
def test_row_names_proofs_that_exist(row: Row):
    assert row.proofs
    for proof in row.proofs:
        path, _, name = proof.partition("::")
        assert name in functions_of(path), proof


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.name)
def test_row_names_fields_that_the_scenario_has(row: Row):
    sections = {field.name: field.type for field in msgspec.structs.fields(Scenario)}
    for section, field in re.findall(r"`([a-z]+)\.([a-z]\w*)`", row.number):
        assert field in sections[section].__struct_fields__, f"{section}.{field}"


def test_every_refusal_in_the_code_is_a_safeguard():
    reasons: set[object] = set()
    for path in (ROOT / "services/motion/fras_motion").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            match node:
                case ast.Call(
                    func=ast.Name(id="Refused" | "GateRefused"), args=[ast.Constant(name), *_]
                ):
                    reasons.add(name)
                case _:
                    pass
    assert reasons > {"busy", "workspace", "unreachable", "jaw_open", "instrument_distance"}
    assert reasons <= set(SAFEGUARDS)
