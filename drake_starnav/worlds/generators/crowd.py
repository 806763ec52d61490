"""Rooms and halls in which discs move and never yield: they wander, or stand for a while and walk."""

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.footprint import Footprint
from drake_starnav.parameters import parameter
from drake_starnav.worlds.clearance import compute_clearance
from drake_starnav.worlds.moving_obstacles import MovingObstacles, compute_moving_obstacle_clearance, there_and_back
from drake_starnav.worlds.outlines import make_rectangle, place
from drake_starnav.worlds.solvable import Drawn, draw_random_yaw
from drake_starnav.worlds.world import World

_HEIGHT = 12.0  # m, extent along y
_HEAD_START = 1.8  # m, least distance of a moving obstacle from the robot at the start
_LONGEST_WAIT, _SAMPLING = 10.0, 0.1  # s, for which a moving obstacle may occupy the goal, and of the check for that
_TRIES = 1000  # paths drawn for one moving obstacle, or places, and headings for one walk
_DURATION = 90.0  # s, until the moving obstacles return the way they came, and the trial ends
_SPACING = 0.01  # m, between the places of a leg that are checked
_ROOM = np.array((10.0, 6.0))  # m, of StopAndGo, from start to goal along x, and along y
_INSET = 0.8  # m, of its start and goal from the walls at both ends


@dataclass(frozen=True)
class Crowd(Drawn):
    """A room with columns and walls, crossed from left to right among discs that move and never yield."""

    width: float = parameter(12.0, "extent along x, from start to goal", unit="m", low=8.0, high=100.0)
    moving_obstacles: tuple[int, int] = parameter((10, 20), "fewest and most discs that move", low=0, high=1000)
    speed: tuple[float, float] = parameter(
        (0.3, 0.8), "of the slowest and the fastest; each disc keeps its speed", unit="m/s", low=0.01, high=5.0
    )

    def make(self, rng: np.random.Generator, robot: Footprint) -> World:
        """A room that the robot could cross if nothing moved, and its moving obstacles.

        Half of them go straight until an obstacle blocks them, the others wander. None touches a static obstacle, is
        near the robot at the start, or stays on the goal for long; they pass through each other.
        """
        world = super().make(rng, robot)
        count = int(rng.integers(*self.moving_obstacles, endpoint=True))
        radii = rng.uniform(0.2, 0.3, count)
        paths = tuple(self._draw_path(world, radius, robot.radius, rng) for radius in radii)
        return dataclasses.replace(world, moving_obstacles=MovingObstacles(radii, paths))

    def draw(self, rng: np.random.Generator) -> World:
        column_count = rng.integers(3, 6, endpoint=True)
        column_places = rng.uniform((2.0, 1.0), (self.width - 2.0, _HEIGHT - 1.0), (column_count, 2))
        walls = []
        for _ in range(rng.integers(1, 3, endpoint=True)):
            wall_middle = rng.uniform((3.0, 2.0), (self.width - 3.0, _HEIGHT - 2.0))
            half, thick = 0.5 * rng.uniform(1.5, 3.0), 0.06
            walls.append(place(make_rectangle(-half, -thick, half, thick), wall_middle, rng.uniform(0.0, math.pi)))
        start_y, goal_y = rng.uniform(0.8, _HEIGHT - 0.8, 2)
        return World(
            name="crowd",
            start=(rng.uniform(0.6, 1.4), start_y, draw_random_yaw(rng)),
            goal=(self.width - rng.uniform(0.6, 1.4), goal_y),
            cylinders=np.column_stack((column_places, rng.uniform(0.15, 0.4, len(column_places)))),
            polygons=tuple(walls),
            bounds=(0.0, 0.0, self.width, _HEIGHT),
            timeout=_DURATION,
        )

    def _draw_path(self, world: World, radius: float, robot_radius: float, rng: np.random.Generator) -> np.ndarray:
        speed, winding = rng.uniform(*self.speed), rng.random() < 0.5
        for _ in range(_TRIES):
            position = rng.uniform(radius, (self.width - radius, _HEIGHT - radius))
            free_distance = compute_clearance(world, position[None])[0] - radius
            if free_distance < 0.05 or math.dist(position, world.start[:2]) < _HEAD_START:
                continue
            path = draw_wandering_path(world, position, radius, speed, winding, rng)
            if path is not None and _find_longest_stay(path, radius + robot_radius, world.goal) <= _LONGEST_WAIT:
                return path
        raise StarnavError(
            f"Crowd: none of {_TRIES} paths for a disc of radius {radius:.2f} m was free; allowed: a larger room"
        )


def _find_longest_stay(path: np.ndarray, distance: float, place: tuple[float, float]) -> float:
    """Longest time for which a moving obstacle is continuously nearer to a place than a distance (m), s."""
    times = np.arange(0.0, 2.0 * path[-1, 0], _SAMPLING)  # two periods, as it may stay where its path closes
    obstacle, poses = MovingObstacles(np.array([distance]), (path,)), np.tile((*place, 0.0), (len(times), 1))
    is_near = compute_moving_obstacle_clearance(obstacle, poses, times) < 0.0
    changes = np.flatnonzero(np.diff(np.concatenate(([False], is_near, [False]))))
    return float(np.diff(changes)[::2].max(initial=0)) * _SAMPLING


def draw_wandering_path(
    world: World, position: np.ndarray, radius: float, speed: float, winding: bool, rng: np.random.Generator
) -> np.ndarray | None:
    """A closed path, there and back, on which a disc touches no static obstacle; None if it was caught in a corner.

    It begins at a free position (2,), W, m, at a speed in m/s. Unless it is winding, it is straight between the turns
    at obstacles. Its way points, shape (k, 3), are as in `MovingObstacles`.
    """
    least = radius + 0.5 * _SPACING  # at the checked places, so that none between them is nearer than the radius
    heading, time, turn_rate, next_turn = rng.uniform(-math.pi, math.pi), 0.0, 0.0, 0.0
    way_points = [(time, *position)]
    while time < _DURATION:
        if winding and time >= next_turn:
            turn_rate, next_turn = rng.uniform(-0.6, 0.6), time + rng.uniform(1.0, 3.0)
        leg_duration = 0.2 if winding else 2.0  # s: collision checks and changes of heading are per leg
        heading += turn_rate * leg_duration
        step_count = _count_free_steps(world, position, heading, least, math.ceil(speed * leg_duration / _SPACING))
        if step_count > 0:
            position = position + step_count * _SPACING * _make_direction(heading)
            time += step_count * _SPACING / speed
            way_points.append((time, *position))
        if step_count * _SPACING < speed * leg_duration:
            new_heading = _draw_free_heading(world, position, heading, least, rng)
            if new_heading is None:
                return None
            heading = new_heading
    return there_and_back(np.array(way_points))


def _make_direction(heading: float) -> np.ndarray:
    return np.array([math.cos(heading), math.sin(heading)])


def _count_free_steps(world: World, position: np.ndarray, heading: float, least: float, steps: int) -> int:
    """How many of the steps in a direction keep the least clearance."""
    places = position + _SPACING * np.arange(1, steps + 1)[:, None] * _make_direction(heading)
    blocked_steps = np.flatnonzero(compute_clearance(world, places) < least)
    return int(blocked_steps[0]) if len(blocked_steps) else steps


def _draw_free_heading(
    world: World, position: np.ndarray, heading: float, least: float, rng: np.random.Generator
) -> float | None:
    """A free heading: roughly mirrored at the nearest obstacle, else any; None if none was found."""
    offsets = 1e-4 * np.array([(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)])
    right_gap, left_gap, upper_gap, lower_gap = compute_clearance(world, position + offsets)
    surface_normal = math.atan2(upper_gap - lower_gap, right_gap - left_gap)
    mirrored_heading = 2.0 * surface_normal + math.pi - heading + rng.uniform(-0.15, 0.15)
    for candidate in (mirrored_heading, *rng.uniform(-math.pi, math.pi, 50)):
        if _count_free_steps(world, position, candidate, least, 1):
            return float(candidate)
    return None


@dataclass(frozen=True)
class StopAndGo:
    """A room crossed from left to right among discs that stand, then start at full speed and never yield."""

    moving_obstacles: int = parameter(8, "discs that move", low=0, high=1000)
    speed: tuple[float, float] = parameter(
        (0.5, 1.5), "of the slowest and the fastest; each disc walks at its speed", unit="m/s", low=0.01, high=5.0
    )

    def make(self, rng: np.random.Generator, robot: Footprint) -> World:
        """A bare room and its moving obstacles; they stand at first, avoid its walls, and pass through each other."""
        if robot.radius >= _INSET:
            raise StarnavError(
                f"StopAndGo: robot.radius {robot.radius:g} m does not fit at the start; allowed: below {_INSET:g} m"
            )
        start = np.array((_INSET, 0.5 * _ROOM[1]))
        radii = rng.uniform(0.15, 0.3, self.moving_obstacles)
        moving_obstacles = MovingObstacles(radii, tuple(self._draw_path(start, radius, rng) for radius in radii))
        return World(
            name="stop_and_go",
            start=(*start, draw_random_yaw(rng)),
            goal=(_ROOM[0] - _INSET, 0.5 * _ROOM[1]),
            bounds=(0.0, 0.0, *_ROOM),
            timeout=90.0,
            moving_obstacles=moving_obstacles,
        )

    def _draw_path(self, start: np.ndarray, radius: float, rng: np.random.Generator) -> np.ndarray:
        lower_limits = np.full(2, radius + 0.1)  # m, between a moving obstacle and the walls
        upper_limits = _ROOM - radius - 0.1
        for _ in range(_TRIES):
            place = rng.uniform(lower_limits, upper_limits)
            if math.dist(place, start) >= _HEAD_START:
                break
        speed, time = rng.uniform(*self.speed), 0.0
        way_points = [(time, *place)]
        while time < 60.0:  # s, until it returns along the same path
            time += rng.uniform(0.5, 6.0)
            way_points.append((time, *place))
            place, duration = _draw_walk(place, speed, lower_limits, upper_limits, rng)
            time += duration
            way_points.append((time, *place))
        return there_and_back(np.array(way_points))


def _draw_walk(
    place: np.ndarray, speed: float, low: np.ndarray, high: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, float]:
    """End of a straight walk from a place inside the limits, and its duration, s."""
    for _ in range(_TRIES):
        heading, duration = rng.uniform(-math.pi, math.pi), rng.uniform(0.5, 2.0)
        end = place + speed * duration * np.array((math.cos(heading), math.sin(heading)))
        if ((low <= end) & (end <= high)).all():
            return end, duration
    raise StarnavError(f"StopAndGo: none of {_TRIES} walks at {speed:g} m/s stays in the room; allowed: slower discs")
