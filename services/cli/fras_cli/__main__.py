"""`python -m fras_cli`, and the `fras` command."""

import sys

from fras_common.extras import MissingExtra, require_extra
from fras_common.signals import silent_interrupt


def main() -> None:
    """Run the command, or say what to install for it."""
    try:
        with silent_interrupt(), require_extra("cli"):
            from fras_cli.app import main as run
    except MissingExtra as error:
        print(f"fras: {error}", file=sys.stderr)
        sys.exit(3)
    run()


if __name__ == "__main__":
    main()
