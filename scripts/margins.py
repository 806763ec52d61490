"""Print the error budget of a scenario, term by term: python scripts/margins.py SCENARIO [--help]"""

import sys

from drake_starnav.cli.main import script

if __name__ == "__main__":
    sys.exit(script("margins"))
