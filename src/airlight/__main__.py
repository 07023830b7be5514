"""The `airlight` command, also as `python -m airlight`."""

import sys

from airlight.process.supervisor import prepare_process, supervised


def main() -> int:
    """Run the command of sys.argv under supervision; its exit code, see `airlight.cli.main`."""
    prepare_process()
    return supervised(_command)


def _command() -> int:
    from airlight.cli import main as command

    return command()


if __name__ == "__main__":
    sys.exit(main())
