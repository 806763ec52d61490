"""Run many trials: python scripts/benchmark.py forest maze room --method star --trials 200 --json out/star.jsonl"""

import sys

from drake_starnav.__main__ import main

if __name__ == "__main__":
    sys.exit(main("benchmark"))
