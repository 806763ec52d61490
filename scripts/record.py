"""Record a run: python scripts/record.py forest --png 5 15 --gif"""

import sys

from drake_starnav.__main__ import main

if __name__ == "__main__":
    sys.exit(main("record"))
