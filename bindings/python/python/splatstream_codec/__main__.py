"""The `splatstream` command, also as `python -m splatstream_codec`."""

from __future__ import annotations

import signal
import sys

from ._native import main as run


def main() -> int:
    """Runs the command with the arguments of this process."""
    # Of the two handlers of Ctrl-C the one of Python waits for Python, which has nothing to do here.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return run(["splatstream", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
