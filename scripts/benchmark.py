"""Run many trials: python scripts/benchmark.py forest maze room --method star --trials 200 --json out/star.jsonl"""

import sys

from drake_starnav.cli.main import script

if __name__ == "__main__":
    sys.exit(script("benchmark"))
