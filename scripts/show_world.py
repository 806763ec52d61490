"""Draw the world of a scenario with start, goal and shortest path: python scripts/show_world.py SCENARIO [--help]"""

import sys

from drake_starnav.__main__ import main

if __name__ == "__main__":
    sys.exit(main("show_world"))
