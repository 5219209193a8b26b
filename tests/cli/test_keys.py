"""`fras keys`: what it makes, keeps and refuses."""

import stat
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID
from typer.testing import CliRunner

from fras_cli.commands.keys import keys_app
from fras_cli.keys import (
    BadKeys,
    KeysExist,
    certified,
    check_hosts_named,
    check_keys,
    export_keys,
    init_keys,
    issue_keys,
    look_at_keys,
    make_authority,
    revoke_keys,
    rotate_keys,
)
from fras_cli.keys.authority import hosts_named
from fras_cli.keys.folder import NAMES
from fras_common.access import PARTICIPANTS
from fras_common.identity import BadIdentity, certificate_names
from fras_common.router import main as router

NOW = datetime(2026, 3, 1, 12, tzinfo=UTC)
DAY = timedelta(days=1)


def certificate(path: Path) -> x509.Certificate:
    return x509.load_pem_x509_certificate(path.read_bytes())


def problems(folder: Path, now: datetime) -> dict[str, str]:
    return {one.name: one.problem for one in look_at_keys(folder, now) if one.problem}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    place = tmp_path / "fras" / "keys"
    init_keys(place, NOW)
    return place


# --- certificates -------------------------------------------------------------------------------


def test_a_certificate_bears_the_services_name_and_is_valid_from_now_for_as_long_as_asked():
    authority = make_authority(NOW, 10 * DAY)
    made = x509.load_pem_x509_certificate(certified(authority, "sim", NOW, 3 * DAY).certificate)
    (name,) = made.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    assert name.value == "sim"
    assert made.not_valid_before_utc == NOW - timedelta(minutes=5)  # clocks differ
    assert made.not_valid_after_utc == NOW + 3 * DAY
    made.verify_directly_issued_by(x509.load_pem_x509_certificate(authority.certificate))
    other = make_authority(NOW, 10 * DAY)
    with pytest.raises((ValueError, InvalidSignature)):
        made.verify_directly_issued_by(x509.load_pem_x509_certificate(other.certificate))


def test_no_certificate_outlives_its_authority_and_none_is_made_by_an_expired_one():
    authority = make_authority(NOW, 10 * DAY)
    made = certified(authority, "sim", NOW + 9 * DAY, 5 * DAY).certificate
    assert x509.load_pem_x509_certificate(made).not_valid_after_utc == NOW + 10 * DAY
    with pytest.raises(ValueError, match="has expired"):
        certified(authority, "sim", NOW + 10 * DAY, DAY)


def test_a_service_cannot_play_the_router_and_the_router_no_service(folder: Path):
    for name in NAMES:
        usage = certificate(folder / f"{name}.pem").extensions.get_extension_for_class(
            x509.ExtendedKeyUsage
        )
        router = name == "router"
        assert (ExtendedKeyUsageOID.SERVER_AUTH in usage.value) == router
        assert (ExtendedKeyUsageOID.CLIENT_AUTH in usage.value) == (not router)
        basic = certificate(folder / f"{name}.pem").extensions.get_extension_for_class(
            x509.BasicConstraints
        )
        assert basic.value.ca is False


def test_the_router_names_the_hosts_by_which_it_is_reached(tmp_path: Path):
    init_keys(tmp_path / "keys", NOW, hosts=("localhost", "127.0.0.1", "or-1.example.org"))
    names = certificate(tmp_path / "keys" / "router.pem").extensions.get_extension_for_class(
        x509.SubjectAlternativeName
    )
    assert names.value.get_values_for_type(x509.DNSName) == ["localhost", "or-1.example.org"]
    assert [str(one) for one in names.value.get_values_for_type(x509.IPAddress)] == ["127.0.0.1"]


# --- the folder ---------------------------------------------------------------------------------


def test_each_participant_gets_a_certificate_and_all_files_are_their_owners_alone(folder: Path):
    assert {path.stem for path in folder.glob("*.pem")} == {"ca", "router", *PARTICIPANTS}
    assert {path.stem for path in folder.glob("*.key")} == {"ca", "router", *PARTICIPANTS}
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    assert {stat.S_IMODE(path.stat().st_mode) for path in folder.iterdir()} == {0o600}
    assert problems(folder, NOW) == {}


def test_keys_are_never_written_over(folder: Path):
    before = (folder / "ca.key").read_bytes()
    with pytest.raises(KeysExist, match="fras keys rotate"):
        init_keys(folder, NOW)
    with pytest.raises(KeysExist, match=r"sim\.pem is there already"):
        issue_keys(folder, ["sim"], NOW)
    assert (folder / "ca.key").read_bytes() == before


def test_one_that_is_missing_is_issued_by_the_same_authority(folder: Path):
    (folder / "sim.pem").unlink()
    (folder / "sim.key").unlink()
    issue_keys(folder, ["sim"], NOW, days=7)
    made = certificate(folder / "sim.pem")
    made.verify_directly_issued_by(certificate(folder / "ca.pem"))
    assert made.not_valid_after_utc == NOW + 7 * DAY


def test_a_name_without_rights_gets_no_certificate(folder: Path):
    with pytest.raises(BadKeys, match="'surgeon' has no rights on the bus: one of router, sim"):
        issue_keys(folder, ["surgeon"], NOW)


def test_a_rotation_replaces_all_and_keeps_the_old(folder: Path):
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    kept = rotate_keys(folder, NOW + 300 * DAY)
    assert {path.name: path.read_bytes() for path in kept.iterdir()} == before
    assert {stat.S_IMODE(path.stat().st_mode) for path in kept.iterdir()} == {0o600}
    after = {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}
    assert {name for name in before if before[name] == after[name]} == {
        "ca.pem", "ca.key", "names.json"
    }  # fmt: skip
    assert problems(folder, NOW + 300 * DAY) == {}
    assert certificate(folder / "sim.pem").not_valid_after_utc == NOW + 665 * DAY


def test_a_new_authority_knows_none_of_the_old_certificates(folder: Path):
    kept = rotate_keys(folder, NOW, new_authority=True)
    assert problems(folder, NOW) == {}
    with pytest.raises((ValueError, InvalidSignature)):
        certificate(kept / "sim.pem").verify_directly_issued_by(certificate(folder / "ca.pem"))
    rotate_keys(folder, NOW + DAY, new_authority=True)
    assert len(list((folder / "old").iterdir())) == 2


def test_a_rotation_makes_only_what_is_there(folder: Path):
    (folder / "monitor.pem").unlink()
    (folder / "monitor.key").unlink()
    rotate_keys(folder, NOW)
    assert not (folder / "monitor.pem").exists()


# --- one of them --------------------------------------------------------------------------------


def test_one_is_renewed_alone_and_the_routers_keeps_the_hosts_that_it_names(folder: Path):
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    rotate_keys(folder, NOW, hosts=("10.0.0.1",), names=["router"])
    rotate_keys(folder, NOW + DAY)
    assert hosts_named(certificate(folder / "router.pem")) == [
        "localhost", "127.0.0.1", "::1", "10.0.0.1"
    ]  # fmt: skip
    rotate_keys(folder, NOW + 2 * DAY, names=["sim"])
    assert (folder / "sim.pem").read_bytes() != before["sim.pem"]
    with pytest.raises(BadKeys, match=r"surgeon\.pem: no such certificate"):
        rotate_keys(folder, NOW, names=["sim", "surgeon"])
    with pytest.raises(BadKeys, match="leave out the names"):
        rotate_keys(folder, NOW, names=["sim"], new_authority=True)


def test_a_router_that_links_to_others_is_client_and_server_under_its_own_name(folder: Path):
    issue_keys(folder, ["router-b"], NOW, hosts=("b.example.org",))
    made = certificate(folder / "router-b.pem")
    usage = made.extensions.get_extension_for_class(x509.ExtendedKeyUsage).value
    assert set(usage) == {ExtendedKeyUsageOID.SERVER_AUTH, ExtendedKeyUsageOID.CLIENT_AUTH}
    assert hosts_named(made) == ["b.example.org"]
    assert "router-b" in [one.name for one in look_at_keys(folder, NOW)]
    for name in ("router-", "router-B/../x", "router-b\n", "router-" + 60 * "x"):
        with pytest.raises(BadKeys, match="no rights on the bus"):
            issue_keys(folder, [name], NOW)
    with pytest.raises(
        BadKeys, match=r"router-b\.pem.*not for 10\.0\.0\.1: `fras keys rotate router-b"
    ):
        check_hosts_named(folder, "router-b", ["b.example.org", "10.0.0.1"])


def said(path: Path) -> str:
    (name,) = certificate(path).subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    return str(name.value)


def test_a_revoked_name_is_another_ones_from_then_on(folder: Path):
    stolen = (folder / "sim.pem").read_bytes(), (folder / "sim.key").read_bytes()
    kept = revoke_keys(folder, ["sim"], NOW)
    assert (said(kept / "sim.pem"), said(folder / "sim.pem")) == ("sim", "sim.2")
    assert certificate_names(folder) == {"sim": "sim.2"}
    assert {stat.S_IMODE(path.stat().st_mode) for path in folder.glob("*.*")} == {0o600}
    assert problems(folder, NOW) == {}
    revoke_keys(folder, ["sim", "cli"], NOW + DAY)
    assert certificate_names(folder) == {"sim": "sim.3", "cli": "cli.2"}
    # Renewed, it keeps its name; one who puts the stolen one back is told.
    rotate_keys(folder, NOW + 2 * DAY)
    assert said(folder / "sim.pem") == "sim.3"
    (folder / "sim.pem").write_bytes(stolen[0])
    (folder / "sim.key").write_bytes(stolen[1])
    with pytest.raises(BadKeys, match=r"it says 'sim', and 'sim\.3' counts"):
        check_keys(folder, ["sim"], NOW + DAY)
    rotate_keys(folder, NOW + 3 * DAY, new_authority=True)
    assert (said(folder / "sim.pem"), certificate_names(folder)) == ("sim", {})


@pytest.mark.parametrize("name", ["ca", "router", "router-b", "surgeon"])
def test_what_a_new_name_does_not_help_is_not_revoked(folder: Path, name: str):
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    with pytest.raises(BadKeys, match=r"--new-ca|has no certificate"):
        revoke_keys(folder, ["sim", name], NOW)
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


@pytest.mark.parametrize(
    "text",
    ["", "[]", '{"sim": 2}', '{"sim": "planner"}', '{"sim": "sim"}', '{"sim": "sim.2x"}', 9 * "["],
)
def test_names_that_can_not_be_read_let_nobody_in(folder: Path, text: str):
    (folder / "names.json").write_text(text)
    with pytest.raises(BadIdentity, match=r"names\.json"):
        certificate_names(folder)
    assert router(["--tls", str(folder), "--listen", "tls/127.0.0.1:1"]) == 3


def test_another_host_gets_its_own_keys_and_no_others(folder: Path, tmp_path: Path):
    issue_keys(folder, ["router-b"], NOW)
    revoke_keys(folder, ["sim"], NOW)
    out = tmp_path / "keys-of-b"
    export_keys(folder, ["router-b", "sim"], out, NOW)
    assert {path.name for path in out.iterdir()} == {
        "ca.pem", "names.json", "router-b.pem", "router-b.key", "sim.pem", "sim.key"
    }  # fmt: skip
    assert stat.S_IMODE(out.stat().st_mode) == 0o700
    assert {stat.S_IMODE(path.stat().st_mode) for path in out.iterdir()} == {0o600}
    check_keys(out, ["router-b", "sim"], NOW)
    with pytest.raises(KeysExist, match="is there already"):
        export_keys(folder, ["router-b"], out, NOW)
    (tmp_path / "file").write_text("mine")
    with pytest.raises(KeysExist):
        export_keys(folder, ["router-b"], tmp_path / "file", NOW)


# --- what is wrong with them --------------------------------------------------------------------


def test_what_has_expired_is_told_with_the_command_that_mends_it(folder: Path):
    late = NOW + 366 * DAY
    assert set(problems(folder, late)) == set(NAMES)  # the CA has nine years more
    with pytest.raises(BadKeys, match=r"sim.pem: expired at 2027-03-01 12:00 UTC: `fras keys rot"):
        check_keys(folder, ["sim"], late)
    rotate_keys(folder, late)
    check_keys(folder, [*NAMES], late)


def test_an_expired_authority_is_told_and_makes_none(folder: Path):
    late = NOW + 3650 * DAY
    assert "ca" in problems(folder, late)
    with pytest.raises(BadKeys, match=r"the CA has expired.*--new-ca"):
        rotate_keys(folder, late)
    rotate_keys(folder, late, new_authority=True)
    assert problems(folder, late) == {}


def test_what_is_not_valid_yet_is_told(folder: Path):
    with pytest.raises(BadKeys, match=r"valid from .* only"):
        check_keys(folder, ["sim"], NOW - DAY)


def test_keys_that_others_may_use_are_refused(folder: Path):
    (folder / "sim.key").chmod(0o640)
    with pytest.raises(BadKeys, match="others may use this key"):
        check_keys(folder, ["sim"], NOW)
    (folder / "ca.key").chmod(0o644)
    with pytest.raises(BadIdentity, match="others may use this key"):
        rotate_keys(folder, NOW)


def test_a_folder_that_others_may_look_into_gets_no_keys(tmp_path: Path):
    (tmp_path / "keys").mkdir(mode=0o755)
    with pytest.raises(BadKeys, match="others may look into it: `chmod 700"):
        init_keys(tmp_path / "keys", NOW)
    assert list((tmp_path / "keys").iterdir()) == []


@pytest.mark.parametrize("name", ["sim.pem", "sim.key", "ca.pem"])
def test_what_is_missing_or_broken_is_named(folder: Path, name: str):
    (folder / name).write_bytes(b"-----BEGIN NOTHING-----")
    with pytest.raises(BadKeys):
        check_keys(folder, ["sim"], NOW)
    (folder / name).unlink()
    with pytest.raises(BadKeys, match=r"fras keys init|no certificate to be read"):
        check_keys(folder, ["sim"], NOW)


def test_the_key_of_another_one_and_the_certificate_of_another_authority_are_told(
    folder: Path, tmp_path: Path
):
    (folder / "sim.key").write_bytes((folder / "sa.key").read_bytes())
    init_keys(tmp_path / "others", NOW)
    for suffix in (".pem", ".key"):
        (folder / f"planner{suffix}").write_bytes(
            (tmp_path / "others" / f"planner{suffix}").read_bytes()
        )
    found = problems(folder, NOW)
    assert set(found) == {"sim", "planner"}
    assert "its key is another one's" in found["sim"]
    assert "not of this folder's CA" in found["planner"]


def test_a_machine_needs_nothing_of_the_others(folder: Path):
    for path in folder.iterdir():
        if path.name not in ("ca.pem", "sim.pem", "sim.key"):
            path.unlink()
    check_keys(folder, ["sim"], NOW)


# --- the command --------------------------------------------------------------------------------


def test_the_command_makes_shows_and_renews(tmp_path: Path):
    place = tmp_path / "keys"
    run = CliRunner().invoke
    assert run(keys_app, ["init", "--dir", str(place), "--days", "2"]).exit_code == 0
    shown = run(keys_app, ["show", "--dir", str(place)])
    assert shown.exit_code == 0
    assert all(name in shown.stdout for name in NAMES)
    (place / "sim.key").chmod(0o644)
    assert run(keys_app, ["show", "--dir", str(place)]).exit_code == 1
    renewed = run(keys_app, ["rotate", "--new-ca", "--dir", str(place)])
    assert renewed.exit_code == 0
    assert run(keys_app, ["show", "--dir", str(place)]).exit_code == 0
    assert "old" in renewed.stdout


def test_the_command_tells_of_a_folder_without_keys(tmp_path: Path):
    shown = CliRunner().invoke(keys_app, ["show", "--dir", str(tmp_path)])
    assert (shown.exit_code, "0 certificates" in shown.stdout) == (1, True)
