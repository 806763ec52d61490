"""Drive one scenario: python scripts/simulate.py forest --html out/forest.html"""

import sys

from drake_starnav.cli.main import script

if __name__ == "__main__":
    sys.exit(script("simulate"))
