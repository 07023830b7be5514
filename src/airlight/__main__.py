"""The `airlight` command, also as `python -m airlight`."""

import signal
import sys

from airlight.messages import say
from airlight.process.supervisor import STOPPED, prepare_process, supervised


def main() -> int:
    """Run the command of sys.argv under supervision; its exit code, see `airlight.cli.main`."""
    try:
        prepare_process()
        return supervised(_command)
    except KeyboardInterrupt:  # before there is a child
        say(STOPPED)
        return 128 + signal.SIGINT


def _command() -> int:
    from airlight.cli import main as command

    return command()


if __name__ == "__main__":
    sys.exit(main())
