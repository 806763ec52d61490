"""An office building of 60 x 40 m, and the log of a robot that somebody else drives through it."""

import dataclasses

import numpy as np

from drake_starnav.geometry.polyline import resample_polyline
from drake_starnav.lidar.scan_log import LoggedScan
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.worlds import World
from drake_starnav.worlds.outlines import make_rectangle, place
from drake_starnav.worlds.shortest_path import find_shortest_path
from drake_starnav.worlds.view import scan_from, visible_shapes

LENGTH, WIDTH = 60.0, 40.0
"""Of the building, m."""
BANDS = ((0.0, 10.5, 10.5), (13.0, 19.5, 13.0), (19.5, 26.0, 26.0), (28.5, 40.0, 28.5))
"""Rows of rooms: first y, last y and the y of their doors, m; two corridors run between them."""
WINGS = ((2.0, 28.0), (30.0, 58.0))
"""First and last x of the rooms in each row, m; three corridors run beside them."""
ROOM = (4.0, 10.0)
"""Least and greatest width of a room, m."""
DOOR = (0.9, 1.4)
"""Least and greatest width of a door, m."""
WALL = 0.06
"""Half the thickness of a wall, m."""
JOINED = 0.3
"""Share of the neighbouring rooms that have a door between them."""
AREA = 10.0
"""A room has a piece of furniture for each so many square metres."""
AISLE = 1.7
"""Distance from walls to the middle of a piece of furniture, m: there is room for the robot all around."""
CLEARANCE = 0.32
"""Least distance from the tour to obstacles, m."""
LIDAR = LidarParameters(range_max=30.0)
SPEED = 1.0
"""Of the robot on its tour, m/s."""


def building(seed: int) -> tuple[World, np.ndarray]:
    """A building, and the middles of its rooms, shape (n, 2), W, m."""
    rng = np.random.default_rng(seed)
    polygons, middles = [], []
    for low, high, doors in BANDS:
        for left, right in WINGS:
            edges = _divided(left, right, rng)
            rooms = list(zip(edges[:-1], edges[1:], strict=True))
            for y in (low, high):
                polygons += _wall(y, left, right, [_door(a, b, rng) for a, b in rooms] if y == doors else [], False)
            for x in edges:
                joined = left < x < right and rng.random() < JOINED
                polygons += _wall(x, low, high, [_door(low, high, rng)] if joined else [], True)
            for a, b in rooms:
                middles.append((0.5 * (a + b), 0.5 * (low + high)))
                polygons += _furniture((a, low, b, high), middles[-1], rng)
    world = World("building", (1.0, 11.75, 0.0), (59.0, 27.25), polygons=tuple(polygons), bounds=(0, 0, LENGTH, WIDTH))
    return world, np.array(middles)


def tour(world: World, places: np.ndarray, length: float, seed: int) -> np.ndarray:
    """A path from the world's start to places (n, 2) in random order, shape (k, 2), W, m, cut off at `length`, m."""
    order, at, parts, total = np.random.default_rng([seed, 1]), world.start[:2], [], 0.0
    while total < length:
        there = tuple(places[order.integers(len(places))])
        leg = dataclasses.replace(world, start=(*at, 0.0), goal=there)
        found = find_shortest_path(leg, CLEARANCE, resolution=0.1)
        if found is None:
            continue
        parts.append(found[1])
        at, total = there, total + found[0]
    return np.vstack(parts)


def tour_log(world: World, path: np.ndarray, count: int, spacing: float, seed: int) -> list[LoggedScan]:
    """Scans every `spacing` metres of a path (k, 2), at most `count`; the robot looks where it drives."""
    shapes, places = visible_shapes(world), resample_polyline(path, spacing)[: count + 1]
    yaw = np.arctan2(*np.diff(places, axis=0).T[::-1])
    log = []
    for k, (place_k, yaw_k) in enumerate(zip(places[:-1], yaw, strict=True)):
        pose = np.array((*place_k, yaw_k))
        scan = scan_from(shapes, pose, LIDAR, seed, k)
        log.append(LoggedScan(dataclasses.replace(scan, time=k * spacing / SPEED), pose))
    return log


def _divided(first: float, last: float, rng: np.random.Generator) -> list[float]:
    """Borders of rooms of random widths from `first` to `last`."""
    edges = [first]
    while last - edges[-1] > ROOM[0] + ROOM[1]:
        edges.append(edges[-1] + rng.uniform(*ROOM))
    return [*edges, 0.5 * (edges[-1] + last), last] if last - edges[-1] > ROOM[1] else [*edges, last]


def _door(first: float, last: float, rng: np.random.Generator) -> tuple[float, float]:
    """Both ends of a door in a wall from `first` to `last`."""
    width = rng.uniform(*DOOR)
    begin = rng.uniform(first + 0.3, last - 0.3 - width)
    return begin, begin + width


def _wall(at: float, first: float, last: float, doors: list[tuple[float, float]], along_y: bool) -> list[np.ndarray]:
    """The pieces of a wall between its doors."""
    ends = [first, *(end for door in doors for end in door), last]
    pieces = zip(ends[::2], ends[1::2], strict=True)
    if along_y:
        return [make_rectangle(at - WALL, a, at + WALL, b) for a, b in pieces]
    return [make_rectangle(a, at - WALL, b, at + WALL) for a, b in pieces]


def _furniture(
    room: tuple[float, float, float, float], middle: tuple[float, float], rng: np.random.Generator
) -> list[np.ndarray]:
    """Tables and cabinets at random places of a room (x, y, x, y), away from its walls and its middle."""
    pieces = []
    low, high = np.array(room[:2]) + AISLE, np.array(room[2:]) - AISLE
    for _ in range(int((room[2] - room[0]) * (room[3] - room[1]) / AREA)):
        half = 0.5 * rng.uniform((0.4, 0.3), (1.8, 0.8))
        where, angle = rng.uniform(np.minimum(low, high), np.maximum(low, high)), rng.uniform(0.0, np.pi)
        if np.hypot(*(where - middle)) > np.hypot(*half) + 2.0 * CLEARANCE:
            pieces.append(place(make_rectangle(*-half, *half), where, angle))
    return pieces
