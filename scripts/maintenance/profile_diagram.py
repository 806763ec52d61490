"""How much dearer the whole diagram is than its plant alone.

Run: python scripts/maintenance/profile_diagram.py [SCENARIO]
"""

import argparse
import sys
import time

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput, TrajectorySource, VectorLogSink
from pydrake.trajectories import PiecewisePolynomial

from drake_starnav.cli.options import exit_code
from drake_starnav.navigation import Navigation, add_navigation
from drake_starnav.scenario import Scenario, load_scenario
from drake_starnav.station.plant import add_plant
from drake_starnav.station.robot_model import drive_geometry
from drake_starnav.utils.stopwatch import Stopwatch
from drake_starnav.worlds.world import World


def whole_diagram(scenario: Scenario, seed: int, stopwatch: Stopwatch) -> tuple[Diagram, Navigation, VectorLogSink]:
    """The diagram as it navigates, with a log of the twists it commands."""
    builder = DiagramBuilder()
    navigation = add_navigation(builder, scenario, seed=seed, stopwatch=stopwatch)
    log = LogVectorOutput(navigation.controller.GetOutputPort("twist_command"), builder, 1.0 / scenario.controller.rate)
    return builder.Build(), navigation, log


def plant_alone(scenario: Scenario, world: World, times: np.ndarray, twists: np.ndarray) -> Diagram:
    """Plant and scene graph, driven by recorded twists."""
    builder = DiagramBuilder()
    plant, scene_graph, model, _ = add_plant(builder, world, scenario.robot, scenario.simulation.time_step)
    geometry = drive_geometry(plant, scene_graph, model)
    turn = 0.5 * geometry["track"] * twists[1]
    wheels = np.vstack((twists[0] - turn, twists[0] + turn)) / geometry["wheel_radius"]
    desired = PiecewisePolynomial.ZeroOrderHold(times, np.vstack((np.zeros_like(wheels), wheels)))
    source = builder.AddSystem(TrajectorySource(desired))
    builder.Connect(source.get_output_port(), plant.get_desired_state_input_port(model))
    return builder.Build()


def timed(diagram: Diagram, duration: float) -> tuple[float, Simulator]:
    """Wall-clock time of simulating a diagram, s, and the simulator."""
    simulator = Simulator(diagram)
    simulator.Initialize()
    start = time.perf_counter()
    simulator.AdvanceTo(duration)
    return time.perf_counter() - start, simulator


def main() -> int:
    """Measure; see `--help`. Returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenario", nargs="?", default="forest")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--duration", type=float, default=20.0, help="simulated time of a run, s (default: 20)")
    parser.add_argument("--runs", type=int, default=5, help="pairs of runs (default: 5)")
    options = parser.parse_args()
    return exit_code("profile_diagram.py", lambda: profile(options))


def profile(options: argparse.Namespace) -> int:
    """Print the table; returns the exit code."""
    scenario = load_scenario(options.scenario)
    timed(whole_diagram(scenario, options.seed, Stopwatch())[0], 1.0)  # compiles
    stopwatch = Stopwatch()
    whole, alone = [], []
    for _ in range(options.runs):
        diagram, navigation, log = whole_diagram(scenario, options.seed, stopwatch)
        seconds, simulator = timed(diagram, options.duration)
        whole.append(seconds)
        record = log.FindLog(simulator.get_context())
        bare = plant_alone(scenario, navigation.world, record.sample_times(), record.data())
        alone.append(timed(bare, options.duration)[0])
    ratios = np.array(whole) / np.array(alone)
    runs = f"{options.runs} pairs of runs, {options.duration:g} s of {scenario.name} seed {options.seed}"
    spread = f"{ratios.min():.2f} to {ratios.max():.2f}"
    print(f"whole diagram / plant alone: {np.median(ratios):.2f} (median of {runs}; {spread})")
    print(f"  whole diagram  {np.median(whole) / options.duration * 1e3:6.1f} ms per simulated second")
    print(f"  plant alone    {np.median(alone) / options.duration * 1e3:6.1f} ms per simulated second")
    for name in ("scan", "update", "command"):
        times = stopwatch.seconds[name]
        share = sum(times) / options.runs / options.duration * 1e3
        rate = len(times) / options.runs / options.duration
        print(f"  {name:<9} {rate:6.1f} /s  {share:6.1f} ms per simulated second")
    return 0


if __name__ == "__main__":
    sys.exit(main())
