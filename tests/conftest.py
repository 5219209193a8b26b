"""One BLAS thread everywhere, before numpy is imported: two threads give other bits than one."""

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest
from hypothesis import settings

from fras_common.threads import one_thread

one_thread()
# How long an example takes is no test's business: these machines are shared.
settings.register_profile("shared machine", deadline=None)
settings.load_profile("shared machine")


HERE = Path(__file__).parent
# Where several processes meet the clock of a machine that others use, too.
REAL_PROCESSES = frozenset({"system", "contract", "browser"})


def pytest_collection_modifyitems(items: Sequence[pytest.Item]) -> None:
    """Have what fails among real processes tried once more, and told (decision 33)."""
    for item in items:
        if item.path.relative_to(HERE).parts[0] in REAL_PROCESSES:
            item.add_marker(pytest.mark.flaky(reruns=1))


@pytest.fixture(autouse=True)
def as_urgent_as_before() -> Iterator[None]:
    """No test leaves its worker, and so all processes of later tests, behind those of the other."""
    before = os.getpriority(os.PRIO_PROCESS, 0)
    yield
    assert os.getpriority(os.PRIO_PROCESS, 0) == before


@pytest.fixture(scope="session", autouse=True)
def own_data_home(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Logs of tests are signed with a key of their own, also those of processes they start."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_DATA_HOME", str(tmp_path_factory.mktemp("data")))
        yield
