"""Where there is no browser the tests here say so, and what to do."""

from pathlib import Path

import pytest
from benchmarks.browser import VARIABLE, NoBrowser, find_chromium


def test_a_browser_that_is_not_there_is_named_with_the_way_to_get_one(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv(VARIABLE, raising=False)
    with pytest.raises(NoBrowser, match="make browser"):
        find_chromium()
