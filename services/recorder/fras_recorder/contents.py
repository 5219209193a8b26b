"""What a log says about itself: versions, host, scenario."""

from importlib.metadata import version
from platform import node, python_version

from fras_common.messages import OpenRequest
from fras_common.scenario import to_toml


def describe(request: OpenRequest) -> tuple[dict[str, str], dict[str, bytes]]:
    """Metadata record and attachments of a trial's log."""
    scenario_toml = to_toml(request.scenario)
    metadata = {
        "trial": request.trial,
        "fras_version": version("fras"),
        "python_version": python_version(),
        "host": node(),
        "scenario": scenario_toml,
    }
    attachments = {"scenario.toml": scenario_toml.encode()}
    if request.mesh:
        attachments["mesh"] = request.mesh
    return metadata, attachments
