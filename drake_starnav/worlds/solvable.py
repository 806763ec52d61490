"""Worlds that the robot can solve: drawn until it can, or checked."""

import dataclasses
import math
from collections.abc import Iterable, Sequence

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.footprint import Footprint, as_footprint
from drake_starnav.geometry.se2 import place_points
from drake_starnav.worlds.clearance import compute_body_clearance, find_nearest_obstacle
from drake_starnav.worlds.passable import has_passage
from drake_starnav.worlds.shortest_path import find_shortest_path
from drake_starnav.worlds.world import World

SPARE = 0.05  # m, every generated world is solvable by a robot this much larger
HEADINGS = 72
"""Headings that are tried at a place without one, for a robot that is no disc."""
LEAST_DISC = 0.001
"""Radius of the disc that a footprint beside its origin holds there, m."""
_TRIES = 500


class Drawn:
    """A world that is drawn at random until the robot can solve it; a subclass holds its sizes and draws one."""

    def draw(self, rng: np.random.Generator) -> World:
        """Any world."""
        raise NotImplementedError

    def make(self, rng: np.random.Generator, robot: Footprint) -> World:
        """The first world drawn whose goal the robot can reach with `SPARE` to all sides.

        Of a robot that is no disc the first where the disc around it can; if there is none, where it can itself.

        Raises:
            StarnavError: no solvable world was found.
        """
        for body in (as_footprint(robot.radius),) if robot.is_disc else (as_footprint(robot.radius), robot):
            for _ in range(_TRIES):
                world = self.draw(rng)
                if is_solvable(world, body, SPARE):
                    return world
        raise StarnavError(
            f"{type(self).__name__}: none of {_TRIES} worlds was solvable for {describe_size(robot)}; "
            "allowed: a robot that fits through the passages (take a smaller robot, fewer obstacles or wider passages)"
        )


def draw_random_yaw(rng: np.random.Generator) -> float:
    """Any heading, rad, in [-pi, pi)."""
    return float(rng.uniform(-math.pi, math.pi))


def describe_size(robot: Footprint) -> str:
    """A robot's size, for messages."""
    return f"robot.radius {robot.radius:g} m" if robot.is_disc else f"a footprint that reaches {robot.radius:g} m"


def make_poses(place: Sequence[float], robot: Footprint) -> np.ndarray:
    """The poses of a robot at a place (x, y) or (x, y, yaw): all headings that are tried, or the one, shape (n, 3)."""
    yaws = place[2:] or ([0.0] if robot.is_disc else np.linspace(-math.pi, math.pi, HEADINGS, endpoint=False))
    return np.column_stack((np.tile(place[:2], (len(yaws), 1)), yaws))


def is_free(world: World, place: Sequence[float], robot: Footprint, spare: float = 0.0) -> bool:
    """Whether a robot at a place (x, y), at any heading, or (x, y, yaw) is farther than `spare`, m, from obstacles."""
    return bool((compute_body_clearance(world, make_poses(tuple(place), robot), robot) > spare).any())


def find_way_through(
    world: World, robot: Footprint, spare: float = 0.0, resolution: float = 0.05, yaw: float | None = None
) -> tuple[float, np.ndarray] | None:
    """The shortest way from the start to the goal of a world, as `shortest_path`, with `spare` to all sides, m.

    It is that of the disc around a robot. Where that disc has none, and the robot is none, it is that of the largest
    disc about its origin inside its footprint, if the robot itself has a way: it has none that is shorter. `yaw`: its
    heading at the goal then, rad, if it shall have one.
    """
    found_path = find_shortest_path(world, robot.radius + spare, resolution)
    if found_path is not None or robot.is_disc:
        return found_path
    found_path = find_shortest_path(world, max(robot.inscribed, LEAST_DISC) + spare, resolution)
    return found_path if found_path is not None and has_passage(world, robot, spare, yaw) else None


def is_solvable(world: World, robot: Footprint, spare: float) -> bool:
    """Whether a robot has a way from the start to the goal of a world with `spare` to all sides, m."""
    has_free_ends = all(is_free(world, end, robot, spare) for end in (world.start, world.goal))
    return has_free_ends and find_way_through(world, robot, spare) is not None


def check_ends(world: World, robot: Footprint | float, place: str, goals: Sequence[Sequence[float]] = ()) -> None:
    """Raise `StarnavError` if the robot touches an obstacle at the start or at a goal of the world, which `place` has.

    `goals`, (x, y) or (x, y, yaw), are in the place of the world's.
    """
    check_free(world, world.start, robot, f"{place}.start")
    for name, goal in _name_goal(world, place, goals):
        check_free(world, goal, robot, name)


def check_free(world: World, place: Sequence[float], robot: Footprint | float, name: str) -> None:
    """Raise `StarnavError` if the robot touches an obstacle at a place (x, y), whatever its heading, or (x, y, yaw)."""
    robot, place = as_footprint(robot), tuple(place[:2] if as_footprint(robot).is_disc else place)
    if is_free(world, place, robot):
        return
    tried_poses = make_poses(place, robot)
    best_pose = tried_poses[[compute_body_clearance(world, tried_poses, robot).argmax()]]
    if robot.is_disc:
        obstacle, distance = find_nearest_obstacle(world, (place[0], place[1]))
        distance_text = f"{distance:g} m from" if distance > 0.0 else "outside of" if obstacle == "bounds" else "inside"
        raise StarnavError(
            f"{name} is [{place[0]:g}, {place[1]:g}], {distance_text} {obstacle}; "
            f"allowed: more than robot.radius {robot.radius:g} m from every obstacle"
        )
    nearest_obstacles = [find_nearest_obstacle(world, (x, y)) for x, y in place_points(best_pose, robot.cover).tolist()]
    obstacle = min(nearest_obstacles, key=lambda each: each[1])[0]
    raise StarnavError(
        f"{name} is [{', '.join(f'{value:g}' for value in place)}], where the robot touches {obstacle}"
        f"{'' if len(place) == 3 else ' at every heading'}; allowed: where its footprint is free of obstacles"
    )


def check_reachable(world: World, robot: Footprint | float, place: str, goals: Sequence[Sequence[float]] = ()) -> None:
    """Raise `StarnavError` if there is no way for the robot; arguments as in `check_ends`."""
    robot, begin = as_footprint(robot), list(world.start)
    for name, goal in _name_goal(world, place, goals):
        if find_leg(world, robot, begin, goal) is None:
            raise StarnavError(
                f"{name} [{goal[0]:g}, {goal[1]:g}] is out of reach from the start [{begin[0]:g}, {begin[1]:g}] for "
                f"{describe_size(robot)}; allowed: a goal to which the robot has a way"
            )
        begin = list(goal)


def find_leg(
    world: World, robot: Footprint, begin: Sequence[float], end: Sequence[float], spare: float = 0.0, step: float = 0.05
) -> tuple[float, np.ndarray] | None:
    """The way of `find_way_through` between two places (x, y) or (x, y, yaw) of a world; None if one is not free."""
    begin_poses = make_poses(tuple(begin), robot)
    free_poses = begin_poses[compute_body_clearance(world, begin_poses, robot) > 0.0]
    if not len(free_poses) or not is_free(world, end, robot):
        return None
    leg_world = dataclasses.replace(world, start=tuple(free_poses[0]), goal=(end[0], end[1]))
    return find_way_through(leg_world, robot, spare, step, *end[2:])


def _name_goal(world: World, place: str, goals: Sequence[Sequence[float]]) -> Iterable[tuple[str, Sequence[float]]]:
    return [(f"goals[{k}]", goal) for k, goal in enumerate(goals)] or [(f"{place}.goal", world.goal)]
