"""Draw README's picture, which is the run of `make demo`, and write the line below it.

Run: python scripts/maintenance/draw_readme.py
"""

import argparse
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from PIL import Image

from drake_starnav.cli.record import record
from scripts.maintenance.record_results import with_section

ROOT = Path(__file__).parents[2]
README, PICTURE = ROOT / "README.md", ROOT / "docs" / "images" / "forest.gif"
OPTIONS = "--width 880 --speed 2.5 --rate 8"
SECTION = "caption", "python scripts/maintenance/draw_readme.py"


def caption(picture: Path = PICTURE) -> str:
    """What a GIF by `record` says of its run."""
    with Image.open(picture) as clip:
        return str(clip.info["comment"].decode("utf-8"))


def text() -> str:
    """README with the caption of its picture."""
    return with_section(README.read_text(encoding="utf-8"), *SECTION, f"*{caption()}*")


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw and write; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        page = str(Path(folder, "forest.html"))
        failed = record(["forest", "--html", page, "--gif", str(PICTURE), *OPTIONS.split()])
    if not failed:
        README.write_text(text(), encoding="utf-8")
    return failed


if __name__ == "__main__":
    sys.exit(main())
