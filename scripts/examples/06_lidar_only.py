"""The lidar alone, in a manipulation scene: `lidar_only.py`, which needs nothing else of the package.

Run: python scripts/examples/06_lidar_only.py [--png FILE]
"""

import runpy
from pathlib import Path

if __name__ == "__main__":
    runpy.run_path(str(Path(__file__).with_name("lidar_only.py")), run_name="__main__")
