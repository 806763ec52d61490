"""Write docs/ports.md, docs/parameters.md, docs/examples and the tables of other pages.

Run: python scripts/maintenance/write_tables.py [--check]
"""

import argparse
import importlib
import inspect
import pkgutil
import re
import sys
import textwrap
from collections.abc import Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import yaml
from pydrake.geometry import SceneGraph
from pydrake.math import RigidTransform
from pydrake.systems.framework import PortDataType, System

import drake_starnav.baselines
import drake_starnav.station
import drake_starnav.systems
import drake_starnav.visualization
from drake_starnav.baselines.baseline_controller import BaselineController
from drake_starnav.baselines.grid_planner import GridPlanner
from drake_starnav.localization.scan_matching import OdometryError
from drake_starnav.paper.choices import CHOICES
from drake_starnav.paper.contents import ENTRIES
from drake_starnav.parameters import allowed_text, declared
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.error_budget import SYMBOLS, TERMS
from drake_starnav.scenario.margins import derive_margins
from drake_starnav.scenario.schema import SECTIONS, Scenario
from drake_starnav.simulation.monitors import ArrivalMonitor
from drake_starnav.station.lidar_sensor import LidarMount, LidarSensor
from drake_starnav.station.monitors import CollisionMonitor
from drake_starnav.station.moving_bodies import MovingObstacleDrive
from drake_starnav.station.navigation_station import NavigationStation
from drake_starnav.station.planar_drive import PlanarVelocityCommand
from drake_starnav.station.planar_localization import PlanarLocalization
from drake_starnav.station.robot_geometry import Drive, RobotModel
from drake_starnav.station.wheel_drive import StepsCheck, WheelServo, WheelSlip, WheelSpeedCommand
from drake_starnav.systems.controller import Controller
from drake_starnav.systems.dsm_controller import DsmController
from drake_starnav.systems.fixed_goal import FixedGoal
from drake_starnav.systems.goal_sequence import GoalSequence
from drake_starnav.systems.jump_guard import JumpGuard
from drake_starnav.systems.obstacle_tracker import ObstacleTracker
from drake_starnav.systems.scan_matcher import ScanMatcher
from drake_starnav.systems.star_perception import StarPerception
from drake_starnav.systems.star_roadmap_planner import StarRoadmapPlanner
from drake_starnav.systems.state_predictor import StatePredictor
from drake_starnav.systems.twist_shield import TwistShield, Unshielded
from drake_starnav.visualization.goal_sliders import SliderGoal
from drake_starnav.visualization.star_roadmap_visualizer import StarRoadmapVisualizer
from drake_starnav.visualization.timeline import SceneRecorder, SceneTimeline
from drake_starnav.worlds import WORLD_KINDS, World
from drake_starnav.worlds.moving_obstacles import MovingObstacles
from scripts.experiments.fault_table import stored_table
from scripts.maintenance.example_pages import example_pages

ROOMS = (drake_starnav.systems, drake_starnav.baselines, drake_starnav.station, drake_starnav.visualization)
"""Packages whose modules define systems."""
ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
WRITTEN = "<!-- written by `python scripts/maintenance/write_tables.py`; change the code, not this file -->"
FAULTS = ROOT / "benchmarks" / "results" / "faults"
"""The trials of scripts/experiments/fault_table.py that docs/faults.md quotes."""
BEGIN = "<!-- tables: written by `python scripts/maintenance/write_tables.py`; change the code, not these -->"
END = "<!-- end of the tables -->"

Row = tuple[str, ...]

PARAMETER_HEAD: Row = ("parameter", "unit", "default", "allowed", "meaning", "when to change it")


def all_systems() -> list[System]:
    """One of each system of the package, with default parameters, in the order in which a scan passes them."""
    defaults = Scenario(name="defaults", world=None)
    robot, lidar, planner, controller = defaults.robot, defaults.lidar, defaults.planner, defaults.controller
    margins = derive_margins(defaults)
    station = NavigationStation(World("empty", (0.0, 0.0, 0.0), (1.0, 0.0)), defaults)
    return [
        station,
        station.GetSubsystemByName("robot"),  # its `RobotInterface`
        LidarSensor(lidar, LidarMount(SceneGraph.world_frame_id(), RigidTransform())),
        PlanarLocalization(num_positions=9, num_velocities=8, lidars=[lidar]),
        ObstacleTracker(defaults.obstacles, lidar),
        StarPerception(robot, margins, lidar),
        ScanMatcher(OdometryError(0.02, 0.0, lidar.noise)),
        StarRoadmapPlanner(robot, planner, margins),
        GridPlanner(),
        FixedGoal((1.0, 0.0)),
        GoalSequence([(1.0, 0.0)], tolerance=0.3, period=0.02),
        DsmController(robot, controller, margins, obstacles=defaults.obstacles),
        BaselineController(robot, SimpleNamespace(knows_obstacles=True, follows_roadmap=True)),  # with every port
        TwistShield(robot, controller, margins, obstacles=defaults.obstacles),
        Unshielded(robot, controller),
        WheelServo(RobotModel(station.plant, station.scene_graph, station.robot_model)),
        WheelSpeedCommand(robot=robot, drive=Drive((0.05, 0.05), (-0.16, 0.16))),
        PlanarVelocityCommand(robot=RobotParameters(base="omnidirectional")),
        StatePredictor(robot, delay=0.05, rate=controller.rate),
        JumpGuard(tolerance=0.05, rate=controller.rate),
        WheelSlip(sides=(0, 1), slip=0.05, seed=0),
        CollisionMonitor(robot=(), ground=()),
        MovingObstacleDrive(
            MovingObstacles(np.array([0.3]), (np.array([(0.0, 0.0, 0.0), (1.0, 1.0, 0.0)]),)), time_step=0.005
        ),
        ArrivalMonitor(tolerance=0.3, period=0.02, goals=2),
        SliderGoal((1.0, 0.0), lambda: None),
        SceneRecorder(SceneTimeline(SceneGraph()), period=0.1),
        StarRoadmapVisualizer(None, defaults.recording, robot),  # without a Meshcat: it never draws here
    ]


def system_classes() -> set[type[System]]:
    """Every public system that a module of `ROOMS` defines, with the one above them, but bases and what has no port."""
    found = set()
    infos = (info for room in ROOMS for info in pkgutil.iter_modules(room.__path__, f"{room.__name__}."))
    for info in infos:
        module = importlib.import_module(info.name)
        for name, member in vars(module).items():
            defined_here = inspect.isclass(member) and member.__module__ == module.__name__
            if defined_here and issubclass(member, System) and not name.startswith("_"):
                found.add(member)
    return found - {Controller, StepsCheck} | {ArrivalMonitor}


def documented_ports(cls: type) -> dict[str, str]:
    """What the section "Ports" of a system's docstring, or else of its base's, says by port name, wildcards allowed."""
    described = next((base for base in cls.__mro__ if "\nPorts" in inspect.cleandoc(base.__doc__ or "")), cls)
    lines = inspect.cleandoc(described.__doc__ or "").splitlines()
    start = next((k for k, line in enumerate(lines) if line.startswith("Ports")), len(lines))
    texts: dict[str, str] = {}
    names: list[str] = []
    for line in lines[start + 1 :]:
        if not line.strip():
            break
        if line.startswith(" " * 8):
            for name in names:
                texts[name] += f" {line.strip()}"
        else:
            head, _, text = line.strip().partition(": ")
            names = head.split(", ")
            texts.update(dict.fromkeys(names, text))
    return texts


def port_rows(system: System) -> list[Row]:
    """One row (direction, port, carries, meaning) for each port of a system, inputs first."""
    texts = documented_ports(type(system))
    ports = [("in", system.get_input_port(k)) for k in range(system.num_input_ports())]
    ports += [("out", system.get_output_port(k)) for k in range(system.num_output_ports())]
    rows: list[Row] = []
    for direction, port in ports:
        name = port.get_name()
        meaning = next((text for pattern, text in texts.items() if fnmatchcase(name, pattern)), "")
        rows.append((direction, f"`{name}`", _carries(system, direction, port), meaning))
    return rows


def _carries(system: System, direction: str, port: Any) -> str:
    if port.get_data_type() == PortDataType.kVectorValued:
        return f"vector of {port.size()}"
    value = system.AllocateInputAbstract(port) if direction == "in" else port.Allocate()
    kind = type(value.get_value())
    if kind is SimpleNamespace:  # a port that takes any object with the attributes it names
        return "`object`"
    return f"`{kind.__name__.partition('_')[0]}`"  # some Drake versions name the scalar type too: QueryObject_[float]


def parameter_rows(cls: type, place: str) -> list[Row]:
    """One row, with the columns of `PARAMETER_HEAD`, for each parameter of a dataclass.

    Args:
        cls: the dataclass, whose fields were made by `parameter`.
        place: section of the scenario, e.g. "lidar", for the dotted names.
    """
    defaults = cls()
    rows: list[Row] = []
    for field in declared(cls):
        meta = field.metadata
        default = getattr(defaults, field.name)
        name = f"`{place}.{field.name}`"
        unit, meaning, when = (meta.get(key, "") for key in ("unit", "help", "when"))
        rows.append((name, unit, f"`{yaml_text(default)}`", allowed_text(field), meaning, when))
    return rows


def yaml_text(value: Any) -> str:
    """A parameter's value as one would write it into a scenario."""
    if isinstance(value, float):
        return f"{value:.6g}"
    return yaml.safe_dump(value, default_flow_style=True).removesuffix("...\n").strip()


def table(head: Row, rows: Sequence[Row]) -> str:
    """A Markdown table, without a last column that is empty."""
    if rows and not any(row[-1] for row in rows):
        head, rows = head[:-1], [row[:-1] for row in rows]
    lines = [head, ("---",) * len(head), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)


def _summary(cls: type) -> str:
    return inspect.cleandoc(cls.__doc__ or "").split("\n\n")[0].replace("\n", " ")


def ports_page() -> str:
    """The text of docs/ports.md."""
    parts = [
        f"""# Systems and their ports

{WRITTEN}

Frames: W is the world, S the lidar, B the robot's base; O the odometry and M the map of `ScanMatcher`. In m, rad and s.
All systems are defined for T = double only. Those that a scan passes come first, in that order.

[architecture.md](architecture.md#the-path-of-a-scan) shows how `add_navigation` wires them; any diagram can be drawn by
Drake's `GetGraphvizString`.

## What is updated when

![Updates of lidar, planner, shield and plant over 100 ms](images/timing.svg)

Drake executes the unrestricted updates of an instant before the discrete ones, and an output is evaluated when
something asks for it. The command at the instant of a scan therefore uses that scan and the plan from it.

{_discrete_update(StarRoadmapPlanner)}
"""
    ]
    for system in all_systems():
        name, module = type(system).__name__, type(system).__module__
        # the column before says already whether a port carries a vector
        rows = [(*row[:-1], re.sub(r"^(abstract, |vector (?=\())", "", row[-1])) for row in port_rows(system)]
        ports = table(("", "port", "carries", "meaning"), rows)
        parts.append(f"## {name}\n\n{_summary(type(system))} In `{module}`.\n\n{ports}\n")
    return "\n".join(parts)


def _discrete_update(cls: type) -> str:
    """The paragraph of a system's docstring that says what its discrete update is."""
    paragraphs = inspect.cleandoc(cls.__doc__ or "").split("\n\n")
    return next(text for text in paragraphs if text.startswith("Discrete update")).replace("\n", " ")


def parameters_page() -> str:
    """The text of docs/parameters.md."""
    parts = [
        f"""# Parameters

{WRITTEN}

Every parameter is a key of a scenario's YAML file and can be set on the command line, e.g. `--set robot.radius=0.3`.
An unknown key or an invalid value ends the run with one sentence that says what is allowed. [tuning.md](tuning.md) has
settings for a noisy lidar, narrow doors, a fast or a big robot.
"""
    ]
    for section, cls in SECTIONS.items():
        parts.append(f"## {section}\n\n{_summary(cls)}\n\n{table(PARAMETER_HEAD, parameter_rows(cls, section))}\n")
    parts.append(
        "## world\n\nThe parameters of each kind of world are in [worlds.md](worlds.md).\n\n"
        "## directives\n\nA list of Drake's model directives: the bodies of a `!Model`, see\n"
        "[worlds.md](worlds.md#drake-models).\n\n"
        "## plant_config, simulator_config\n\n"
        "Keys of Drake's `MultibodyPlantConfig` and `SimulatorConfig`, laid over the settings of this package's\n"
        "plant (except for `time_step`: see `simulation.time_step`) and Drake's defaults of the\n"
        "simulator. The margins assume ours.\n"
    )
    return "\n".join(parts)


def worlds_page() -> str:
    """The text of docs/worlds.md: what is written there by hand, with its tables up to date."""
    what = [(f"`!{name}`", _summary(cls)) for name, cls in WORLD_KINDS.items()]
    rows = [(f"`!{name}`", *row) for name, cls in WORLD_KINDS.items() for row in parameter_rows(cls, "world")]
    return _with_tables(
        DOCS / "worlds.md", [table(("world", "what it is"), what), table(("world", *PARAMETER_HEAD), rows)]
    )


def faults_page() -> str:
    """The text of docs/faults.md: what is written there by hand, with the table of the stored trials up to date."""
    head, rows = stored_table(FAULTS)
    return _with_tables(DOCS / "faults.md", [table(head, [(f"`{declared}`", *cells) for declared, *cells in rows])])


def safety_page() -> str:
    """The text of SAFETY.md: what is written there by hand, with the formula of the margins up to date."""
    terms = [(f"`{'+' if k else 'e ='} {entry.text}`", entry.meaning) for k, entry in enumerate(TERMS)]
    symbols = [(f"`{name}`", f"`{entry.text}`", entry.meaning) for name, entry in SYMBOLS.items()]
    tables = [table(("error, m", "caused by"), terms), table(("symbol", "value", "meaning"), symbols)]
    return _with_tables(ROOT / "SAFETY.md", [textwrap.indent(text, "   ") for text in tables], indent="   ")


def paper_page() -> str:
    """The text of docs/paper.md: what is written there by hand, with the map and the choices up to date."""
    places = [(e.name, e.subject, f"`{e.place}`", e.as_here, e.in_star) for e in ENTRIES]
    values = [(f"`{name}`", f"`{yaml_text(c.value)}`", *c[1:]) for name, c in CHOICES.items()]
    head = ("choice", "value", "what it is", "printed", "why", "others")
    return _with_tables(
        DOCS / "paper.md",
        [table(("paper", "says", "is in", "`star_paper`", "`star`"), places), table(head, values)],
    )


def _with_tables(page: Path, tables: Sequence[str], indent: str = "") -> str:
    """The text of a page with other tables between `BEGIN` and `END`, which stand indented."""
    before, rest = page.read_text(encoding="utf-8").split(BEGIN)
    return "\n\n".join((before + BEGIN, *tables, indent + END)) + rest.split(END)[1]


PAGES = {
    "docs/ports.md": ports_page,
    "docs/parameters.md": parameters_page,
    "docs/worlds.md": worlds_page,
    "docs/faults.md": faults_page,
    "SAFETY.md": safety_page,
    "docs/paper.md": paper_page,
    **example_pages(),
}
"""What is written, by its place in the repository."""


def main() -> int:
    """Write the pages, or only compare them; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 if a page is out of date")
    options = parser.parse_args()
    outdated = 0
    for name, page in PAGES.items():
        path, text = ROOT / name, page()
        current = path.is_file() and path.read_text(encoding="utf-8") == text
        if options.check and not current:
            outdated = 1
            print(f"{name} is out of date; run python scripts/maintenance/write_tables.py", file=sys.stderr)
        elif not options.check:
            path.parent.mkdir(exist_ok=True)
            path.write_text(text, encoding="utf-8")
            print(f"{name}: {'unchanged' if current else 'written'}")
    return outdated


if __name__ == "__main__":
    sys.exit(main())
