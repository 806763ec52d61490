"""`python -m drake_starnav`, as `starnav`: list what there is, or run a command."""

import sys

from drake_starnav.utils.interrupts import run_interruptibly


def main(command: str = "") -> int:
    """Run the command line of this process; returns the exit code.

    Args:
        command: its name, for a script of its own; by default the first argument is the command.
    """

    def work() -> int:
        from drake_starnav.cli import main as commands

        return commands.COMMANDS[command]() if command else commands.main()

    return run_interruptibly(f"{command}.py" if command else "starnav", work)


if __name__ == "__main__":
    sys.exit(main())
