"""`python -m workbench` and the `workbench` command."""

import sys


def main() -> None:
    """Entry point; to read the commands takes a moment, in which Ctrl-C is answered as well."""
    try:
        from workbench.cli import main as command

        command()
    except KeyboardInterrupt:
        from workbench.base.errors import INTERRUPTED, STOPPED

        print(f"workbench: {STOPPED}", file=sys.stderr)
        sys.exit(INTERRUPTED)


if __name__ == "__main__":
    main()
