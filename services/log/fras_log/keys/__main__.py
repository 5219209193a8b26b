"""`python -m fras_log.keys`: make this machine's key if there is none, and print its name."""

import sys

from fras_log.keys import BadKey, default_key_path, load_or_make


def main() -> int:
    """Return 0, or 1 if there is no key to be had."""
    try:
        path = default_key_path()
        signer = load_or_make(path)
    except BadKey as error:
        print(f"fras_log.keys: {error}", file=sys.stderr)
        return 1
    print(f"logs are signed with key {signer.public.fingerprint}, {path}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
