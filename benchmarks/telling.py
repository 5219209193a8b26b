"""How a benchmark says what it measured."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

Target = tuple[str, str, bool]
"""What was to be reached: in words, as measured, and whether it was."""


def tell_figures(figures: Mapping[str, Any], path: Path | None) -> None:
    """Print figures one a line, and write them to a file if one is given."""
    width = max(map(len, figures))
    for name, value in figures.items():
        print(f"{name:{width}}  {value}")
    if path:
        path.write_text(json.dumps(figures, indent=2) + "\n")


def target_lines(reached: Sequence[Target]) -> str:
    """Return targets for a person, one a line."""
    return "\n".join(
        f"{'met' if enough else 'MISSED':8}{value:>14}  {text}" for text, value, enough in reached
    )


def target_rows(reached: Sequence[Target]) -> list[dict[str, Any]]:
    """Return targets for a file."""
    return [{"what": text, "value": value, "met": enough} for text, value, enough in reached]
