"""The command line, also as ``python -m weftform`` where no command is on the path."""

import sys


def main() -> None:
    """Run the command line; an interrupt while it is still being loaded ends as one later does."""
    try:
        from weftform.cli import main as run
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        sys.exit(130)
    run()


if __name__ == "__main__":
    main()
