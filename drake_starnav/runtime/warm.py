"""Everything is compiled and loaded before the robot moves: a short drive among made-up obstacles."""

import dataclasses
import math
import sys
from typing import TYPE_CHECKING

import numpy as np
from numba.core.dispatcher import Dispatcher

from drake_starnav.geometry.se2 import compose_poses
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.mounts import Mount
from drake_starnav.lidar.raycast import Fan, Shapes, cast_groups, make_circle_rows, make_segment_rows
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.planning.roadmap import StarRoadmap, add_node, replace_regions
from drake_starnav.robot.motion import Actuation, Pose, advance_pose, convert_to_velocity, roll_out
from drake_starnav.runtime.execution import CommandedVelocity
from drake_starnav.runtime.intake import Odometry
from drake_starnav.scenario.margins import derive_margins
from drake_starnav.surroundings.observation import Observation
from drake_starnav.surroundings.scan_averaging import average_scans
from drake_starnav.surroundings.star_region import clear_region, make_scan_region
from drake_starnav.systems.twist_shield import Unshielded

if TYPE_CHECKING:
    from drake_starnav.runtime.navigator import Navigator

POSTS = np.array(
    [(2.0, 0.9, 0.3), (2.2, -1.2, 0.3), (3.0, 2.6, 0.4), (-1.5, 1.0, 0.3), (5.0, -2.6, 0.3), (7.5, 1.5, 0.4)]
)
WALLS = np.array(
    [
        (4.0, -1.4, 6.0, -1.4),
        (6.0, -1.4, 6.0, 1.4),
        (6.0, 1.4, 4.0, 1.4),
        (-3.0, -5.0, 11.0, -5.0),
        (11.0, -5.0, 11.0, 5.0),
    ]
)
"""Discs (x, y, radius) and walls (x1, y1, x2, y2), in widths of twice a robot: posts, a dead end, a corner."""
GOALS = (8.0, 0.0), (0.0, 0.0, 1.0), (6.5, 0.0), (14.0, 8.0)
"""Behind the dead end, back with a heading, in a wall, and outside."""
STEPS, LOSS_PERIOD, FAST = 400, 7, 1e3
"""Steps to each goal; one scan in LOSS_PERIOD loses beams; more than any limit, m/s and rad/s."""


def warm_up(navigator: "Navigator") -> None:
    """Let a navigator drive a robot that does exactly what it is told; then it is to be reset."""
    actuation, unit = navigator.actuation, 4.0 * navigator.scenario.robot.radius
    pose, twist, scan_count = np.zeros(3), np.zeros(len(actuation.base.components)), 0
    for k in range(len(GOALS) * STEPS):
        time = (k + 1) * actuation.hold
        x_goal, y_goal, *heading = GOALS[k // STEPS]
        scans: list[tuple[int, LaserScan]] = []
        while scan_count / navigator.scenario.lidar.rate <= time:
            scans += enumerate(_make_scans(navigator, pose, time, scan_count % LOSS_PERIOD == LOSS_PERIOD - 1))
            scan_count += 1
        row = _make_odometry(time, pose, twist, actuation)
        command = navigator.step(time, scans, [row], (unit * x_goal, unit * y_goal, *heading))
        if scans:
            _ask_of_fast_motions(navigator, pose)
        pose, twist = _drive_as_told(pose, twist, command.twist, actuation), command.twist
    observation = Observation(None, _make_scans(navigator, pose, time, False)[0], pose)
    average_scans((observation, observation), math.inf)  # asked only where hits seem to close the way
    _revise_roadmap(navigator, observation)
    load_uncalled()


def _make_odometry(time: float, pose: np.ndarray, twist: np.ndarray, actuation: Actuation) -> Odometry:
    """The odometry of a robot that moves at a twist."""
    (x, y, yaw), velocity = pose.tolist(), CommandedVelocity.of(time, twist, actuation.limits)
    return Odometry(time, x, y, yaw, velocity.v_x, velocity.turning, velocity.v_y)


def _drive_as_told(pose: np.ndarray, twist: np.ndarray, next_twist: np.ndarray, actuation: Actuation) -> np.ndarray:
    """The pose after a period, in which the twist becomes the next one."""
    velocity, next_velocity = convert_to_velocity(twist), convert_to_velocity(next_twist)
    next_pose, _ = advance_pose(Pose(*pose), velocity, next_velocity, actuation.hold, actuation.limits)
    return np.array(next_pose)


def _ask_of_fast_motions(navigator: "Navigator", pose: np.ndarray) -> None:
    """Ask the certificates about motions that no star covers: what decides then may not be asked for a long time."""
    shield = navigator.navigation.shield
    if not isinstance(shield, Unshielded):
        return
    answer = shield.certificates(shield.GetMyContextFromRoot(navigator.context), pose[:2])
    if answer is not None:
        certificates, act = answer
        fast = act.base.saturate(np.full(len(act.base.components), FAST), act.limits)
        for twist in (fast, -fast):
            motion = roll_out(pose, twist, twist, act)
            for each in certificates:
                each.accepts(motion)


def _revise_roadmap(navigator: "Navigator", observation: Observation) -> None:
    """Drop one region of a roadmap and cut back another, as where scans contradict them: few drives do."""
    radius, planner = navigator.scenario.robot.radius, navigator.scenario.planner
    margins = derive_margins(navigator.scenario, navigator.mounts)
    region = make_scan_region(observation.scan, observation.pose, radius, margins)
    node, roadmap = dataclasses.replace(observation, region=region), StarRoadmap.empty(planner, radius)
    for _ in range(2):
        roadmap = add_node(roadmap, node, margins, radius)
    replace_regions(roadmap, [None, clear_region(region, region.outline()[:1], radius)], margins, radius)


def load_uncalled() -> None:
    """Load from Numba's cache, with the signatures there, what of the package's functions was not called."""
    modules = [module for name, module in list(sys.modules.items()) if name.startswith("drake_starnav.")]
    for function in {value for module in modules for value in vars(module).values() if isinstance(value, Dispatcher)}:
        file = None if function.overloads else getattr(function._cache, "_cache_file", None)
        for signature, *_ in {} if file is None else file._load_index():
            function.compile(signature)


def _make_scans(navigator: "Navigator", pose: np.ndarray, time: float, loses_beams: bool) -> list[LaserScan]:
    """What the lidars of a robot see of posts, walls and, where obstacles may move, of a disc that comes towards it."""
    unit, speed = 4.0 * navigator.scenario.robot.radius, navigator.scenario.obstacles.max_speed
    discs = unit * POSTS
    if speed > 0.0:
        discs = np.vstack((discs, (unit * 3.5 - speed * time, -unit, 0.2)))
    rows = np.vstack((make_circle_rows(discs), make_segment_rows(unit * WALLS)))
    lidars = zip(navigator.scenario.all_lidars, navigator.mounts, strict=True)
    return [_make_scan(rows, pose, lidar, mount, time, loses_beams) for lidar, mount in lidars]


def _make_scan(
    rows: np.ndarray, pose: np.ndarray, lidar: LidarParameters, mount: Mount, time: float, loses_beams: bool
) -> LaserScan:
    """What a lidar sees of shapes, with a little noise."""
    view = mount.view(lidar.field_of_view)
    ranges = np.full(view.beams, math.inf)
    place = compose_poses(pose, (mount.x, mount.y, 0.0))
    cast_groups(tuple(Shapes.of([rows])), np.array([place]), tuple(Fan.regular(*view)), ranges, lidar.range_max)
    ranges += 0.001 * np.sin(np.arange(view.beams) * (1.0 + time))
    ranges[(ranges >= lidar.range_max)] = math.inf
    ranges[ranges < lidar.range_min] = -math.inf
    ranges = ranges[::-1] if mount.upside_down else ranges
    if loses_beams:
        ranges[::9] = math.nan
    return LaserScan(time, ranges=ranges, **lidar.scan_fields)
