"""Imports follow the table of rooms, and numerics do not import Drake.

A room is a module or a folder directly in the package. The table lists the rooms and the third-party packages that each
room may import. An import that it does not list is an error, and so is a room that it does not list.
"""

import ast
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import drake_starnav

PACKAGE = "drake_starnav"
FOLDER = Path(drake_starnav.__file__).parent
DATA = {"share"}
"""Folders of the package that hold no code."""


@dataclass(frozen=True)
class Room:
    """What the modules of a room may import, besides each other and the standard library."""

    rooms: str = ""
    packages: str = ""


GROUND = "errors parameters utils"
SENSING = f"{GROUND} geometry lidar robot"
METHOD = f"{SENSING} surroundings localization safety planning manoeuvres control moving worlds"
LOOP = f"{METHOD} models scenario systems station loading navigation"
ARRAYS = "numpy scipy numba"
DRAKE = "numpy numba pydrake"

TABLE = {
    "errors": Room(),
    "parameters": Room("errors", "numpy"),
    "utils": Room("errors", "numpy numba tqdm yaml"),
    "geometry": Room("errors utils", f"{ARRAYS} shapely"),
    "lidar": Room(f"{GROUND} geometry", f"{ARRAYS} rosbags"),
    "robot": Room(f"{GROUND} geometry", "numpy numba"),
    "surroundings": Room(SENSING, ARRAYS),
    "localization": Room(SENSING, ARRAYS),
    "safety": Room(f"{SENSING} surroundings", ARRAYS),
    "planning": Room(f"{SENSING} surroundings", ARRAYS),
    "manoeuvres": Room(f"{SENSING} surroundings planning", ARRAYS),
    "control": Room(f"{SENSING} surroundings safety planning manoeuvres", ARRAYS),
    "moving": Room(f"{SENSING} surroundings safety planning control", ARRAYS),
    "worlds": Room(f"{SENSING} surroundings planning", f"{ARRAYS} shapely yaml PIL"),
    "models": Room(f"{SENSING} worlds", "numpy scipy trimesh pydrake xacro"),
    "scenario": Room(METHOD, "numpy yaml"),
    "systems": Room(METHOD, f"{DRAKE} shapely"),
    "station": Room(f"{SENSING} worlds planning models scenario systems", f"{DRAKE} shapely"),
    "paper": Room(f"{SENSING} surroundings safety planning control scenario", f"{ARRAYS} sklearn"),
    "baselines": Room(
        f"{SENSING} surroundings safety planning control worlds scenario systems", f"{ARRAYS} sklearn pydrake"
    ),
    "loading": Room("scenario station"),
    "navigation": Room(f"{METHOD} scenario systems station", DRAKE),
    "runtime": Room(LOOP, f"{DRAKE} mcap cyclonedds rclpy"),
    "visualization": Room(LOOP, f"{DRAKE} shapely matplotlib PIL imageio_ffmpeg"),
    "simulation": Room(f"{LOOP} runtime visualization", DRAKE),
    "evaluation": Room(f"{LOOP} visualization simulation", "numpy scipy dask distributed jinja2 matplotlib"),
    "cli": Room(f"{LOOP} runtime visualization simulation evaluation", DRAKE),
    "plotting": Room("errors utils geometry visualization"),
    "__init__": Room(f"{LOOP} visualization simulation"),
    "__main__": Room("cli"),
}
"""A room may only import rooms that precede it here."""

WITHOUT_DRAKE = {*METHOD.split(), "scenario"}


def imported_modules(tree: ast.AST, module: str) -> Iterator[tuple[int, str]]:
    """Line and absolute dotted name of everything that a module, of a dotted name, imports at any level."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            parents = module.split(".")[: -node.level] if node.level else []
            source = ".".join([*parents, *([node.module] if node.module else [])])
            if source == PACKAGE:  # `from drake_starnav import surroundings` names the room after `import`
                yield from ((node.lineno, f"{source}.{alias.name}") for alias in node.names)
            else:
                yield node.lineno, source


def violations(source: str, module: str) -> list[str]:
    """One message for each import of a module, of a text and a dotted name, that the table does not allow."""
    room, found = module.split(".")[1], []
    rooms, packages = {room, *TABLE[room].rooms.split()}, set(TABLE[room].packages.split())
    for line, name in imported_modules(ast.parse(source), module):
        top, *rest = name.split(".")
        target = rest[0] if rest and rest[0] in TABLE else "__init__"
        if target not in rooms if top == PACKAGE else top not in packages | sys.stdlib_module_names:
            found.append(f"{module}:{line} imports {name}; {room} may import {sorted(rooms)}, {sorted(packages)}")
    return found


def modules() -> Iterator[tuple[str, Path]]:
    """Dotted name and file of every module of the package."""
    for path in sorted(FOLDER.rglob("*.py")):
        parts = path.relative_to(FOLDER).with_suffix("").parts
        if parts[0] not in DATA:
            yield ".".join((PACKAGE, *parts)), path


def test_imports_follow_the_table() -> None:
    assert [said for module, path in modules() for said in violations(path.read_text(encoding="utf-8"), module)] == []


def test_a_room_imports_only_rooms_before_it() -> None:
    lower: set[str] = set()
    for name, room in TABLE.items():
        assert set(room.rooms.split()) <= lower, f"{name} may only import rooms that precede it in the table"
        lower.add(name)


def test_the_table_has_all_rooms() -> None:
    rooms = {module.split(".")[1] for module, _ in modules()}
    assert rooms == set(TABLE), "the rooms of the table are not those of the package"


def test_numerics_do_not_import_drake() -> None:
    for name in WITHOUT_DRAKE:
        assert "pydrake" not in TABLE[name].packages.split()
        assert set(TABLE[name].rooms.split()) <= WITHOUT_DRAKE, f"{name} would get pydrake through another room"
