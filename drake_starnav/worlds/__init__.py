"""Worlds to drive through: generators by name, their reference paths, and the obstacles as data."""

import dataclasses
import math
import zlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from drake_starnav.errors import StarnavError, shown
from drake_starnav.geometry.footprint import Footprint, as_footprint
from drake_starnav.parameters import check_parameters
from drake_starnav.worlds.clearance import compute_clearance
from drake_starnav.worlds.convex_parts import split_into_convex_parts
from drake_starnav.worlds.formats.obstacles import Model, Obstacles
from drake_starnav.worlds.formats.ros_map import RosMap
from drake_starnav.worlds.formats.world_file import Barn, DynaBarn
from drake_starnav.worlds.generators.channel import Channel, Corridor
from drake_starnav.worlds.generators.crowd import Crowd, StopAndGo
from drake_starnav.worlds.generators.forest import Forest
from drake_starnav.worlds.generators.maze import Maze
from drake_starnav.worlds.generators.paper import PaperForest, PaperMaze, PaperRoom
from drake_starnav.worlds.generators.rooms import Room, Rooms
from drake_starnav.worlds.moving_obstacles import MovingObstacles, moving_obstacle_states
from drake_starnav.worlds.shortest_path import find_shortest_path
from drake_starnav.worlds.solvable import check_ends, check_reachable
from drake_starnav.worlds.world import World

WORLD_KINDS: dict[str, type] = {
    kind.__name__: kind
    for kind in (
        Forest,
        Room,
        Maze,
        PaperForest,
        PaperMaze,
        PaperRoom,
        Corridor,
        Channel,
        Rooms,
        Obstacles,
        RosMap,
        Model,
        Barn,
        Crowd,
        StopAndGo,
        DynaBarn,
    )
}

GIVEN_GOAL_KINDS = (Obstacles, RosMap, Model)
"""Kinds whose goal is given."""

__all__ = [
    "WORLD_KINDS", "MovingObstacles", "World", "compute_clearance", "find_shortest_path", "make_world",
    "moving_obstacle_states", "split_into_convex_parts",
    *WORLD_KINDS,
]  # fmt: skip


def is_world_kind(kind: Any) -> bool:
    """Whether a class is a kind of worlds: a dataclass of parameters with a method `make`."""
    return isinstance(kind, type) and dataclasses.is_dataclass(kind) and callable(getattr(kind, "make", None))


def make_world(kind: Any, seed: int, robot: Footprint | float, goals: Sequence[Sequence[float]] = ()) -> World:
    """The world of one kind and seed, the same on every machine.

    Args:
        kind: an instance of one of `WORLD_KINDS`, or of one of your own: the generator with its sizes.
        seed: 0 or a positive whole number; different kinds with the same seed are unrelated.
        robot: the robot for which the world must be solvable: what it covers, or its radius, m.
        goals: (x, y) or (x, y, yaw), W, m and rad, which it visits instead of the world's, which is then the last.

    Raises:
        StarnavError: a parameter is out of its limits, no solvable world was found, or the robot touches an obstacle
            at the start or a goal, or has no way to it in a map.
    """
    if not is_world_kind(type(kind)):
        raise StarnavError(
            f"world is {'missing' if kind is None else shown(kind)}; allowed: an instance of {', '.join(WORLD_KINDS)}, "
            "or of a dataclass of your own with a method make"
        )
    given_seed: Any = seed  # whatever a caller passes
    if isinstance(given_seed, bool) or not isinstance(given_seed, int | np.integer) or given_seed < 0:
        raise StarnavError(f"seed is {shown(seed)}; allowed: a whole number 0 <= x")
    robot = as_footprint(robot)
    if not (math.isfinite(robot.radius) and robot.radius > 0.0):
        raise StarnavError(f"the robot's radius is {robot.radius} m; allowed: 0 < x m")
    if goals and isinstance(kind, GIVEN_GOAL_KINDS):
        kind = dataclasses.replace(kind, goal=[float(value) for value in goals[-1][:2]])
    check_parameters(kind, type(kind).__name__)
    # the checksum of the name numbers a kind for good, whatever kinds are added
    kind_number = zlib.crc32(type(kind).__name__.encode())
    world = kind.make(np.random.default_rng(np.random.SeedSequence([int(seed), kind_number])), robot)
    if goals:
        world = dataclasses.replace(world, goal=tuple(goals[-1][:2]))
    if world.model is None:  # else its obstacles are not known yet
        check_world(world, kind, robot, goals)
    return world


def check_world(world: World, kind: Any, robot: Footprint | float, goals: Sequence[Sequence[float]] = ()) -> None:
    """Raise a `StarnavError` where the robot touches an obstacle of a made world at an end, or has no way in a map."""
    place = getattr(kind, "place", type(kind).__name__)
    check_ends(world, robot, place, goals)
    has_movers = world.model is not None and world.model.moving
    if (isinstance(kind, Model) and not has_movers) or (
        isinstance(kind, RosMap) and (kind.start or kind.goal or goals)
    ):
        check_reachable(world, robot, place, goals)
