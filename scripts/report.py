"""Report on trials that have run: python scripts/report.py out/trials.jsonl --html out/report.html"""

import sys

from drake_starnav.cli.main import script

if __name__ == "__main__":
    sys.exit(script("report"))
