"""The page and the pictures: whole, self-contained, honest about what is missing, and safe."""

import re
import struct
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import msgspec
import pytest

from fras_cli.report import read_trial, summarise, write_picture, write_report
from fras_cli.report.page import render_page
from fras_common.messages import NoPlan
from fras_log import LogFile, PublicKey

VOID = {"meta", "br", "hr", "img", "link", "input"}


class Outline(HTMLParser):
    """Collects text, addresses and tags that were left open."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.text: list[str] = []
        self.addresses: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in VOID:
            self.open.append(tag)
        self._note(attrs)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._note(attrs)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text.append(data)

    def _note(self, attrs: list[tuple[str, str | None]]) -> None:
        names = {"src", "href", "xlink:href", "action", "data"}
        self.addresses += [value or "" for name, value in attrs if name in names]


@pytest.fixture(scope="module")
def page(log_path: Path, tmp_path_factory: pytest.TempPathFactory) -> str:
    out = tmp_path_factory.mktemp("out")
    write_report(log_path, out)
    return (out / "report.html").read_text(encoding="utf-8")


def words(page: str) -> str:
    return re.sub(r"\s+", " ", " ".join(Outline(page).text))


def test_page_is_well_formed_and_asks_no_host(page: str) -> None:
    outline = Outline(page)
    assert outline.open == []
    assert outline.addresses
    assert all(address.startswith(("#", "data:")) for address in outline.addresses)
    assert "url(http" not in page
    assert "@import" not in page
    assert "<script" not in page


def test_page_tells_outcome_numbers_plans_and_reasons(page: str) -> None:
    text = words(page)
    for expected in (
        "Success: the region of interest is exposed.",
        "85% of the tissue",
        "0.55 N, the limit is 0.50 N, above it for 3 ticks",
        "Re-plan 1",
        "because the force limit was crossed",
        "b(4,4) is the farthest from every attachment point that psm1 reaches.",
        "interrupted: the force limit was crossed",
        "block tridiagonal",
        "late, tick = 12",
        "theatre-1",
    ):
        assert expected in text


def test_page_tells_the_head_and_the_key(page: str, story: Any, tmp_path: Path) -> None:
    assert re.search(r"Head of the log</th><td>[0-9a-f]{64}</td>", page)
    assert "Signed with key</th><td>none</td>" in page
    key = PublicKey(bytes(32))
    for number, (raw, told) in enumerate(
        {
            key.raw.hex(): f"{key.fingerprint} (see fras log verify)",
            "no number": "unknown",
        }.items()
    ):
        path = tmp_path / f"{number}.mcap"
        metadata = {"trial": story.TRIAL, "scenario": story.to_toml(story.scenario())}
        log = story.LogWriter(LogFile(path, metadata | {"public_key": raw}, {}, 1))
        story.write_beginning(log)
        log.file.flush()
        trial = read_trial(path)
        made = render_page(trial, summarise(trial))
        assert f"Signed with key</th><td>{told}</td>" in made
        assert "none: it was never closed" in made
        log.file.abandon()


def test_page_holds_three_figures_and_no_notice_of_damage(page: str) -> None:
    assert page.count("<svg") == page.count("</svg>") == 3
    assert "The log is not whole" not in page


def test_ids_of_the_figures_do_not_collide(page: str) -> None:
    ids = re.findall(r'\sid="([^"]*)"', page)
    assert {name.partition("-")[0] for name in ids} == {"tissue", "course", "timeline"}
    assert len(ids) == len(set(ids))
    used = re.findall(r'(?:href="|url\()#([^")]*)', page)
    assert set(used) <= set(ids)


def test_report_is_the_same_each_time(log_path: Path, page: str) -> None:
    trial = read_trial(log_path)
    assert render_page(trial, summarise(trial)) == page


def test_a_cut_log_says_so_on_the_page(new_log: Callable[..., Any], story: Any) -> None:
    log = new_log()
    story.write_beginning(log)
    story.write_ticks(log, 0, 3)
    log.file.flush()
    trial = read_trial(log.file.path)
    text = words(render_page(trial, summarise(trial)))
    assert "Unfinished: the log ends before the trial did." in text
    assert "The log is not whole" in text
    log.file.close({})


def test_a_log_of_nothing_still_gives_a_page(new_log: Callable[..., Any], tmp_path: Path) -> None:
    log = new_log()
    log.file.close({})
    write_report(log.file.path, tmp_path / "out")
    text = words((tmp_path / "out" / "report.html").read_text(encoding="utf-8"))
    assert "there is nothing to draw" in text
    write_picture(log.file.path, tmp_path / "picture.png")


def test_no_plan_shows_sentences_and_core(new_log: Callable[..., Any], story: Any) -> None:
    why = "Every block is fixed."
    no_plan = NoPlan(core=["fixed_block"], sentences=[why])
    made = msgspec.structs.replace(story.plan(0, "initial", ()), no_plan=no_plan)
    log = new_log()
    story.write_ticks(log, 0, 0)
    log.put("planner/plan", made)
    ended = msgspec.structs.replace(
        story.EMPTY_STATUS,
        phase="ended",
        plans=1,
        outcome="no_plan",
        reason="Every block is fixed.",
    )
    log.put("planner/task_status", ended)
    log.file.close({})
    trial = read_trial(log.file.path)
    text = words(render_page(trial, summarise(trial)))
    assert "No plan: the planner found no way" in text
    assert "fixed_block" in text
    assert why in text


def test_markup_in_a_message_stays_text(new_log: Callable[..., Any], story: Any) -> None:
    log = new_log()
    evil = "<script>alert(1)</script>"
    log.put("planner/plan", msgspec.structs.replace(story.plan(0, evil, ()), explanation=[evil]))
    log.file.close({})
    trial = read_trial(log.file.path)
    page = render_page(trial, summarise(trial))
    assert evil not in page
    assert evil in words(page)


def test_files_are_replaced_at_once_and_nothing_is_left_over(
    log_path: Path, tmp_path: Path
) -> None:
    (tmp_path / "summary.json").write_text("old")
    summary = write_report(log_path, tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["report.html", "summary.json"]
    assert (
        msgspec.json.decode((tmp_path / "summary.json").read_bytes(), type=type(summary)) == summary
    )


def test_a_report_that_fails_writes_nothing(tmp_path: Path) -> None:
    (tmp_path / "text.mcap").write_bytes(b"text")
    with pytest.raises(Exception, match="is no MCAP file"):
        write_report(tmp_path / "text.mcap", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_picture_is_a_wide_png(log_path: Path, tmp_path: Path) -> None:
    write_picture(log_path, tmp_path / "deep" / "picture.png")
    data = (tmp_path / "deep" / "picture.png").read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    width, height = struct.unpack(">II", data[16:24])
    assert width == 1610
    assert 600 <= height <= 750
