"""One BLAS thread everywhere, before numpy is imported: two threads give other bits than one."""

from collections.abc import Iterator

import pytest
from hypothesis import settings

from fras_common.threads import one_thread

one_thread()
# How long an example takes is no test's business: these machines are shared.
settings.register_profile("shared machine", deadline=None)
settings.load_profile("shared machine")


@pytest.fixture(scope="session", autouse=True)
def own_data_home(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Logs of tests are signed with a key of their own, also those of processes they start."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_DATA_HOME", str(tmp_path_factory.mktemp("data")))
        yield
