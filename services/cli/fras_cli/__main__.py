"""`python -m fras_cli`, and the `fras` command."""

from fras_cli.app import main

__all__ = ["main"]

if __name__ == "__main__":
    main()
