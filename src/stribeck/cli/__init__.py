"""The command line: commands, and what they print."""

import sys

from stribeck.base.outputs import Interrupted, anything_written, catch_signals


def main() -> None:
    """Run the command line; a request to stop ends it in one line, also while it is still being imported."""
    catch_signals()
    try:
        from stribeck.cli.app import run

        run()
    except Interrupted:
        written = "everything" if anything_written() else "nothing"
        print(f"stribeck: interrupted; {written} was written", file=sys.stderr)
        sys.exit(130)
