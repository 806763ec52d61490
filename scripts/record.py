"""Record a run: python scripts/record.py forest --png 5 15 --gif"""

import sys

from drake_starnav.cli.main import script

if __name__ == "__main__":
    sys.exit(script("record"))
