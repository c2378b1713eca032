"""`python -m bifa` is the command `bifa`."""

import sys


def main() -> None:
    """Run the command `bifa`; Ctrl-C while it is still being loaded ends it without a traceback."""
    try:
        from bifa.cli import main as command
    except KeyboardInterrupt:
        sys.exit(130)
    command()


if __name__ == "__main__":
    main()
