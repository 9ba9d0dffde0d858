"""``python -m weftform``: the command line, where no command is on the path."""

from weftform.cli import main

if __name__ == "__main__":
    main()
