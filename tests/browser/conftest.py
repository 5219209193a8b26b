"""A browser, a stack, the surgeon's page of it, and pages opened there, each closed and judged."""

import os
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from benchmarks.browser import Fence, NoBrowser, chromium, find_chromium
from benchmarks.surgeon import Served, SurgeonsPage, served
from benchmarks.theatre import Theatre
from playwright.sync_api import Browser

from fras_cli.layout import Layout
from fras_cli.stack import own_stack
from support.tables import table_with

REQUIRED = "FRAS_BROWSER"
SERVICES = ("recorder", "sim", "sa", "motion", "planner")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if "tests/browser/" in str(item.path):
            item.add_marker(pytest.mark.system)


@pytest.fixture(scope="package")
def fence() -> Iterator[Fence]:
    """Stand where the way to other machines would be."""
    made = Fence()
    yield made
    made.close()


@pytest.fixture(scope="package")
def browser(fence: Fence) -> Iterator[Browser]:
    """Run one browser for all tests here; without one they are skipped, but not in CI."""
    try:
        find_chromium()
    except NoBrowser as error:
        if os.environ.get(REQUIRED) == "required":
            raise
        pytest.skip(str(error))
    with chromium(fence) as made:
        yield made


@pytest.fixture(scope="package")
def theatre(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Theatre]:
    """Start a stack in which a frozen service stays so."""
    folder = tmp_path_factory.mktemp("page")
    table = table_with(folder, **{service: {"watchdog_s": 0.0} for service in SERVICES})
    with own_stack("page-tests", None, folder / "logs", layout=Layout(table)) as stack:
        yield Theatre(stack, folder)


@pytest.fixture
def trial(theatre: Theatre) -> Iterator[Theatre]:
    """Give the stack; a trial that a test leaves is ended."""
    yield theatre
    theatre.end()


@pytest.fixture(scope="package")
def server(theatre: Theatre) -> Iterator[Served]:
    """Serve the page of the stack to whoever is on this machine."""
    with served(theatre.link) as made:
        yield made


@pytest.fixture
def open_page(browser: Browser, fence: Fence) -> Iterator[Callable[..., SurgeonsPage]]:
    """Open pages; none may ask another machine for anything, or fail, unless a test says so."""
    opened: list[SurgeonsPage] = []

    def open_one(address: str, **options: Any) -> SurgeonsPage:
        opened.append(SurgeonsPage(browser, address, **options))
        return opened[-1]

    yield open_one
    for page in opened:
        page.close()
    assert [one for page in opened for one in page.elsewhere()] == []
    assert fence.asked == []
    assert [one for page in opened for one in page.errors] == []
