"""Passages: one that winds and is hardly wider than the robot, and a corridor folded into lanes."""

import itertools
import math
from dataclasses import dataclass

import numpy as np

from drake_starnav.geometry.footprint import Footprint
from drake_starnav.parameters import parameter
from drake_starnav.worlds.outlines import WALL, find_solid_rectangles, make_rectangle, place
from drake_starnav.worlds.solvable import Drawn, draw_random_yaw
from drake_starnav.worlds.world import World

_LENGTHS = (2.0, 5.0)  # m, of a lane
_LANES = (3, 8)  # fewest and most of a serpentine or a spiral
_WALLS = (0.03, 0.4)  # m, thickness between two lanes
_SHAPES = ("corridor", "u_turn", "serpentine", "spiral")


@dataclass(frozen=True)
class Channel:
    """A passage of constant width, as wide as the robot and `clearance` on each side, turned by a random angle."""

    shape: str = parameter(
        "any",
        "corridor (straight), u_turn (two lanes), serpentine (several lanes), spiral (from outside to its centre), or "
        "any: one of the four by chance",
        choices=("any", *_SHAPES),
    )
    clearance: float = parameter(0.05, "free space on each side of the robot", unit="m", above=0.0, high=2.0)

    def make(self, rng: np.random.Generator, robot: Footprint) -> World:
        """The channel for the disc around a robot; it is passable by construction."""
        shape = str(rng.choice(_SHAPES)) if self.shape == "any" else self.shape
        lane_length = rng.uniform(*_LENGTHS)
        lane_count = int(rng.integers(*_LANES, endpoint=True))
        wall_thickness = rng.uniform(*_WALLS)
        width = 2.0 * (robot.radius + self.clearance)
        line = _make_middle_line(shape, lane_length, lane_count, width + wall_thickness)
        angle = rng.uniform(-math.pi, math.pi)
        end_points = place(line[[0, -1]], (0.0, 0.0), angle)
        path_length = float(np.hypot(*np.diff(line, axis=0).T).sum())
        return World(
            name="channel",
            start=(*end_points[0], draw_random_yaw(rng)),
            goal=tuple(end_points[1]),
            polygons=tuple(place(outline, (0.0, 0.0), angle) for outline in _make_walls(line, width, wall_thickness)),
            timeout=60.0 + path_length / 0.05,  # for that mean speed, m/s
        )


def _make_middle_line(shape: str, length: float, lanes: int, pitch: float) -> np.ndarray:
    """Corners of the channel's middle line, (k, 2), m: lanes of one length, a pitch apart, m, parallel to an axis."""
    if shape == "corridor":
        return np.array([(0.0, 0.0), (length, 0.0)])
    if shape == "spiral":
        return _make_spiral(length, lanes, pitch)
    corners = []
    for k in range(2 if shape == "u_turn" else lanes):
        end_points = [(0.0, k * pitch), (length, k * pitch)]
        corners += end_points if k % 2 == 0 else end_points[::-1]
    return np.array(corners)


def _make_spiral(length: float, lanes: int, pitch: float) -> np.ndarray:
    """A rectangular spiral inwards, whose runs become shorter by a pitch from the third turn on.

    It ends before the first run that is shorter than a pitch: the lanes at both ends of that one would merge.
    """
    run_lengths = [length] + [max(length - k * pitch, 0.0) for k in range(lanes) for _ in range(2)]
    run_directions = itertools.cycle(((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)))
    corners = [np.zeros(2)]
    for run, step in zip(run_lengths[:lanes], run_directions, strict=False):
        if run < pitch and len(corners) > 1:
            break
        corners.append(corners[-1] + run * np.array(step))
    return np.array(corners)


def _make_walls(line: np.ndarray, width: float, wall: float) -> list[np.ndarray]:
    """Rectangles that bound all places within half a width of the middle line, in the largest norm."""
    low, high = np.minimum(line[:-1], line[1:]) - 0.5 * width, np.maximum(line[:-1], line[1:]) + 0.5 * width
    x, y = (np.unique(np.round((low[:, a], high[:, a], low[:, a] - wall, high[:, a] + wall), 9)) for a in (0, 1))
    middle = np.stack(np.meshgrid(0.5 * (x[:-1] + x[1:]), 0.5 * (y[:-1] + y[1:]), indexing="ij"), axis=-1)[..., None, :]
    is_free = ((middle > low) & (middle < high)).all(axis=-1).any(axis=-1)
    is_wall = ((middle > low - wall) & (middle < high + wall)).all(axis=-1).any(axis=-1) & ~is_free
    solid_rectangles = find_solid_rectangles(~is_free)
    inner_boxes = [(i0, j0, i1, j1) for i0, j0, i1, j1 in solid_rectangles if is_wall[i0:i1, j0:j1].any()]
    return [make_rectangle(x[i0], y[j0], x[i1], y[j1]) for i0, j0, i1, j1 in inner_boxes]


_LANE_WIDTH = 1.5  # m


@dataclass(frozen=True)
class Corridor(Drawn):
    """Lanes of 8 m side by side, joined at alternating ends; fins from random sides make the lanes wind."""

    length: float = parameter(40.0, "length of the corridor's middle line", unit="m", low=10.0, high=300.0)
    fin: float = parameter(0.4, "share of the width that a fin takes; 0 for smooth walls", low=0.0, high=0.9)

    def draw(self, rng: np.random.Generator) -> World:
        lane_pitch = _LANE_WIDTH + WALL
        lane_count = max(1, round(self.length / (8.0 - _LANE_WIDTH + lane_pitch)))
        # the middle line: straight runs of lane - width, and a step of one pitch between two lanes
        run_length = (self.length - (lane_count - 1) * lane_pitch) / lane_count
        lane_length = run_length + _LANE_WIDTH
        polygons = []
        for k in range(1, lane_count):
            y = k * lane_pitch - WALL
            x_left, x_right = (0.0, run_length) if k % 2 else (_LANE_WIDTH, lane_length)
            polygons.append(make_rectangle(x_left, y, x_right, y + WALL))
        for k in range(lane_count):
            bottom, top = k * lane_pitch, k * lane_pitch + _LANE_WIDTH
            reach = self.fin * _LANE_WIDTH
            x = _LANE_WIDTH + rng.uniform(0.5, 1.5)
            while reach > 0.0 and x < lane_length - _LANE_WIDTH - 0.5:
                y_low, y_high = (bottom, bottom + reach) if rng.random() < 0.5 else (top - reach, top)
                polygons.append(make_rectangle(x, y_low, x + WALL, y_high))
                x += rng.uniform(1.2, 2.5) * _LANE_WIDTH
        half_width = _LANE_WIDTH / 2.0
        goal_x = lane_length - half_width if lane_count % 2 else half_width
        return World(
            name="corridor",
            start=(half_width, half_width, draw_random_yaw(rng)),
            goal=(goal_x, (lane_count - 1) * lane_pitch + half_width),
            polygons=tuple(polygons),
            bounds=(0.0, 0.0, lane_length, lane_count * lane_pitch - WALL),
            timeout=60.0 * self.length / 10.0,  # for a mean speed of 0.17 m/s along the middle line
        )
