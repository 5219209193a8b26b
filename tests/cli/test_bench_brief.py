"""All benchmarks in one table."""

from pathlib import Path

import pytest
from benchmarks.brief import BEGIN, END, run, table, write
from benchmarks.brief_rows import JOBS, Job, Row, at_least, at_most

from fras_cli.bench import BENCHMARKS

NO_FIGURES = {"all", "fuzz", "stress"}


def job(text: str, *arguments: str) -> Job:
    module = "fake_benchmark"
    Path(f"{module}.py").write_text(text, encoding="utf-8")
    return Job("fake", module, arguments, lambda figures: [Row("n", str(figures["n"]))])


@pytest.fixture(autouse=True)
def in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))


def test_every_benchmark_with_figures_is_among_them_with_its_own_module():
    modules = {name: module for name, (module, _) in BENCHMARKS.items() if name not in NO_FIGURES}
    assert {one.name: one.module for one in JOBS} == modules


def test_what_a_benchmark_wrote_becomes_rows(tmp_path: Path):
    good = job(
        "import pathlib, sys; pathlib.Path(sys.argv[1]).write_text('{\"n\": 3}')",
        "{out}/{name}.json",
    )
    assert run(good, tmp_path) == [Row("n", "3")]


def test_one_that_fails_says_so_and_old_figures_do_not_pass_for_new_ones(tmp_path: Path):
    (tmp_path / "fake.json").write_text('{"n": 3}', encoding="utf-8")
    (row,) = run(job("raise SystemExit('no browser here')"), tmp_path)
    assert row.what == "not done (exit status 1)"
    assert row.figure == "no browser here"


def test_a_figure_is_held_against_what_is_to_be_reached():
    assert at_most("x", 2.0, 2.0, "ms") == Row("x [ms]", "2", "2", met=True)
    assert at_most("x", 2.1, 2.0, "").met is False
    assert at_least("x", 2.0, 2.0) == Row("x", "2", "at least 2", met=True)
    assert at_least("x", 1.9, 2.0).met is False


def test_the_table_names_each_benchmark_once():
    rows = [Row("a|b", "1", "2", met=False), Row("c", "3")]
    lines = table([(JOBS[0], rows)])
    assert lines[2:] == ["| `loop` | a,b | 1 | 2 | **missed** |", "|  | c | 3 |  |  |"]


def test_only_what_stands_between_the_marks_is_written(tmp_path: Path):
    page = tmp_path / "page.md"
    page.write_text(f"before\n{BEGIN}\nold\n{END}\nafter\n", encoding="utf-8")
    for _ in range(2):
        write(page, ["new"])
    assert page.read_text(encoding="utf-8") == f"before\n{BEGIN}\n\nnew\n\n{END}\nafter\n"


def test_a_page_without_a_place_is_left_alone(tmp_path: Path):
    page = tmp_path / "page.md"
    page.write_text("text\n", encoding="utf-8")
    with pytest.raises(SystemExit, match="no place for the figures"):
        write(page, ["new"])
    assert page.read_text(encoding="utf-8") == "text\n"


def test_the_page_of_the_project_has_its_place():
    page = (Path(__file__).parents[2] / "docs" / "benchmarks.md").read_text(encoding="utf-8")
    assert page.index(BEGIN) < page.index(END)
