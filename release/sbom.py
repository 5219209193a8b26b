"""A bill of materials of the pins: `python -m release.sbom [FILE]`, CycloneDX as JSON.

It is `make sbom`. The same pins give the same file, but for its time, which is SOURCE_DATE_EPOCH
where that is set.
"""

# The library's decorators hide its types.
# pyright: reportCallIssue=false, reportAttributeAccessIssue=false, reportUnknownMemberType=false
# pyright: reportUnknownArgumentType=false, reportUnknownVariableType=false
# pyright: reportArgumentType=false

import argparse
import os
import sys
import uuid
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Final

from cyclonedx.model import Property
from cyclonedx.model.bom import Bom, BomMetaData
from cyclonedx.model.component import Component, ComponentScope, ComponentType
from cyclonedx.model.license import LicenseExpression
from cyclonedx.output import make_outputter
from cyclonedx.schema import OutputFormat, SchemaVersion
from packageurl import PackageURL
from packaging.utils import canonicalize_name

from release.licences import licence_of
from release.pins import FRAS, ROOT, Pin, all_pins, installed, requirements_of

OUT: Final = ROOT / "dist" / "sbom.cdx.json"
SCHEMA: Final = SchemaVersion.V1_6


def bill_of_materials(pins: list[Pin]) -> Bom:
    """Name each pin with its licence, what it needs, and which extras of FRAS need it.

    Raises
    ------
    PinMissing
    """
    fras = Component(
        name=FRAS,
        version=version(FRAS),
        type=ComponentType.APPLICATION,
        bom_ref=FRAS,
        licenses=[LicenseExpression("Apache-2.0")],
    )
    components = {canonicalize_name(pin.name): _component(pin) for pin in pins}
    bom = Bom(components=components.values(), metadata=BomMetaData(component=fras))
    bom.register_dependency(
        fras, [components[canonicalize_name(pin.name)] for pin in pins if pin.is_runtime]
    )
    for pin in pins:
        needs = {canonicalize_name(one.name) for one in requirements_of(pin.name)}
        bom.register_dependency(
            components[canonicalize_name(pin.name)],
            [components[name] for name in sorted(needs & components.keys())],
        )
    if epoch_s := os.environ.get("SOURCE_DATE_EPOCH"):
        bom.metadata.timestamp = datetime.fromtimestamp(int(epoch_s), tz=UTC)
    # Of what is in it: that two files bear other numbers says that the pins differ.
    words = " ".join(f"{pin.name}=={pin.version}" for pin in pins)
    bom.serial_number = uuid.uuid5(uuid.NAMESPACE_OID, f"{FRAS} {version(FRAS)}: {words}")
    return bom


def _component(pin: Pin) -> Component:
    scope = ComponentScope.REQUIRED if "" in pin.extras else ComponentScope.OPTIONAL
    licence, _ = licence_of(installed(pin))
    return Component(
        name=pin.name,
        version=pin.version,
        type=ComponentType.LIBRARY,
        bom_ref=f"{canonicalize_name(pin.name)}@{pin.version}",
        # Excluded: of tests, checks and measurements alone.
        scope=scope if pin.is_runtime else ComponentScope.EXCLUDED,
        licenses=[LicenseExpression(licence)] if licence else [],
        purl=PackageURL("pypi", name=canonicalize_name(pin.name), version=pin.version),
        properties=[Property(name="fras:extra", value=extra) for extra in pin.extras if extra],
    )


def as_json(bom: Bom) -> str:
    """Return the file's text."""
    return make_outputter(bom, OutputFormat.JSON, SCHEMA).output_as_string(indent=2) + "\n"


def main(argv: list[str] | None = None) -> int:
    """Write the file."""
    parser = argparse.ArgumentParser(prog="release.sbom", description=__doc__)
    parser.add_argument("file", type=Path, nargs="?", default=OUT)
    out: Path = parser.parse_args(argv).file
    out.parent.mkdir(parents=True, exist_ok=True)
    pins = all_pins()
    out.write_text(as_json(bill_of_materials(pins)), encoding="utf-8")
    print(f"{out}: {len(pins)} distributions")
    return 0


if __name__ == "__main__":
    sys.exit(main())
