"""The Compose file of a table: what the specification allows, and what the table says."""

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml
from compose_spec import PyCompose

from fras_supervisor import find_table, load_table
from fras_supervisor.docker import compose_file
from fras_supervisor.probe import main as probe
from fras_supervisor.table import PLACEHOLDERS, Table, parse_table

ROOT = Path(__file__).resolve().parents[2]
# The checker knows none but the bare word; the specification has "on-failure[:max-retries]".
BUDGET = re.compile(r"(restart: on-failure):[1-9]\d*$", re.MULTILINE)
ODD = """
[process.hub]
command = ["{python}", "-m", "fras_common.router", "--listen", "{connect}"]
readiness = "listening"

[process.one]
command = ["one", "{cell}", "{connect}", "{log_dir}", "$HOME", "{{x}}"]
needs = ["hub"]
restart = "always"
memory_limit_mb = 500
open_files_limit = 256
stop_timeout_s = 2.5

[process.two]
command = ["two"]
outlives = ["one"]
readiness = "alive"
"""


def table(name: str) -> Table:
    if name == "odd":
        return parse_table(ODD, "odd.toml")
    return load_table(find_table(name), (*PLACEHOLDERS, "keys"))


def services(name: str, **options: Any) -> dict[str, Any]:
    return yaml.safe_load(compose_file(table(name), **options))["services"]


def check(text: str) -> PyCompose:
    """Refuse what the Compose Specification does not have."""
    made = PyCompose.from_yaml(BUDGET.sub(r"\1", text))
    made.validate()
    return made


@pytest.mark.parametrize("name", ["local", "crtk", "twin", "odd"])
def test_it_is_what_the_specification_allows(name: str) -> None:
    made = check(compose_file(table(name)))
    assert set(made.service_names()) == set(table(name).processes)


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("restart: on-failure:5", "restart: sometimes"),
        ("condition: service_healthy", "condition: service_wealthy"),
        ("    init: true", "    inti: true"),
        ("start_period: 180000ms", "start_period: soon"),
        ("retries: 3", "retries: many"),
        ("127.0.0.1:7447:7447", "127.0.0.1:x:7447"),
    ],
)
def test_the_check_would_tell(right: str, wrong: str) -> None:
    text = compose_file(table("local"))
    assert right in text
    with pytest.raises(ValueError, match="services"):
        check(text.replace(right, wrong))


@pytest.mark.parametrize("name", ["local", "crtk", "odd"])
def test_whom_a_container_depends_on_is_there(name: str) -> None:
    made = services(name)
    for one in made.values():
        assert set(one.get("depends_on", {})) <= set(made)


def test_needs_outlives_and_restarts_are_the_tables() -> None:
    made = services("local")
    healthy, started = {"condition": "service_healthy"}, {"condition": "service_started"}
    assert made["sim"]["depends_on"] == {"recorder": started, "router": healthy}
    assert made["recorder"]["depends_on"] == {"router": healthy}
    assert "depends_on" not in made["router"]
    assert {one["restart"] for one in made.values()} == {"on-failure:5"}
    odd = services("odd")
    assert odd["one"]["depends_on"] == {"two": started, "hub": healthy}
    assert (odd["hub"]["restart"], odd["one"]["restart"]) == ("no", "always")


def test_commands_limits_and_timeouts_are_the_tables() -> None:
    made = services("odd", cell="c", port=7500)
    command = ["one", "c", "tcp/hub:7500", "/fras/runs/logs", "$$HOME", "{x}"]
    assert made["one"]["command"] == command
    assert made["hub"]["command"][-1] == "tcp/0.0.0.0:7500"
    assert made["hub"]["ports"] == ["127.0.0.1:7500:7500"]
    assert "ports" not in made["one"]
    assert made["one"]["mem_limit"] == "500000000b"
    assert made["one"]["ulimits"]["nofile"] == {"soft": 256, "hard": 256}
    assert made["one"]["stop_grace_period"] == "2500ms"
    tests = {name: one["healthcheck"]["test"] for name, one in made.items()}
    assert tests["hub"][-1] == "tcp/hub:7500"
    assert tests["one"][-1] == "ready/one"
    assert tests["two"][-1] == "alive/two"


@pytest.mark.parametrize(("secure", "plain"), [("secure", "local"), ("secure-crtk", "crtk")])
def test_with_certificates_it_is_what_the_specification_allows_too(secure: str, plain: str) -> None:
    made = check(compose_file(table(secure), secure=True))
    assert set(made.service_names()) == {*table(plain).processes, "cli"}


def test_each_container_is_given_its_own_key_alone_to_read() -> None:
    text = compose_file(table("secure"), secure=True)
    made = yaml.safe_load(text)
    given = {
        name: {secret["source"] for secret in one["secrets"]}
        for name, one in made["services"].items()
    }
    for name, files in given.items():
        more = {"names.json"} if name == "router" else set[str]()
        assert files == {"ca.pem", f"{name}.pem", f"{name}.key", *more}
    # A secret is mounted read-only, under the name that a folder of keys has it by.
    for one in made["services"].values():
        assert all(secret["source"] == secret["target"] for secret in one["secrets"])
        assert not [volume for volume in one["volumes"] if "keys" in volume]
    assert set(made["secrets"]) == set().union(*given.values())
    assert "ca.key" not in text
    folder = "${FRAS_KEYS:?the folder of fras keys}"
    assert made["secrets"]["sim.key"] == {"file": f"{folder}/sim.key"}
    sim, router = made["services"]["sim"], made["services"]["router"]
    assert sim["command"][-2:] == ["--tls", "/run/secrets"]
    assert "tls/router:7447" in sim["command"]
    assert "tls/0.0.0.0:7447" in router["command"]
    assert sim["healthcheck"]["test"][-5:] == [
        "ready/sim", "--tls", "/run/secrets", "--name", "sim"
    ]  # fmt: skip
    assert made["services"]["cli"]["profiles"] == ["tools"]


def test_the_image_has_all_that_a_container_runs() -> None:
    dockerfile = (ROOT / "compose" / "Dockerfile").read_text(encoding="utf-8")
    copied = {
        word
        for line in dockerfile.splitlines()
        if line.startswith("COPY")
        for word in line.split()[1:-1]
    }
    assert all((ROOT / word).exists() for word in copied)
    ignored = (ROOT / ".dockerignore").read_text(encoding="utf-8").split()
    assert copied <= {line[1:] for line in ignored if line.startswith("!")}
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    built = project["tool"]["hatch"]["build"]["targets"]["wheel"]
    assert {path.split("/")[0] for path in built["only-include"]} <= copied
    assert project["project"]["readme"] in copied
    for name in ("local", "crtk"):
        assert all(one["image"] == "fras" for one in services(name).values())


def test_the_probe_fails_without_a_router(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fras_supervisor.probe.TIMEOUT_S", 0.2)
    assert probe(["ready/sim", "--connect", "tcp/127.0.0.1:1"]) == 1
    assert "no Zenoh router" in capsys.readouterr().err
