"""CPU time per simulated second beside MuJoCo and ir-sim, in the same worlds and driven by the same twists.

Run in the checkout: python -m benchmarks.simulators [--seconds 10] [--rounds 2] [--scenario forest maze room]

A simulator that is not installed is skipped (`pip install mujoco ir-sim`). All advance in turn by half a second in
one process, so that all see the same load of the machine. The whole of this package navigates; the others repeat the
twists that it commanded, and measure scans of as many beams at the lidar's rate.
"""

import argparse
import contextlib
import importlib
import io
import os
import random
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import yaml
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput, TrajectorySource, VectorLogSink
from pydrake.trajectories import PiecewisePolynomial

from drake_starnav.navigation import Parts, add_navigation
from drake_starnav.scenario.scenario_file import load_scenario
from drake_starnav.scenario.schema import Scenario
from drake_starnav.station.navigation_station import add_station
from drake_starnav.station.plant import make_simulator
from drake_starnav.station.world_geometry import OBSTACLE_HEIGHT
from drake_starnav.worlds import World, make_world
from drake_starnav.worlds.convex_parts import split_into_convex_parts

SEED = 1000
CHUNK = 0.5
"""Simulated time between two turns, s."""
COMMAND_PERIOD, MUJOCO_STEP, IRSIM_STEP = 0.02, 0.005, 0.05
"""s; ir-sim scans at each step."""
WALL = 0.1
"""Thickness of the walls along a world's bounds, m."""


class Advancing(Protocol):
    """A simulator in the midst of a run."""

    def AdvanceTo(self, time: float) -> Any:
        """Simulate until then, s."""


class Twists:
    """What was commanded, as a function of time."""

    def __init__(self, times: np.ndarray, values: np.ndarray) -> None:
        self.times, self.values = times, values

    def at(self, time: float) -> np.ndarray:
        """(v, omega), m/s and rad/s."""
        return self.values[:, max(int(np.searchsorted(self.times, time + 1e-9, side="right")) - 1, 0)]


def polygons(world: World) -> list[np.ndarray]:
    """Convex outlines of all but the round obstacles, the walls among them."""
    found = [part for polygon in world.polygons for part in split_into_convex_parts(polygon)]
    if world.bounds is not None:
        x0, y0, x1, y1 = world.bounds
        for a, b, c, d in (
            (x0 - WALL, y0, x0, y1),
            (x1, y0, x1 + WALL, y1),
            (x0, y0 - WALL, x1, y0),
            (x0, y1, x1, y1 + WALL),
        ):
            found.append(np.array(((a, b), (c, b), (c, d), (a, d))))
    return found


def whole(scenario: Scenario, world: World) -> tuple[Simulator, VectorLogSink]:
    """The autonomy in its world, and a log of what it commands."""
    builder = DiagramBuilder()
    station = add_station(builder, world, scenario, continuous=True, seed=SEED)
    navigation = add_navigation(builder, scenario, Parts(world, station), SEED)
    log = LogVectorOutput(navigation.shield.GetOutputPort("twist_command"), builder, COMMAND_PERIOD)
    simulator = make_simulator(builder.Build())
    return simulator, log


def station_alone(scenario: Scenario, world: World, twists: Twists) -> Simulator:
    """Plant, lidar and localization, driven by twists."""
    builder = DiagramBuilder()
    station = add_station(builder, world, scenario, continuous=True, seed=SEED)
    command = builder.AddSystem(TrajectorySource(PiecewisePolynomial.ZeroOrderHold(twists.times, twists.values)))
    builder.Connect(command.get_output_port(), station.GetInputPort("drive.twist_command"))
    return make_simulator(builder.Build())


def mjcf(scenario: Scenario, world: World) -> str:
    """The shipped robot in a world, as a model of MuJoCo.

    The motors' rotors have an inertia. MuJoCo solves contacts without the damping by which it then integrates, a
    servo's gain times the step; where the wheels' inertia is far below that, they slide, and the robot swerves.
    """
    x, y, yaw = world.start
    height, assets, geoms = 0.5 * OBSTACLE_HEIGHT, [], []
    for cx, cy, radius in world.cylinders:
        geoms.append(f'<geom type="cylinder" size="{radius} {height}" pos="{cx} {cy} {height}"/>')
    for sx, sy, radius in world.spheres:
        geoms.append(f'<geom type="sphere" size="{radius}" pos="{sx} {sy} {radius}"/>')
    for k, corners in enumerate(polygons(world)):
        along, across = corners[1] - corners[0], corners[-1] - corners[0]
        if len(corners) == 4 and abs(along @ across) < 1e-9 and np.allclose(corners[2], corners[1] + across):
            (a, b), (cx, cy) = 0.5 * np.hypot(*np.array((along, across)).T), corners.mean(axis=0)
            turn = np.degrees(np.arctan2(along[1], along[0]))
            geoms.append(f'<geom type="box" size="{a} {b} {height}" pos="{cx} {cy} {height}" euler="0 0 {turn}"/>')
            continue
        vertices = " ".join(f"{px} {py} {z}" for z in (0.0, OBSTACLE_HEIGHT) for px, py in corners)
        assets.append(f'<mesh name="m{k}" vertex="{vertices}"/>')
        geoms.append(f'<geom type="mesh" mesh="m{k}"/>')
    wheel = '<inertial pos="0 0 0" mass="0.5" diaginertia="3.5e-4 6.25e-4 3.5e-4"/>'
    wheel += '<geom type="sphere" size="0.05" group="1"/>'
    rotor, motor = 'armature="0.005"', 'kv="2" forcerange="-2 2"'
    caster = 'size="0.02" condim="1" priority="1" group="1"'
    return f"""<mujoco><option timestep="{MUJOCO_STEP}" integrator="implicitfast"/><asset>{"".join(assets)}</asset>
<worldbody><geom type="plane" size="50 50 1"/>{"".join(geoms)}
<body name="base" pos="{x} {y} 0.05" euler="0 0 {np.degrees(yaw)}"><freejoint/>
<inertial pos="0 0 0" mass="8.2" diaginertia="0.135 0.135 0.256"/>
<geom type="cylinder" size="{scenario.robot.radius} 0.05" pos="0 0 0.03" group="1"/>
<geom type="sphere" pos="0.15 0 -0.02995" {caster}/><geom type="sphere" pos="-0.15 0 -0.02995" {caster}/>
<site name="lidar" pos="0 0 0.08"/>
<body pos="0 0.16 0"><joint name="l" axis="0 1 0" {rotor}/>{wheel}</body>
<body pos="0 -0.16 0"><joint name="r" axis="0 1 0" {rotor}/>{wheel}</body></body></worldbody>
<actuator><velocity joint="l" {motor}/><velocity joint="r" {motor}/></actuator>
</mujoco>"""


class Mujoco:
    """The shipped robot in MuJoCo, with a lidar by `mj_multiRay` if it has scans."""

    def __init__(self, scenario: Scenario, world: World, twists: Twists, scans: bool) -> None:
        self._mujoco = importlib.import_module("mujoco")
        self._model = self._mujoco.MjModel.from_xml_string(mjcf(scenario, world))
        self._data = self._mujoco.MjData(self._model)
        self._lidar, self._twists, self._steps = scenario.lidar, twists, 0
        lidar = scenario.lidar
        angles = lidar.angle_min + lidar.angle_increment * np.arange(lidar.beams)
        self._rays = np.column_stack((np.cos(angles), np.sin(angles), np.zeros(lidar.beams)))
        self._scans_due = 0 if scans else None
        self._ids, self._ranges = np.zeros(lidar.beams, np.int32), np.zeros(lidar.beams)
        self._group, self._noise = np.array((1, 0, 0, 0, 0, 0), np.uint8), np.random.default_rng(0)
        self._mujoco.mj_forward(self._model, self._data)

    def AdvanceTo(self, time: float) -> None:
        """Simulate until then, s."""
        held = round(COMMAND_PERIOD / MUJOCO_STEP)
        while self._steps * MUJOCO_STEP < time - 1e-9:
            now = self._steps * MUJOCO_STEP
            v, omega = self._twists.at(now)
            self._data.ctrl[:] = (v - 0.16 * omega) / 0.05, (v + 0.16 * omega) / 0.05
            if self._scans_due is not None and now * self._lidar.rate >= self._scans_due - 1e-9:
                self._scan()
                self._scans_due += 1
            self._mujoco.mj_step(self._model, self._data, held)
            self._steps += held

    def _scan(self) -> np.ndarray:
        rays = (self._rays @ self._data.site_xmat[0].reshape(3, 3).T).ravel()
        count, reach = len(self._ids), self._lidar.range_max
        self._mujoco.mj_multiRay(
            self._model, self._data, self._data.site_xpos[0], rays, self._group, 1, 1, self._ids, self._ranges, None,
            count, reach,
        )  # fmt: skip
        noisy = self._ranges + self._lidar.noise * self._noise.standard_normal(count)
        return np.where(self._ranges < 0.0, np.inf, noisy)


def irsim_world(scenario: Scenario, world: World, step: float, noise: bool = True) -> Any:
    """A disc with a lidar in a world, as an environment of ir-sim, which goes on by a step, s, and then scans."""
    lidar = scenario.lidar
    circles = [(x, y, r) for x, y, r in (*world.cylinders.tolist(), *world.spheres.tolist())]
    outlines = [corners.tolist() for corners in polygons(world)]
    groups = (
        ([{"name": "circle", "radius": r} for _, _, r in circles], [[x, y, 0.0] for x, y, _ in circles]),
        ([{"name": "polygon", "vertices": o} for o in outlines], [[0.0, 0.0, 0.0]] * len(outlines)),
    )
    sensor = {
        "name": "lidar2d", "range_min": 0.0, "range_max": lidar.range_max, "number": lidar.beams, "noise": noise,
        "angle_range": 6.2831853, "std": lidar.noise, "angle_std": 0.0,
    }  # fmt: skip
    robot = {
        "kinematics": {"name": "diff"}, "shape": {"name": "circle", "radius": scenario.robot.radius},
        "state": list(world.start), "goal": [*world.goal, 0.0], "vel_max": [2, 6], "vel_min": [-2, -6],
        "sensors": [sensor],
    }  # fmt: skip
    obstacles = [
        {"number": len(shapes), "distribution": {"name": "manual"}, "shape": shapes, "state": states}
        for shapes, states in groups
        if shapes
    ]
    x0, y0, x1, y1 = world.extent
    settings = {
        "width": x1 - x0, "height": y1 - y0, "offset": [x0, y0], "step_time": step, "sample_time": step,
        "collision_mode": "unobstructed", "control_mode": "auto",
    }  # fmt: skip
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
        path = Path(folder) / "world.yaml"
        path.write_text(yaml.safe_dump({"world": settings, "robot": [robot], "obstacle": obstacles}))
        return importlib.import_module("irsim").make(str(path), display=False, disable_all_plot=True)


class Irsim:
    """A disc with a lidar in ir-sim."""

    def __init__(self, scenario: Scenario, world: World, twists: Twists) -> None:
        self._twists, self._steps = twists, 0
        self._env = irsim_world(scenario, world, IRSIM_STEP)

    def AdvanceTo(self, time: float) -> None:
        """Simulate until then, s."""
        while self._steps * IRSIM_STEP < time - 1e-9:
            self._env.step(self._twists.at(self._steps * IRSIM_STEP)[:, None])
            self._steps += 1


def installed(module: str) -> bool:
    """Whether a simulator can be imported; says so if it cannot."""
    try:
        importlib.import_module(module)
    except ImportError:
        print(f"{module} is not installed and is skipped")
        return False
    return True


def in_turn(makers: dict[str, Callable[[], Advancing]], seconds: float, rounds: int) -> dict[str, float]:
    """Milliseconds of CPU per simulated second of each simulator, the least of each chunk over the rounds."""
    count = round(seconds / CHUNK)
    spent = np.full((rounds, len(makers), count), np.nan)
    order = list(range(len(makers)))
    for k in range(rounds):
        running = [make() for make in makers.values()]
        for chunk in range(count):
            random.shuffle(order)
            for i in order:
                start = time.thread_time()
                running[i].AdvanceTo(CHUNK * (chunk + 1))
                spent[k, i, chunk] = time.thread_time() - start
    return dict(zip(makers, spent.min(axis=0).sum(axis=1) / (count * CHUNK) * 1e3, strict=True))


def main() -> None:
    """Measure; see `--help`."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=10.0, help="simulated time of a run (default: 10)")
    parser.add_argument("--rounds", type=int, default=2, help="runs of each (default: 2)")
    parser.add_argument("--scenario", nargs="+", default=["forest", "maze", "room"])
    options = parser.parse_args()
    os.environ.setdefault("MPLBACKEND", "Agg")
    others = [name for name in ("mujoco", "irsim") if installed(name)]
    for name in options.scenario:
        scenario = load_scenario(name)
        world = make_world(scenario.world, SEED, scenario.robot.radius)
        simulator, log = whole(scenario, world)
        simulator.AdvanceTo(options.seconds)
        record = log.FindLog(simulator.get_context())
        twists = Twists(record.sample_times().copy(), record.data().copy())
        makers: dict[str, Callable[[], Advancing]] = {
            "whole": lambda s=scenario, w=world: whole(s, w)[0],
            "station with lidar": lambda s=scenario, w=world, t=twists: station_alone(s, w, t),
        }
        if "mujoco" in others:
            makers["MuJoCo"] = lambda s=scenario, w=world, t=twists: Mujoco(s, w, t, scans=False)
            makers["MuJoCo, mj_multiRay"] = lambda s=scenario, w=world, t=twists: Mujoco(s, w, t, scans=True)
        if "irsim" in others:
            makers[f"ir-sim at {1.0 / IRSIM_STEP:g} Hz"] = lambda s=scenario, w=world, t=twists: Irsim(s, w, t)
        found = in_turn(makers, options.seconds, options.rounds)
        for label, ms in found.items():
            ratio = found["whole"] / ms
            print(f"{name:8s} {label:20s} {ms:7.2f} ms per simulated second; the whole takes {ratio:5.2f} times that")


if __name__ == "__main__":
    main()
