"""Imports only point down the table of rooms, and numerics know nothing of Drake.

A room is a module or a folder directly in the package. The table says which rooms it may import, and which
third-party packages; what it leaves out is forbidden, and a room that it leaves out is an error.
"""

import ast
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

import drake_starnav

PACKAGE = "drake_starnav"
FOLDER = Path(drake_starnav.__file__).parent
DATA = {"share"}
"""Folders of the package that hold no code."""


@dataclass(frozen=True)
class Room:
    """What the modules of a room may import, beside each other and the standard library."""

    rooms: str = ""
    packages: str = ""


BASE = "errors parameters files console snapshot yaml_text"
SENSING = f"{BASE} planar robot scan sweep lidar intersect raycast slicing gltf stopwatch models polyline scan_log"
PLANNING = f"{SENSING} motion scan_alignment scan_matching stars guidance roadmap control perception"
METHOD = f"{PLANNING} movers baselines worlds metrics"
SETUP = f"{METHOD} drawing faults scenario source_files tolerance"
LOOP = f"{SETUP} systems station promises diagram recording"
TOP = f"{LOOP} world_figure simulation comparison live"
EVERYTHING = f"{TOP} benchmark report"
ARRAYS = "numpy scipy numba"
DRAKE = "numpy numba pydrake"

TABLE = {
    "errors": Room(),
    "snapshot": Room(),
    "parameters": Room("errors", "numpy"),
    "files": Room("errors"),
    "console": Room("errors"),
    "yaml_text": Room("errors", "yaml"),
    "planar": Room("", ARRAYS),
    "robot": Room(BASE, ARRAYS),
    "scan": Room(BASE, ARRAYS),
    "sweep": Room("planar scan", ARRAYS),
    "lidar": Room(BASE, ARRAYS),
    "intersect": Room(BASE, ARRAYS),
    "raycast": Room(f"{BASE} intersect", ARRAYS),
    "slicing": Room(f"{BASE} intersect raycast", ARRAYS),
    "gltf": Room(BASE, ARRAYS),
    "stopwatch": Room(BASE, ARRAYS),
    "motion": Room(BASE, ARRAYS),
    "models": Room("errors"),
    "polyline": Room("", ARRAYS),
    "scan_log": Room(f"{BASE} scan", "numpy rosbags"),
    "scan_alignment": Room("", ARRAYS),
    "scan_matching": Room(f"{BASE} planar scan scan_alignment", ARRAYS),
    "stars": Room(f"{BASE} planar robot scan", ARRAYS),
    "guidance": Room("errors snapshot planar stars", "numpy"),
    "roadmap": Room(f"{BASE} planar robot scan polyline stars guidance", f"{ARRAYS} sklearn"),
    "control": Room(f"{BASE} robot scan stars guidance", ARRAYS),
    "perception": Room(f"{BASE} scan sweep stopwatch stars roadmap control", "numpy"),
    "movers": Room(f"{BASE} robot scan sweep stars guidance control", ARRAYS),
    "baselines": Room(f"{BASE} robot scan stars control", f"{ARRAYS} sklearn"),
    "worlds": Room(f"{BASE} robot scan lidar raycast polyline models", f"{ARRAYS} PIL"),
    "metrics": Room(BASE, "numpy"),
    "drawing": Room(METHOD, ARRAYS),
    "faults": Room(f"{BASE} planar", ARRAYS),
    "scenario": Room(f"{METHOD} drawing faults", "numpy yaml"),
    "source_files": Room(f"{METHOD} drawing faults scenario"),
    "tolerance": Room(f"{METHOD} faults"),
    "systems": Room(SETUP, DRAKE),
    "station": Room(f"{SETUP} systems", DRAKE),
    "promises": Room(f"{SETUP} systems station"),
    "diagram": Room(f"{SETUP} systems station promises", DRAKE),
    "recording": Room(f"{SETUP} systems station diagram", f"{DRAKE} matplotlib PIL playwright imageio_ffmpeg"),
    "world_figure": Room(LOOP, "numpy matplotlib pydrake"),
    "simulation": Room(LOOP, DRAKE),
    "comparison": Room(f"{LOOP} simulation", DRAKE),
    "live": Room(f"{LOOP} simulation", DRAKE),
    "benchmark": Room(TOP, "numpy scipy tqdm dask distributed"),
    "report": Room(f"{TOP} benchmark", "numpy scipy matplotlib"),
    "record_command": Room(EVERYTHING, "tqdm"),
    "benchmark_command": Room(EVERYTHING, "tqdm"),
    "experiment": Room(f"{EVERYTHING} benchmark_command"),
    "command_line": Room(f"{EVERYTHING} benchmark_command record_command", "tqdm"),
    "__init__": Room(f"{EVERYTHING} command_line"),
    "__main__": Room(f"{EVERYTHING} command_line"),
}
"""From the ground up: a room may only import rooms that stand above it here."""

WITHOUT_DRAKE = set(SETUP.split())


def imported_modules(tree: ast.AST, module: str) -> Iterator[tuple[int, str]]:
    """Line and absolute dotted name of everything a module imports, wherever in its text.

    Args:
        tree: the parsed module.
        module: its dotted name; a package's ends in `.__init__`.
    """
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            parents = module.split(".")[: -node.level] if node.level else []
            source = ".".join([*parents, *([node.module] if node.module else [])])
            if source == PACKAGE:  # `from drake_starnav import stars` names a room in its second half
                yield from ((node.lineno, f"{source}.{alias.name}") for alias in node.names)
            else:
                yield node.lineno, source


def violations(source: str, module: str, table: dict[str, Room] = TABLE) -> list[str]:
    """One sentence for each import that the table does not allow.

    Args:
        source: text of the module.
        module: its dotted name; a package's ends in `.__init__`.
        table: room -> what it may import.
    """
    room = module.split(".")[1]
    if room not in table:
        return [f"{module}: room {room} is not in the table of {Path(__file__).name}; add it where it belongs"]
    allowed_rooms, allowed_packages = {room, *table[room].rooms.split()}, set(table[room].packages.split())
    found = []
    for line, name in imported_modules(ast.parse(source), module):
        top, *rest = name.split(".")
        if top == PACKAGE:
            target = rest[0] if rest and rest[0] in table else "__init__"
            if target not in allowed_rooms:
                known = table[room].rooms or "no other room"
                found.append(f"{module}:{line} imports {name}; {room} may know {known}")
        elif top not in allowed_packages and top not in sys.stdlib_module_names:
            found.append(f"{module}:{line} imports {name}; {room} may know {table[room].packages or 'no package'}")
    return found


def modules() -> Iterator[tuple[str, Path]]:
    """Dotted name and file of every module of the package."""
    for path in sorted(FOLDER.rglob("*.py")):
        parts = path.relative_to(FOLDER).with_suffix("").parts
        if parts[0] not in DATA:
            yield ".".join((PACKAGE, *parts)), path


@pytest.mark.parametrize(("module", "path"), [pytest.param(*found, id=found[0]) for found in modules()])
def test_imports_point_down(module: str, path: Path) -> None:
    assert violations(path.read_text(encoding="utf-8"), module) == []


def test_the_table_has_no_way_up() -> None:
    lower: set[str] = set()
    for name, room in TABLE.items():
        assert set(room.rooms.split()) <= lower, f"{name} may only know rooms that stand before it in the table"
        lower.add(name)


def test_numerics_know_nothing_of_drake() -> None:
    for name in WITHOUT_DRAKE:
        assert "pydrake" not in TABLE[name].packages.split()
        assert set(TABLE[name].rooms.split()) <= WITHOUT_DRAKE, f"{name} would get pydrake through another room"


@pytest.mark.parametrize(
    ("module", "source", "complaint"),
    [
        (
            "stars.region",
            "import numpy as np\nfrom pydrake.math import RigidTransform",
            "stars.region:2 imports pydrake",
        ),
        ("stars.region", "def late():\n    import pydrake", "stars.region:2 imports pydrake"),
        ("stars.region", "from drake_starnav.roadmap.search import find_route", "stars may know"),
        ("stars.region", "from drake_starnav import roadmap", "imports drake_starnav.roadmap"),
        ("stars.region", "from ..roadmap import search", "imports drake_starnav.roadmap"),
        ("stars.__init__", "from ..roadmap import search", "imports drake_starnav.roadmap"),
        ("stars.region", "from .. import control", "imports drake_starnav.control"),
        ("stars.region", "import drake_starnav.systems.lidar_sensor", "imports drake_starnav.systems"),
        ("stars.region", "import drake_starnav", "imports drake_starnav"),
        ("scan", "from .stars import region", "imports drake_starnav.stars"),
        ("errors", "import numpy", "errors may know no package"),
        ("attic.old", "", "room attic is not in the table"),
    ],
)
def test_a_violation_is_found(module: str, source: str, complaint: str) -> None:
    (found,) = violations(source, f"{PACKAGE}.{module}")
    assert complaint in found


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("stars.region", "import math\nimport numpy as np\nfrom drake_starnav.scan import LaserScan"),
        ("stars.region", "from .free_range import free_range\nfrom ..scan import LaserScan\nfrom .. import scan"),
        ("stars.__init__", "from .region import StarRegion\nfrom . import region"),
        ("systems.lidar_sensor", "from pydrake.math import RigidTransform\nfrom drake_starnav.scan import LaserScan"),
        ("__init__", "from drake_starnav.scan import LaserScan\nfrom .diagram import make_diagram"),
    ],
)
def test_what_is_allowed_passes(module: str, source: str) -> None:
    assert violations(source, f"{PACKAGE}.{module}") == []
