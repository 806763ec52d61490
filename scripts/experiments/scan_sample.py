"""What experiments on random scans share: the scans, the options, a table and a picture."""

import argparse
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from drake_starnav.cli.options import REACHED, CommandParser, check_numbers, run_command
from drake_starnav.errors import StarnavError
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.utils.files import check_writable, write_text
from drake_starnav.worlds import Forest, Maze, PaperForest, Room, World, clearance, make_world
from drake_starnav.worlds.view import scan_from, visible_shapes

KINDS = (Forest(), Maze(), Room(), PaperForest())
Measured = tuple[str, Callable[[Path], None]]
"""A Markdown table, and a function that draws its picture into a file."""

_TRIES = 10_000  # a world in which so many random places are blocked counts as full


@dataclass(frozen=True)
class View:
    """One scan and where it was taken.

    Attributes:
        world: the obstacles.
        pose: (x, y, yaw) of the sensor in W, m and rad.
        scan: in the sensor frame S.
    """

    world: World
    pose: np.ndarray
    scan: LaserScan


def random_free_pose(world: World, rng: np.random.Generator, robot_radius: float) -> np.ndarray:
    """A random pose (x, y, yaw) in W, m and rad, at which a disc of `robot_radius` (m) touches nothing.

    Raises:
        StarnavError: the world is too full.
    """
    x0, y0, x1, y1 = world.extent
    for _ in range(_TRIES):
        pose = rng.uniform((x0, y0, -np.pi), (x1, y1, np.pi))
        if clearance(world, pose[None, :2])[0] > robot_radius:
            return pose
    raise StarnavError(
        f"world {world.name}: no free place for a robot of radius {robot_radius:g} m among {_TRIES} random ones; "
        "allowed: a world with room for the robot"
    )


def random_views(worlds: Iterable[World], lidar: LidarParameters, robot_radius: float, seed: int) -> Iterator[View]:
    """One scan of each world from a random free pose; view k depends on world k, `seed` and k alone.

    Args:
        worlds: to look at.
        lidar: the sensor.
        robot_radius: clearance of the poses, m.
        seed: of poses and noise.
    """
    for k, world in enumerate(worlds):
        pose = random_free_pose(world, np.random.default_rng([seed, k]), robot_radius)
        yield View(world, pose, scan_from(visible_shapes(world), pose, lidar, seed, k))


def sample_views(scans: int, seed: int, lidar: LidarParameters, robot_radius: float) -> list[View]:
    """Scans from random free poses, each of a world of its own, the kinds of world in turn."""
    worlds = (make_world(KINDS[k % len(KINDS)], seed + k // len(KINDS), robot_radius) for k in range(scans))
    return list(random_views(worlds, lidar, robot_radius, seed))


def sample_text(options: argparse.Namespace) -> str:
    """The sample in words; `options` has scans and seed."""
    kinds = ", ".join(type(kind).__name__ for kind in KINDS)
    return f"{options.scans} scans of {kinds} from random free poses, seed {options.seed}"


def scan_experiment(script: str, description: str, measure: Callable[[argparse.Namespace], Measured]) -> int:
    """Parse the arguments, measure, print the table and write it with its picture; returns the exit code.

    Args:
        script: its file name, which the table and the picture share.
        description: what it measures.
        measure: makes table and picture from the options scans and seed.
    """
    parser = CommandParser(prog=script, description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scans", type=int, default=100, help="number of scans (default: 100)")
    parser.add_argument("--seed", type=int, default=0, help="of worlds and poses (default: 0)")
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for table and picture (default: out)")

    def work(options: argparse.Namespace) -> int:
        check_numbers(options, scans=(1, math.inf))
        table = options.out / Path(script).with_suffix(".md")
        check_writable(table)
        text, draw = measure(options)
        print(text)
        write_text(table, f"{text}\n")
        draw(table.with_suffix(".png"))
        return REACHED

    return run_command(parser, None, work)
