"""What pages show as Python, scenarios, campaigns and contexts is that: it runs, or is read."""

import tomllib
from pathlib import Path

import pytest
import tomlkit

from fras_common.scenario import check
from fras_common.scenario.loader import convert
from fras_experiments.campaign.reading import read_campaign
from fras_planner.offline import read_contexts
from fras_supervisor import find_table
from fras_supervisor.table import parse_table
from support.pages import PAGES, ROOT, Block, blocks

PYTHON = [block for page in PAGES for block in blocks(page, "python") if "python" in page.parts]
TOML = [block for page in PAGES for block in blocks(page, "toml")]
JSON = [block for page in PAGES for block in blocks(page, "json")]


@pytest.mark.parametrize("block", PYTHON, ids=str)
def test_python_runs_as_it_stands(
    block: Block, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.chdir(ROOT)
    exec(compile(block.text, str(block), "exec"), {})
    assert capsys.readouterr().out.strip()


@pytest.mark.parametrize("block", TOML, ids=str)
def test_a_file_that_is_shown_would_be_taken(block: Block, tmp_path: Path):
    raw = tomllib.loads(block.text)
    if "campaign" in raw:
        file = tmp_path / "campaign.toml"
        file.write_text(block.text)
        read_campaign(file)
    elif "process" in raw:
        table = tomllib.loads(find_table("crtk").read_text(encoding="utf-8"))
        parse_table(tomlkit.dumps({**table, "process": table["process"] | raw["process"]}), "shown")
    else:
        check(convert(raw, str(block)), str(block))


@pytest.mark.parametrize("block", JSON, ids=str)
def test_a_context_that_is_shown_would_be_taken(block: Block):
    read_contexts(block.text, str(block))
