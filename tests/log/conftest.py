"""The trial that the reports are tested with, exported; a log to be damaged."""

from pathlib import Path

import pytest
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from tests.cli.report import conftest as made

from fras_common.messages import Context
from fras_log import Signer, Verification, verify_file
from fras_log.export import Format, export
from support.damage import Verify, Whole, write_log
from support.forger import Piece, take_apart

UNDER_WAY_NS = 777_777
CELLS = [(i, j) for i in range(1, 8) for j in range(1, 8)]
CONTEXT = Context(
    tick=0,
    request_id="c0",
    fluents=["fixed(b(1,1))", "fixed(b(4,4))", "fixed(b(2,7))", "reachable(psm1,b(4,4))"],
    evidence={},
    names=[f"b({i},{j})" for i, j in CELLS],
    blocks_m=[((i - 0.5) / 7 * 0.1, (j - 0.5) / 7 * 0.12, 0.005) for i, j in CELLS],
    roi_m=(0.0, 0.0, 0.0),
    fixed_points_m=[],
    monitored=[],
)


@pytest.fixture(scope="session")
def trial_log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log of a whole trial, and of a message that none can understand."""
    path = tmp_path_factory.mktemp("trial") / "audit.mcap"
    log = made.open_log(path)
    write = log.file.write
    # Nothing arrives when it is sent; an export must not take the one for the other.
    vars(log.file)["write"] = lambda sample, sent_ns: write(sample, sent_ns + UNDER_WAY_NS)
    log.put("sa/context", CONTEXT)
    made.write_trial(log)
    log.raw("sim/tissue_state", b"\xc1 no message")
    log.file.close({"reason": "closed"})
    return path


@pytest.fixture(scope="session")
def foxglove_file(trial_log: Path) -> Path:
    path = trial_log.with_name("trial.foxglove.mcap")
    export(trial_log, {Format.FOXGLOVE: path})
    return path


@pytest.fixture(scope="session")
def rerun_file(trial_log: Path) -> Path:
    path = trial_log.with_name("trial.rrd")
    export(trial_log, {Format.RERUN: path})
    return path


@pytest.fixture(scope="session")
def signer() -> Signer:
    """Key of the machine that recorded."""
    return Signer(Ed25519PrivateKey.generate())


@pytest.fixture(scope="session")
def whole(tmp_path_factory: pytest.TempPathFactory, signer: Signer) -> Whole:
    """A signed log; tests write what they damage elsewhere."""
    path = tmp_path_factory.mktemp("whole") / "audit.mcap"
    write_log(path, signer)
    return Whole(path.read_bytes())


@pytest.fixture
def verify(tmp_path: Path, signer: Signer) -> Verify:
    """Verify bytes as a file of a log whose signer is known."""

    def verify_bytes(data: bytes) -> Verification:
        path = tmp_path / "forged.mcap"
        path.write_bytes(data)
        return verify_file(path, [signer.public])

    return verify_bytes


@pytest.fixture
def pieces(whole: Whole) -> list[Piece]:
    """The log taken apart, for a test to change."""
    return take_apart(whole.data)
