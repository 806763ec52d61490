"""Write the table of rooms in docs/architecture.md, and draw a scan's way from the wired diagram.

Run: python scripts/maintenance/draw_architecture.py [--check]
"""

import argparse
import ast
import html
import importlib
import inspect
import sys
from itertools import cycle
from pathlib import Path
from typing import NamedTuple

from pydrake.systems.framework import Diagram, DiagramBuilder, PortDataType, System

import drake_starnav
from drake_starnav.navigation import add_navigation
from drake_starnav.scenario.scenario_file import load_scenario
from scripts.maintenance.record_results import stale, with_section
from scripts.maintenance.write_tables import DOCS, table
from tests.project.test_import_direction import METHOD, TABLE

PACKAGE = Path(drake_starnav.__file__).parent
PAGE, PICTURE = DOCS / "architecture.md", DOCS / "images" / "architecture.svg"
SECTION = "rooms", "python scripts/maintenance/draw_architecture.py"
DECLARED = ("obstacles.max_speed=1", "localization.jump=0.05", "drive.delay=0.1")
"""With these every system of the loop is there."""
ORDER = (
    "station",
    "goal",
    "tracker",
    "perception",
    "matcher",
    "planner",
    "jump_guard",
    "predictor",
    "controller",
    "shield",
)
"""The systems of the loop as they are updated; what the last one sends goes back to the first."""
NUMERICS = {*METHOD.split()} - {"errors", "parameters", "utils", "geometry", "lidar", "robot"}

LEFT, BOX, PORTS, LANE, LINE, GAP = 10, 310, 390, 22, 18, 26
"""Left edge and width of the boxes, where the lanes begin and their distance, height of a line, gap between boxes."""
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#8A6D00", "#56B4E9", "#555555")
FONT = 'font-family="Helvetica, Arial, sans-serif" font-size="12"'


class Port(NamedTuple):
    """One end of a connection: a system's name and its port's."""

    system: str
    port: str


class Box(NamedTuple):
    """A system in the figure.

    Attributes:
        name: that it has in the diagram.
        lines: what is written in the box.
        reads, writes: its connected ports, each with the signal on it.
        optional: whether the default scenario does without it.
    """

    name: str
    lines: tuple[str, ...]
    reads: tuple[tuple[str, Port], ...]
    writes: tuple[tuple[str, Port], ...]
    optional: bool

    @property
    def height(self) -> int:
        """In pixels."""
        return LINE * max(len(self.lines), len(self.reads) + len(self.writes)) + 12


def rooms_table() -> str:
    """A Markdown table with a row for each room: what it holds and what it may import."""
    rows = []
    for k, (name, room) in enumerate(TABLE.items()):
        folder = PACKAGE / name
        place, source = (
            (f"{name}/", folder / "__init__.py") if folder.is_dir() else (f"{name}.py", PACKAGE / f"{name}.py")
        )
        text = ast.get_docstring(ast.parse((PACKAGE / source).read_text(encoding="utf-8"))) or ""
        holds = text.split("\n\n")[0].replace("\n", " ")
        packages = ", ".join(sorted(set(room.packages.split())))
        rows.append((f"`{place}`", holds, _listed(list(TABLE)[:k], room.rooms.split()), packages))
    return table(("package", "holds", "may import", "third-party packages"), rows)


def _listed(above: list[str], known: list[str]) -> str:
    missing = [name for name in above if name not in known]
    if len(missing) < min(len(known), 5):
        return "all above" + (f" but {', '.join(missing)}" if missing else "") if above else ""
    return ", ".join(known)


def wired(overrides: tuple[str, ...]) -> Diagram:
    """The loop that `add_navigation` wires for the scenario `room`."""
    builder = DiagramBuilder()
    add_navigation(builder, load_scenario("room", overrides=list(overrides)))
    return builder.Build()


def connections(diagram: Diagram) -> dict[Port, Port]:
    """Which output each connected input reads."""
    found = {}
    for (reader, inward), (writer, outward) in diagram.connection_map().items():
        target = Port(reader.get_name(), reader.get_input_port(inward).get_name())
        found[target] = Port(writer.get_name(), writer.get_output_port(outward).get_name())
    return found


def boxes() -> list[Box]:
    """The loop's systems in their order, and the station once more as what is driven."""
    diagram, plain = wired(DECLARED), wired(())
    reads = connections(diagram)
    systems = {system.get_name(): system for system in diagram.GetSystems()}
    kept = {system.get_name() for system in plain.GetSystems()}
    found: list[Box] = []
    for name in (*ORDER, ORDER[0]):
        again = len(found) == len(ORDER)
        inward = [(port.port, source) for port, source in reads.items() if port.system == name]
        outward = sorted({source for source in reads.values() if source.system == name})
        if name == ORDER[0]:
            inward, outward = (inward, []) if again else ([], outward)
        labels = tuple((f"{source.port}: {_carried(systems[name], source.port)}", source) for source in outward)
        found.append(Box(name, _lines(systems[name]), tuple(sorted(inward)), labels, name not in kept))
    return found


def _carried(system: System, port: str) -> str:
    output = system.GetOutputPort(port)
    if output.get_data_type() == PortDataType.kVectorValued:
        return f"vector of {output.size()}"
    return type(output.Allocate().get_value()).__name__


def _lines(system: System) -> tuple[str, ...]:
    """Name and class, module, and the numerical functions that its module and those of its bases import."""
    cls = type(system)
    own = [base for base in cls.__mro__ if base.__module__.startswith("drake_starnav.systems")]
    calls = [call for module in dict.fromkeys(base.__module__ for base in own) for call in _functions(module)]
    place = cls.__module__.removeprefix("drake_starnav.").replace(".", "/")
    where = f"{place}.py" if cls.__module__.startswith("drake_starnav") else ""
    return (f"{system.get_name()}: {cls.__name__.partition('_')[0]}", *([where] if where else []), *calls)


def _functions(module: str) -> list[str]:
    tree = ast.parse(inspect.getsource(importlib.import_module(module)))
    found = []
    for node in tree.body:
        if not isinstance(node, ast.ImportFrom) or not node.module or node.module.split(".")[1:2] == []:
            continue
        if node.module.split(".")[1] in NUMERICS:
            functions = [alias.name for alias in node.names if alias.name.islower()]
            found += [f"{node.module.removeprefix('drake_starnav.')}.{name}()" for name in functions]
    return found


def picture() -> str:
    """The figure as SVG: boxes from top to bottom, and a lane for each signal from its writer to its readers."""
    parts, rows, y = [], [], 10
    for box in boxes():
        parts.append(_box(box, y))
        ports = [(text, signal, False) for text, signal in box.reads]
        ports += [(text, signal, True) for text, signal in box.writes]
        rows += [(y + 6 + LINE * k + LINE // 2, *port) for k, port in enumerate(ports)]
        y += box.height + GAP
    spans: dict[Port, list[int]] = {}
    for level, _, signal, _ in rows:
        spans.setdefault(signal, []).append(level)
    lanes = _lanes({signal: (levels[0], levels[-1]) for signal, levels in spans.items()})
    start = PORTS + 190
    colours = dict(zip(sorted(spans, key=lambda signal: spans[signal]), cycle(COLOURS), strict=False))
    for level, text, signal, is_output in rows:
        x, colour = start + LANE * lanes[signal], colours[signal]
        edge = LEFT + BOX
        parts.append(f'<path d="M{edge} {level}H{x}" stroke="{colour}" fill="none"/>')
        if is_output:
            parts.append(f'<circle cx="{x}" cy="{level}" r="3.5" fill="{colour}"/>')
        else:
            parts.append(f'<path d="M{edge} {level}l8 -4v8z" fill="{colour}"/>')
        label = html.escape(text)
        parts.append(f'<text x="{edge + 14}" y="{level - 3}" fill="{colour}" {FONT}>{label}</text>')
    for signal, levels in spans.items():
        x = start + LANE * lanes[signal]
        parts.append(f'<path d="M{x} {levels[0]}V{levels[-1]}" stroke="{colours[signal]}" fill="none"/>')
    width, height = start + LANE * (max(lanes.values()) + 1), y - GAP + 10
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}">'
    return "\n".join([head, '<rect width="100%" height="100%" fill="white"/>', *parts, "</svg>"]) + "\n"


def _box(box: Box, y: int) -> str:
    dashes = ' stroke-dasharray="5 4"' if box.optional else ""
    frame = (
        f'<rect x="{LEFT}" y="{y}" width="{BOX}" height="{box.height}" rx="4" fill="#f4f6f8" stroke="#333"{dashes}/>'
    )
    lines = []
    for k, line in enumerate(box.lines):
        weight = ' font-weight="bold"' if k == 0 else ""
        at = y + 6 + LINE * k + 13
        lines.append(f'<text x="{LEFT + 8}" y="{at}" fill="#222"{weight} {FONT}>{html.escape(line)}</text>')
    return "\n".join([frame, *lines])


def _lanes(spans: dict[Port, tuple[int, int]]) -> dict[Port, int]:
    """A lane for each span, the innermost that is free along all of it."""
    taken: list[list[tuple[int, int]]] = []
    found = {}
    for signal, (low, high) in sorted(spans.items(), key=lambda item: (item[1][1] - item[1][0], item[1])):
        free = (k for k, others in enumerate(taken) if all(high < a or b < low for a, b in others))
        lane = next(free, len(taken))
        if lane == len(taken):
            taken.append([])
        taken[lane].append((low, high))
        found[signal] = lane
    return found


def texts() -> dict[Path, str]:
    """What the page and the picture should hold."""
    return {PAGE: with_section(PAGE.read_text(encoding="utf-8"), *SECTION, rooms_table()), PICTURE: picture()}


def write(check: bool) -> int:
    """Write page and picture, or only compare them; returns the exit code."""
    outdated = {path: text for path, text in texts().items() if stale(path, text)}
    for path, text in outdated.items():
        if check:
            print(f"{path.name} is out of date; run {SECTION[1]}", file=sys.stderr)
        else:
            path.write_text(text, encoding="utf-8")
            print(f"wrote {path.name}")
    return 1 if outdated and check else 0


def main() -> int:
    """Write page and picture; returns the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 if one of them is out of date")
    options = parser.parse_args()
    return write(options.check)


if __name__ == "__main__":
    sys.exit(main())
