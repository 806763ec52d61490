"""`python -m drake_starnav`, as `starnav`: list what there is, or run a command."""

import sys

from drake_starnav.cli.main import main

sys.exit(main())
