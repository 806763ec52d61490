"""A shipped scenario at another size: world, robot, lidar, speeds and tolerance are all scaled."""

import dataclasses

import numpy as np

from drake_starnav.control import ControllerInputs, follow_guidance
from drake_starnav.planning import PlannerInput, PlannerState, plan_step
from drake_starnav.safety.clear import ClearanceCertificate
from drake_starnav.safety.shield import shield_twist
from drake_starnav.scenario.scenario_file import load_scenario
from drake_starnav.scenario.schema import Scenario
from drake_starnav.simulation.run import run_trial
from drake_starnav.surroundings.margins import Margins
from drake_starnav.surroundings.perception import PerceptionSettings, PerceptionState, perceive
from drake_starnav.worlds.formats.obstacles import Obstacles
from drake_starnav.worlds.view import scan_from, visible_shapes
from tests.helpers.motions import actuation

LARGEST_AT_RATE = 6.0
"""Accelerations grow with size up to this scale: wheels slide from 6 m/s^2 on."""


def sized(name: str, scale: float, seed: int) -> Scenario:
    """The scenario of a name with the world of a seed, `scale` times as large.

    Times stay as they are, as far as wheels have the grip: beyond they become longer, so that rates fall.
    """
    slower = max(scale / LARGEST_AT_RATE, 1.0)
    base = load_scenario(name)
    world = base.world.make(np.random.default_rng(seed), base.robot.shape)
    robot, lidar = base.robot, base.lidar
    return dataclasses.replace(
        base,
        world=Obstacles(
            cylinders=(scale * np.reshape(world.cylinders, (-1, 3))).tolist(),
            polygons=[(scale * np.asarray(polygon)).tolist() for polygon in world.polygons],
            bounds=[] if world.bounds is None else (scale * np.asarray(world.bounds)).tolist(),
            start=[scale * world.start[0], scale * world.start[1], world.start[2]],
            goal=[scale * coordinate for coordinate in world.goal],
            timeout=300.0 * slower,
        ),
        robot=dataclasses.replace(
            robot,
            radius=scale * robot.radius,
            max_speed=scale * robot.max_speed / slower,
            max_acceleration=scale * robot.max_acceleration / slower**2,
            max_yaw_rate=robot.max_yaw_rate / slower,
            max_yaw_acceleration=robot.max_yaw_acceleration / slower**2,
        ),
        lidar=dataclasses.replace(
            lidar, range_min=scale * lidar.range_min, range_max=scale * lidar.range_max, noise=scale * lidar.noise
        ),
        simulation=dataclasses.replace(base.simulation, goal_tolerance=scale * base.simulation.goal_tolerance),
    )


def ratios(name: str, scale: float, seeds: range) -> tuple[float, float]:
    """Means over seeds of the time, in the time that full speed takes for a radius, and of path / shortest path.

    All must be reached.
    """
    driven = [run_trial(sized(name, scale, seed), seed=seed) for seed in seeds]
    assert [trial.outcome for trial in driven] == ["reached"] * len(driven)
    paths = [trial.path_length_m / trial.shortest_path_m for trial in driven if trial.shortest_path_m]
    robot = sized(name, scale, seeds[0]).robot
    times = [trial.time_s * robot.max_speed / robot.radius for trial in driven]
    return float(np.mean(times)), float(np.mean(paths))


def scaled_margins(margins: Margins, scale: float) -> Margins:
    """The margins of a robot whose base strays in proportion to its size."""
    lengths = ("thinnest", "safety", "preferred", "least", "safety_range", "smoothing_slack")
    return dataclasses.replace(margins, **{name: scale * getattr(margins, name) for name in lengths})


def driven_states(scenario: Scenario, margins: Margins, seed: int, commands: int) -> dict[str, np.ndarray]:
    """Poses (x, y, yaw), twists (v, omega), plans and star of a robot without dynamics, after some commands."""
    robot, lidar, rate = scenario.robot, scenario.lidar, scenario.controller.rate
    world = scenario.world.make(np.random.default_rng(seed), robot.shape)
    settings, commanding = PerceptionSettings(margins, robot.shape), actuation(robot, 1.0 / rate)
    shapes, goal, known = visible_shapes(world), np.array(world.goal), PerceptionState.initial()
    state = PlannerState.initial(scenario.planner, robot.radius)
    pose = np.array(world.start)
    twist = np.zeros(2)
    scans = 0
    poses, twists = [pose], [twist]
    for k in range(commands):
        if k / rate >= scans / lidar.rate - 1e-9:
            scan, scans = scan_from(shapes, pose, lidar, seed, scans), scans + 1
            known = perceive(known, (scan,), pose, settings)
            now = PlannerInput(known.observation, pose[:2], goal, k / rate, scenario.planner, margins, robot.radius)
            state = plan_step(state, now)
        inputs = ControllerInputs(pose, twist, state.guidance, known.surroundings)
        asked = (ClearanceCertificate(known.surroundings, margins.safety, commanding.footprint),)
        twist, _ = shield_twist(pose, twist, follow_guidance(inputs, robot).twist, asked, commanding)
        middle = pose[2] + 0.5 * twist[1] / rate
        pose = pose + np.array((twist[0] * np.cos(middle), twist[0] * np.sin(middle), twist[1])) / rate
        poses.append(pose)
        twists.append(twist)
    return {
        "poses": np.array(poses),
        "twists": np.array(twists),
        "nodes": state.roadmap.union.values,
        "path": state.route.path,
        "star": known.surroundings.certified_star.values,
    }
