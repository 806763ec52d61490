"""Drive one scenario: python scripts/simulate.py forest --html out/forest.html"""

import sys

from drake_starnav.command_line import simulate

if __name__ == "__main__":
    sys.exit(simulate())
