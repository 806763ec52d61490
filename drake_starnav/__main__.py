"""`python -m drake_starnav`, as `starnav`: list what there is, or run a command."""

import sys

from drake_starnav.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
