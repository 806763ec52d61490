"""Draw which system is updated when, for docs/ports.md, from 100 ms of a real run.

Run: python scripts/maintenance/draw_timing.py
"""

import argparse
import sys
from pathlib import Path

from matplotlib.figure import Figure
from pydrake.systems.framework import Context, DiagramBuilder, EventStatus, System

from drake_starnav.cli.options import exit_code
from drake_starnav.navigation import Parts, add_navigation
from drake_starnav.scenario.scenario_file import load_scenario
from drake_starnav.station.navigation_station import add_station
from drake_starnav.station.plant import make_simulator
from drake_starnav.utils.files import replacing
from drake_starnav.worlds import make_world
from scripts.maintenance.write_tables import DIAGRAMS

FILE = DIAGRAMS.parent / "timing.svg"
BEGIN, LENGTH = 1.0, 0.1
"""Of the window, s."""
ROWS = {
    "lidar": ("LidarSensor", "scan: unrestricted update"),
    "planner": ("StarRoadmapPlanner", "state takes over the scan before: unrestricted update"),
    "shield": ("TwistShield", "twist_command: discrete update, which evaluates DsmController"),
    "plant": ("MultibodyPlant", "step of the integrator begins"),
}
"""By the name of the system, in the order in which a scan goes through them: its class, and what changes."""


def update_times(begin: float = BEGIN, length: float = LENGTH) -> dict[str, list[float]]:
    """When the state of each system of ROWS changes in a room, from `begin` on, s.

    What changed between the ends of two steps was updated at the beginning of the later one.
    """
    scenario, builder = load_scenario("room"), DiagramBuilder()
    world = make_world(scenario.world, 7, scenario.robot.radius)
    station = add_station(builder, world, scenario, continuous=True, seed=7)
    add_navigation(builder, scenario, Parts(world, station), 7)
    simulator = make_simulator(builder.Build())
    root = simulator.get_context()
    systems = {system.get_name(): system for system in _leaves(simulator.get_system())}
    times: dict[str, list[float]] = {name: [] for name in ROWS}
    last, begins = {name: _state(systems[name], root) for name in ROWS}, [root.get_time()]

    def note(context: Context) -> EventStatus:
        for name in ROWS:
            now = _state(systems[name], context)
            if now != last[name]:
                times[name].append(begins[-1])
            last[name] = now
        begins.append(context.get_time())
        return EventStatus.DidNothing()

    simulator.set_monitor(note)
    simulator.AdvanceTo(begin + length + 0.05)
    return {name: [t for t in found if begin - 1e-6 <= t <= begin + length + 1e-6] for name, found in times.items()}


def _leaves(system: System) -> list[System]:
    if not hasattr(system, "GetSystems"):
        return [system]
    return [leaf for inner in system.GetSystems() for leaf in _leaves(inner)]


def _state(system: System, root: Context) -> tuple:
    context = system.GetMyContextFromRoot(root)
    abstract = (id(context.get_abstract_state(k).get_value()) for k in range(context.num_abstract_states()))
    discrete = (tuple(context.get_discrete_state(k).value()) for k in range(context.num_discrete_state_groups()))
    return *abstract, *discrete, *context.get_continuous_state_vector().CopyToVector()


def timing_figure(times: dict[str, list[float]]) -> Figure:
    """One row for each system; an arrow from each scan to the first command that uses it."""
    figure = Figure(figsize=(8.4, 2.9), layout="constrained")
    axes = figure.add_subplot()
    rows = dict(zip(ROWS, range(len(ROWS), 0, -1), strict=True))
    for name, (cls, what) in ROWS.items():
        at = [1e3 * (time - BEGIN) for time in times[name]]
        axes.plot(at, [rows[name]] * len(at), "o", color="#0072b2", markersize=7)
        axes.text(1.0, rows[name] + 0.22, what, fontsize=8, color="#444444")
        axes.axhline(rows[name], color="#cccccc", linewidth=0.8, zorder=0)
        axes.text(-3.0, rows[name], cls, ha="right", va="center", fontsize=9, family="monospace")
    for scan in times["lidar"]:
        uses = [time for time in times["shield"] if time >= scan - 1e-6]
        if uses:
            begin, end = (1e3 * (time - BEGIN) for time in (scan, uses[0]))
            arrow = {"arrowstyle": "->", "color": "#d55e00", "shrinkA": 4, "shrinkB": 4}
            axes.annotate("", (end, rows["shield"]), (begin, rows["lidar"]), arrowprops=arrow)
    axes.set_xlim(-2.0, 1e3 * LENGTH + 2.0)
    axes.set_ylim(0.6, len(ROWS) + 0.6)
    axes.set_yticks([])
    axes.set_xlabel("simulated time, ms; arrows: from a scan to the first command that uses it and the plan from it")
    for side in ("left", "top", "right"):
        axes.spines[side].set_visible(False)
    return figure


def main() -> int:
    """Write the picture; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=FILE, metavar="FILE", help="default: docs/images/timing.svg")
    options = parser.parse_args()
    return exit_code("draw_timing.py", lambda: draw(options.out))


def draw(file: Path) -> int:
    """Write the picture to an SVG file; returns the exit code."""
    with replacing(file) as temporary:
        timing_figure(update_times()).savefig(temporary, format="svg", metadata={"Date": None})
    print(f"wrote {file}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
