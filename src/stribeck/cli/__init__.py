"""Command line: commands and their console output."""

import sys

from stribeck.base.outputs import Interrupted, anything_written, catch_signals


def main() -> None:
    """Run the command line; an interruption, also during imports, ends it with one line on stderr."""
    catch_signals()
    try:
        from stribeck.cli.app import run

        run()
    except Interrupted:
        written = "everything" if anything_written() else "nothing"
        print(f"stribeck: interrupted; {written} was written", file=sys.stderr)
        sys.exit(130)
