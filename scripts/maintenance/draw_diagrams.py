"""Draw every system, the navigation loop and the station's inside for docs/ports.md.

Run: python scripts/maintenance/draw_diagrams.py

Drake describes its systems as Graphviz graphs, which `dot` draws.
"""

import argparse
import re
import shutil
import subprocess
import sys
from itertools import groupby
from pathlib import Path

from pydrake.systems.framework import DiagramBuilder, System

from drake_starnav.cli.options import exit_code
from drake_starnav.errors import StarnavError
from drake_starnav.navigation import add_navigation
from drake_starnav.scenario.scenario_file import load_scenario
from drake_starnav.station.navigation_station import NavigationStation
from scripts.maintenance.write_tables import DIAGRAMS, all_systems

DOT = "dot"
"""Graphviz' program for directed graphs."""
FONT = ("-Gfontname=Helvetica", "-Nfontname=Helvetica", "-Gfontsize=12", "-Nfontsize=12")
"""A font that every system has, itself or a metric-compatible one."""


def graphs() -> dict[str, str]:
    """Graphviz texts by the name of their picture: one for each system, the loop, and the station's inside."""
    systems: list[System] = all_systems()
    texts = {type(system).__name__: system.GetGraphvizString(max_depth=0) for system in systems}
    station = next(system for system in systems if isinstance(system, NavigationStation))
    texts["station"] = station.GetGraphvizString(max_depth=1)
    builder = DiagramBuilder()
    add_navigation(builder, load_scenario("room"))
    loop = builder.Build()
    loop.set_name("navigation")
    texts["navigation"] = loop.GetGraphvizString(max_depth=1)
    return {name: tidied(text) for name, text in texts.items()}


def tidied(text: str) -> str:
    """The graph with class names without their modules; numbers and order do not depend on memory addresses."""
    text = re.sub(r"drake_starnav(\.\w+)*\.(?=[A-Z])", "", text)
    identifier = r"\b(s|_|clusters?)(\d+)"
    numbers = list(dict.fromkeys(number for _, number in re.findall(identifier, text)))
    text = re.sub(identifier, lambda match: f"{match[1]}{numbers.index(match[2])}", text)
    runs = groupby(text.splitlines(), key=lambda line: " -> " in line)
    return "\n".join(line for are_edges, lines in runs for line in (sorted(lines) if are_edges else lines))


def main() -> int:
    """Write the pictures; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=DIAGRAMS, metavar="FOLDER", help="default: docs/images/diagrams")
    options = parser.parse_args()
    return exit_code("draw_diagrams.py", lambda: draw(options.out))


def draw(folder: Path) -> int:
    """Write the pictures to a folder; returns the exit code."""
    if shutil.which(DOT) is None:
        raise StarnavError(f"there is no program `{DOT}`, which draws; allowed: one on PATH (apt install graphviz)")
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in graphs().items():
        done = subprocess.run([DOT, "-Tsvg", *FONT], input=text, capture_output=True, text=True, check=True)
        (folder / f"{name}.svg").write_text(done.stdout, encoding="utf-8")
    print(f"wrote {len(graphs())} diagrams to {folder}; python scripts/maintenance/write_tables.py shows them")
    return 0


if __name__ == "__main__":
    sys.exit(main())
