"""Drive one scenario: python scripts/simulate.py forest --html out/forest.html"""

import sys

from drake_starnav.__main__ import main

if __name__ == "__main__":
    sys.exit(main("simulate"))
