"""Report on trials that have run: python scripts/report.py out/trials.jsonl --html out/report.html"""

import sys

from drake_starnav.__main__ import main

if __name__ == "__main__":
    sys.exit(main("report"))
