"""Every command in README and docs exists, with the options that it is shown with."""

from pathlib import Path

import pytest

from support.commands import check, check_named, commands
from support.pages import PAGES, ROOT, Block, blocks, spans

SHOWN = [block for page in PAGES for block in blocks(page, "sh")]


@pytest.mark.parametrize("block", SHOWN, ids=str)
def test_every_command_in_a_block_would_be_taken(block: Block):
    found = list(commands(block.text))
    assert found
    for words in found:
        check(words, block.page)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_every_command_in_a_sentence_exists(page: Path):
    for span in spans(page):
        words = span.split()
        if span.startswith("fras ") and not words[1].isupper():
            check_named(words[1:])


@pytest.mark.parametrize(
    "text",
    [
        "fras fly",
        "fras run --fly",
        "fras run a b",
        "fras log show RUN",
        "fras log show RUN sa/verdict --from soon",
        "fras experiment report DIR --fly",
        "fras bench flight",
        "fras bench fe --fly",
        "fras sim --fly",
        "FRAS_KEYS=a fras keys init --fly > b",
        "make flight",
        "python -m flight",
        "python examples/flight.py",
        "fly",
    ],
)
def test_what_does_not_exist_is_found(text: str):
    (words,) = commands(text)
    with pytest.raises(AssertionError):
        check(words, SHOWN[0].page)


@pytest.mark.parametrize(
    "text",
    ["fly", "run --fly", "run|fly", "experiment retraction --fly", "bench flight", "sim --fly"],
)
def test_what_does_not_exist_is_found_in_a_sentence(text: str):
    with pytest.raises(AssertionError):
        check_named(text.split())


def test_the_blocks_are_those_that_a_shell_runs():
    """None is marked as something that this test would not look at."""
    others = [block for page in PAGES for block in blocks(page, "bash", "shell", "console")]
    assert others == []
    assert len(SHOWN) > 40
