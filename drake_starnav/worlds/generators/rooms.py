"""A room with a dead end, as in the paper's real experiment; and rooms joined by doors, with a goal close to a wall."""

import math
from dataclasses import dataclass

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.footprint import Footprint
from drake_starnav.parameters import parameter
from drake_starnav.worlds.outlines import WALL, make_rectangle, make_trap, place
from drake_starnav.worlds.solvable import Drawn, draw_random_yaw
from drake_starnav.worlds.world import World

_WIDTH, _HEIGHT = 6.0, 8.0  # m, along x and, from start to goal, along y


@dataclass(frozen=True)
class Room(Drawn):
    """A room crossed from bottom to top; a U-shaped dead end in the middle opens towards the start."""

    def draw(self, rng: np.random.Generator) -> World:
        trap_middle = rng.uniform((_WIDTH / 3.0, 0.525 * _HEIGHT), (_WIDTH / 1.5, 0.7 * _HEIGHT))
        dead_end = make_trap(rng.uniform(1.6, 3.0), rng.uniform(1.0, 2.2), WALL, arms=2)
        polygons = [place(dead_end, trap_middle, rng.uniform(-0.4, 0.4) - math.pi / 2.0)]
        cylinders = []
        for _ in range(rng.integers(3, 7, endpoint=True)):
            position = rng.uniform(0.5, (_WIDTH - 0.5, _HEIGHT - 0.5))
            if rng.random() < 0.5:
                cylinders.append((*position, rng.uniform(0.1, 0.3)))
            else:
                half_x, half_y = rng.uniform(0.1, 0.3, 2)
                box = make_rectangle(-half_x, -half_y, half_x, half_y)
                polygons.append(place(box, position, rng.uniform(0.0, math.pi)))
        start_x, goal_x = rng.uniform(0.5, _WIDTH - 0.5, 2)
        return World(
            name="room",
            start=(start_x, rng.uniform(0.5, 1.2), draw_random_yaw(rng)),
            goal=(goal_x, _HEIGHT - rng.uniform(0.5, 1.2)),
            cylinders=np.array(cylinders),
            polygons=tuple(polygons),
            bounds=(0.0, 0.0, _WIDTH, _HEIGHT),
        )


_SHUT = 0.2
"""Share of the doors that are walled up, as long as all rooms are joined."""
_SIZE = 2.5
"""Side of a room, m."""
_DOOR_POST = 0.1
"""Least distance of a door from both ends of its wall, m."""
_GOALS = ("wall", "corner", "niche")


@dataclass(frozen=True)
class Rooms:
    """A square of rooms, each with doors to its neighbours; start and goal are in opposite corner rooms."""

    count: int = parameter(3, "rooms along a side", low=2, high=50)
    door: float = parameter(0.9, "width of a door", unit="m", low=0.3, high=10.0)
    goal: str = parameter(
        "any",
        "where the goal lies: beside a wall, in a corner, in a niche of a wall, or any: one of these by chance",
        choices=("any", *_GOALS),
    )
    goal_clearance: float = parameter(
        0.1, "free space between a robot at the goal and the nearest walls", unit="m", above=0.0, high=2.0
    )

    def make(self, rng: np.random.Generator, robot: Footprint) -> World:
        """The rooms for a robot that passes their doors, and the disc around it beside the goal.

        Raises:
            StarnavError: the robot does not fit through a door or beside the goal.
        """
        self._check_sizes(robot.radius, robot.cover_radius)
        n, square_side = self.count, self.count * _SIZE
        is_joined = _draw_joined_rooms(n, _SHUT, rng)
        polygons = []
        for axis in (0, 1):
            for i, j in np.ndindex(n - 1, n):
                wall_place, along_wall = (i + 1) * _SIZE, j * _SIZE
                gap = along_wall + rng.uniform(_DOOR_POST, _SIZE - self.door - _DOOR_POST)
                pieces = [(along_wall, gap), (gap + self.door, along_wall + _SIZE)] if is_joined[axis][i, j] else []
                for first, last in pieces or [(along_wall, along_wall + _SIZE)]:
                    low, high = (wall_place - WALL / 2.0, first), (wall_place + WALL / 2.0, last)
                    corners = (low, high) if axis == 0 else (low[::-1], high[::-1])
                    polygons.append(make_rectangle(*corners[0], *corners[1]))
        goal, niche = self._goal(rng, robot.radius, square_side)
        return World(
            name="rooms",
            start=(0.5 * _SIZE, 0.5 * _SIZE, draw_random_yaw(rng)),
            goal=goal,
            polygons=(*polygons, *niche),
            bounds=(0.0, 0.0, square_side, square_side),
        )

    def _check_sizes(self, robot_radius: float, cover_radius: float) -> None:
        """Raise `StarnavError` unless the robot fits through the doors and, in the last room, beside the goal."""
        width, widest = 2.0 * robot_radius, _SIZE - 2.0 * _DOOR_POST
        if not 2.0 * cover_radius < self.door <= widest + 1e-9:
            raise StarnavError(
                f"Rooms.door is {self.door:g} m with robot.radius {robot_radius:g} m and rooms of {_SIZE:g} m; "
                f"allowed: wider than the robot, {2.0 * cover_radius:g} m, and at most {widest:g} m, as its wall has "
                "two ends"
            )
        taken_width = width if self.goal in ("wall", "corner") else 2.0 * width  # the robot passes in front of a niche
        largest_size = _SIZE - 0.5 * WALL - taken_width
        if self.goal_clearance > largest_size:
            raise StarnavError(
                f"Rooms.goal_clearance is {self.goal_clearance:g} m with robot.radius {robot_radius:g} m and "
                f"rooms of {_SIZE:g} m; allowed: at most {largest_size:g} m, so that the robot fits beside the goal"
            )

    def _goal(
        self, rng: np.random.Generator, robot_radius: float, side: float
    ) -> tuple[tuple[float, float], list[np.ndarray]]:
        """The goal in the last room, and the two walls of its niche, if it lies in one."""
        goal_kind = str(rng.choice(_GOALS)) if self.goal == "any" else self.goal
        wall_distance = robot_radius + self.goal_clearance
        if goal_kind == "corner":
            return (side - wall_distance, side - wall_distance), []
        y = side - _SIZE + rng.uniform(0.35, 0.65) * _SIZE
        if goal_kind == "wall":
            return (side - wall_distance, y), []
        # the niche is as deep as the robot is wide, and leaves it room on both sides
        x, half = side - (robot_radius + wall_distance), robot_radius + max(self.goal_clearance, 0.05)
        walls = [(y + sign * half - 0.03 + 0.03 * sign, y + sign * half + 0.03 + 0.03 * sign) for sign in (-1.0, 1.0)]
        return (side - wall_distance, y), [make_rectangle(x, low, side, high) for low, high in walls]


def _draw_joined_rooms(n: int, shut: float, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Which neighbours are joined by a door: along x, shape (n - 1, n) as [i, j]; along y, as [j, i].

    A random spanning tree of doors stays open, and each other door with probability 1 - `shut`.
    """
    is_joined = (rng.random((n - 1, n)) >= shut, rng.random((n - 1, n)) >= shut)
    room_groups = np.arange(n * n).reshape(n, n)
    inner_walls = [(axis, i, j) for axis in (0, 1) for i in range(n - 1) for j in range(n)]
    for k in rng.permutation(len(inner_walls)):
        axis, i, j = inner_walls[k]
        this_room, next_room = ((i, j), (i + 1, j)) if axis == 0 else ((j, i), (j, i + 1))
        if room_groups[this_room] != room_groups[next_room]:
            room_groups[room_groups == room_groups[next_room]] = room_groups[this_room]
            is_joined[axis][i, j] = True
    return is_joined
