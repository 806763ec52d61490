"""The worlds of arXiv 2403.11484: the authors' simulated forest and maze, and a room like that of their experiment."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from drake_starnav.utils.files import read_text
from drake_starnav.worlds.outlines import WALL, make_rectangle, place
from drake_starnav.worlds.solvable import Drawn, draw_random_yaw
from drake_starnav.worlds.world import World

WORLDS = Path(__file__).with_name("paper_worlds.json")
"""Poses and sizes of the authors' worlds, with their source."""
_WIDTH, _HEIGHT = 6.0, 8.0  # m, of the room, along x and, from start to goal, along y
_CROSS = 3.0  # m, y of the wall across the room
_POCKET = (1.3, 2.6)  # m, width and depth of the pocket in it, without its blind end, which is as wide and lies aside
_WAY_ROUND = 1.5  # m, width of the opening at the end of that wall


@cache
def _read_authors_worlds() -> dict[str, Any]:
    content: dict[str, Any] = json.loads(read_text(WORLDS, str(WORLDS), "the file of this package"))
    return content


def _draw_place(rng: np.random.Generator, rectangles: Sequence[Sequence[float]]) -> np.ndarray:
    """A place, shape (2,), equally likely anywhere in some rectangles x_min, y_min, x_max, y_max, m."""
    x0, y0, x1, y1 = np.array(rectangles).T
    area = (x1 - x0) * (y1 - y0)
    k = rng.choice(len(area), p=area / area.sum())
    return rng.uniform((x0[k], y0[k]), (x1[k], y1[k]))


class _AuthorsWorld(Drawn):
    """A world of the authors'; a subclass says its name in the file. Only start and goal are random."""

    NAME = ""

    def draw(self, rng: np.random.Generator) -> World:
        entry = _read_authors_worlds()[self.NAME]
        boxes = [np.array(box) for box in entry.get("boxes", ())]
        return World(
            name=f"paper_{self.NAME}",
            start=(*_draw_place(rng, entry["start"]), draw_random_yaw(rng)),
            goal=tuple(_draw_place(rng, entry["goal"])),
            cylinders=np.array(entry["cylinders"]),
            spheres=np.array(entry.get("spheres", ())),
            polygons=tuple(
                place(make_rectangle(*(-0.5 * box[:2]), *(0.5 * box[:2])), box[2:4], box[4]) for box in boxes
            ),
            bounds=tuple(entry["bounds"]),
        )


@dataclass(frozen=True)
class PaperForest(_AuthorsWorld):
    """The authors' Gazebo forest; only start and goal are random, in the paper's ranges.

    Source: the authors' repository, see `paper_worlds.json`; arXiv 2403.11484, section IV-A.
    """

    NAME = "forest"


@dataclass(frozen=True)
class PaperMaze(_AuthorsWorld):
    """The authors' Gazebo maze: walls, a box, a cylinder, a sphere; only start and goal are random, in its ranges.

    Source: as for `PaperForest`.
    """

    NAME = "maze"


@dataclass(frozen=True)
class PaperRoom(Drawn):
    """A room of 6 x 8 m with a pocket on the way to the goal, whose blind end is out of sight until one is in it.

    The authors' room of that size is not published; as in theirs, the robot meets a dead end, from every start.
    """

    def draw(self, rng: np.random.Generator) -> World:
        width, depth = _POCKET
        left_end, right_end = rng.uniform(1.4, 1.9), _WIDTH - _WAY_ROUND
        pocket_right, pocket_top, half = left_end + width, _CROSS + depth, 0.5 * WALL
        walls = [
            (0.0, _CROSS, left_end, _CROSS),
            (pocket_right, _CROSS, right_end, _CROSS),
            (left_end, _CROSS, left_end, pocket_top - width),
            (left_end - width, pocket_top - width, left_end, pocket_top - width),
            (left_end - width, pocket_top - width, left_end - width, pocket_top),
            (left_end - width, pocket_top, pocket_right, pocket_top),
            (pocket_right, _CROSS, pocket_right, pocket_top),
        ]
        outlines = [make_rectangle(x0 - half, y0 - half, x1 + half, y1 + half) for x0, y0, x1, y1 in walls]
        disc_areas = ((3.4, 1.3, 4.8, 2.2), (4.8, 4.0, 5.4, 5.0), (0.6, 6.3, 2.6, 6.8), (3.0, 6.0, 5.0, 7.0))
        discs = [(*_draw_place(rng, [area]), rng.uniform(0.1, 0.25)) for area in disc_areas]
        start, goal = rng.uniform((0.6, 0.5), (3.2, 1.2)), rng.uniform((0.8, 7.0), (2.4, 7.5))
        end_points, cylinders = np.array((start, goal)), np.array(discs)
        if rng.random() < 0.5:  # the same, seen in a mirror
            for x in (end_points[:, 0], cylinders[:, 0], *(outline[:, 0] for outline in outlines)):
                x[:] = _WIDTH - x
        return World(
            name="paper_room",
            start=(*end_points[0], draw_random_yaw(rng)),
            goal=tuple(end_points[1]),
            cylinders=cylinders,
            polygons=tuple(outlines),
            bounds=(0.0, 0.0, _WIDTH, _HEIGHT),
        )
