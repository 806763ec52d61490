"""Measure the cost of a large map: python -m benchmarks.map_world [--map FILE] [--pairs 5]

Without --map a noisy warehouse of 1,700 x 1,000 cells of 5 cm is drawn. Reports the number of boxes, and the time to
read the map and draw start and goal, to build the station, for a step of its plant, for a scan, for the shortest path,
and for the clearances of a drive.
"""

import argparse
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from pydrake.systems.analysis import Simulator

from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.schema import Scenario
from drake_starnav.station.navigation_station import NavigationStation
from drake_starnav.worlds import RosMap, compute_clearance, find_shortest_path, make_world
from drake_starnav.worlds.formats.ros_map import FREE, OCCUPIED, UNKNOWN, OccupancyMap
from tests.helpers.maps import write_map


def warehouse(rng: np.random.Generator, rows: int = 1000, columns: int = 1700) -> np.ndarray:
    """Racks in blocks between aisles, pillars, pallets at any angle, and a scanner's noise.

    Returns:
        Shape (rows, columns), int8, as `OccupancyMap.cells`.
    """
    cells = np.full((rows, columns), FREE, np.int8)
    cells[:4] = cells[-4:] = OCCUPIED
    cells[:, :4] = cells[:, -4:] = OCCUPIED
    for top in range(60, rows - 80, 70):
        for left in range(80, columns - 200, 190):
            if rng.random() < 0.1:
                continue
            cells[top : top + 22, left : left + 150] = UNKNOWN
            cells[top : top + 2, left : left + 150] = cells[top + 20 : top + 22, left : left + 150] = OCCUPIED
            cells[top : top + 22, left : left + 150 : 30] = OCCUPIED
    y, x = np.mgrid[-12:13, -12:13]
    for _ in range(rows * columns // 40_000):  # pallets
        i, j = rng.integers(30, rows - 30), rng.integers(30, columns - 30)
        angle = rng.uniform(0.0, np.pi)
        u, v = np.cos(angle) * x + np.sin(angle) * y, np.cos(angle) * y - np.sin(angle) * x
        cells[i - 12 : i + 13, j - 12 : j + 13][(abs(u) < 10) & (abs(v) < 7)] = OCCUPIED
    solid = cells == OCCUPIED
    beside = (np.roll(solid, 1, 0) | np.roll(solid, -1, 0) | np.roll(solid, 1, 1) | np.roll(solid, -1, 1)) & ~solid
    cells[beside & (rng.random(cells.shape) < 0.02)] = OCCUPIED
    return cells


def report(name: str, value: str) -> None:
    """Print one line."""
    print(f"{name:>40}  {value}", flush=True)


def main() -> int:
    """Measure and print; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--map", type=Path, help="a map_server YAML file (default: a drawn warehouse)")
    parser.add_argument("--pairs", type=int, default=5, help="of start and goal (default: 5)")
    options = parser.parse_args()
    robot = RobotParameters()
    with tempfile.TemporaryDirectory() as folder:
        path = options.map
        if path is None:
            path = Path(folder) / "warehouse.yaml"
            write_map(OccupancyMap(warehouse(np.random.default_rng(0)), 0.05, (0.0, 0.0, 0.0)), path)
        make_world(RosMap(file=str(path)), 0, robot.radius)  # compiles
        begin = time.perf_counter()
        worlds = [make_world(RosMap(file=str(path)), seed, robot.radius) for seed in range(options.pairs)]
        read = (time.perf_counter() - begin) / options.pairs
    find_shortest_path(worlds[0], robot.radius)  # compiles
    report("boxes", f"{len(worlds[0].polygons)}")
    report("read the map, draw start and goal", f"{read:.2f} s")
    for world in worlds:
        begin = time.perf_counter()
        found = find_shortest_path(world, robot.radius)
        took = time.perf_counter() - begin
        report("shortest path", f"{took:.2f} s for {found[0]:.1f} m" if found else "none")
    begin = time.perf_counter()
    station = NavigationStation(worlds[0], Scenario("map", None, robot))
    simulator = Simulator(station)
    report("build the station", f"{time.perf_counter() - begin:.2f} s")
    station.GetInputPort("drive.twist_command").FixValue(simulator.get_mutable_context(), [0.0, 0.0])
    simulator.Initialize()
    now = simulator.get_context().get_time()
    begin = time.perf_counter()
    simulator.AdvanceTo(now + 5.0)
    report("a simulated second at rest, with scans", f"{1e3 * (time.perf_counter() - begin) / 5.0:.0f} ms")
    places = np.random.default_rng(0).uniform(worlds[0].extent[:2], worlds[0].extent[2:], (20_000, 2))
    compute_clearance(worlds[0], places[:10])
    begin = time.perf_counter()
    compute_clearance(worlds[0], places)
    report("clearances of 20,000 places", f"{time.perf_counter() - begin:.2f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
