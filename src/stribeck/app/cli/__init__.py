"""Command line: commands and their console output."""

import sys

from stribeck.core.base.outputs import Interrupted, anything_written, catch_signals


def main() -> None:
    """Run the command line; an interruption, also during imports, ends it with one line on stderr."""
    catch_signals()
    try:
        from stribeck.app.cli.app import run

        run()
    except Interrupted as error:
        text = str(error) or f"{'everything' if anything_written() else 'nothing'} was written"
        print(f"stribeck: interrupted; {text}", file=sys.stderr)
        sys.exit(130)
