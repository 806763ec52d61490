"""Draw the world of a scenario with start, goal and shortest path: python scripts/show_world.py SCENARIO [--help]"""

import sys

from drake_starnav.cli.main import script

if __name__ == "__main__":
    sys.exit(script("show_world"))
