"""Occupancy maps in the format of ROS's map_server, a YAML file and the PGM, PNG or BMP image that it names, as worlds.

Source: wiki.ros.org/map_server, and `map_io.cpp` of navigation2/nav2_map_server.
"""

import io
import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy import ndimage

from drake_starnav.errors import StarnavError, shown
from drake_starnav.geometry.footprint import Footprint
from drake_starnav.geometry.se2 import find_pose_in_frame, transform_points
from drake_starnav.parameters import is_number, parameter
from drake_starnav.utils.files import explain_read_errors, read_bytes, read_text
from drake_starnav.utils.resources import resolve_path
from drake_starnav.utils.yaml_text import load_yaml
from drake_starnav.worlds.outlines import find_solid_rectangles
from drake_starnav.worlds.solvable import describe_size, draw_random_yaw, is_solvable
from drake_starnav.worlds.world import World, check_keys, check_numbers

FREE, OCCUPIED, UNKNOWN = 0, 100, -1
"""What a cell may be, the values of ROS's `OccupancyGrid`."""
IMAGES = (".pgm", ".png", ".bmp")
FINEST, COARSEST = 1e-3, 100.0
"""Sides that cells may have, m."""
LARGEST_MAP = 25_000_000
"""Cells."""


@dataclass(frozen=True)
class OccupancyMap:
    """A grid of square cells, each free, occupied or unknown.

    Attributes:
        cells: shape (ny, nx), int8, of FREE, OCCUPIED and UNKNOWN; `cells[0, 0]` lies at the origin, x is along rows.
        resolution: side of a cell, m.
        origin: (x, y, yaw) in W of the outer corner of `cells[0, 0]`, m and rad.
    """

    cells: np.ndarray
    resolution: float
    origin: tuple[float, float, float]

    def to_world(self, points: np.ndarray) -> np.ndarray:
        """Points given in cells along x and y, shape (..., 2), in W, m."""
        flat = self.resolution * np.reshape(points, (-1, 2))
        return transform_points(np.array(self.origin), flat).reshape(np.shape(points))

    def find_cell(self, point: tuple[float, float]) -> tuple[int, int] | None:
        """Indices of `cells` at a point (x, y) of W, m; None outside the map."""
        x, y, _ = find_pose_in_frame(np.array(self.origin), np.array((*point, 0.0)))
        row, column = math.floor(y / self.resolution), math.floor(x / self.resolution)
        is_inside = 0 <= row < self.cells.shape[0] and 0 <= column < self.cells.shape[1]
        return (row, column) if is_inside else None


def read_map(path: Path) -> OccupancyMap:
    """The map of a map_server YAML file; its image is found relative to it.

    Raises:
        StarnavError: the file or its image is missing, broken or of another format, a key is missing or its value
            not allowed, or the map is too large.
    """
    keys = _read_yaml(path)
    resolution = _read_number(keys, "resolution", path)
    if not FINEST <= resolution <= COARSEST:
        raise StarnavError(f"map {path}: resolution is {resolution:g}; allowed: {FINEST:g} <= x <= {COARSEST:g} m")
    x, y, yaw = check_numbers(keys["origin"], f"map {path}: origin", ("x", "y", "yaw"))
    free_threshold, occupied_threshold = (_read_number(keys, key, path) for key in ("free_thresh", "occupied_thresh"))
    if not 0.0 <= free_threshold <= occupied_threshold <= 1.0:
        raise StarnavError(
            f"map {path}: free_thresh is {free_threshold:g}, occupied_thresh is {occupied_threshold:g}; "
            "allowed: 0 <= free_thresh <= occupied_thresh <= 1"
        )
    is_negated = keys.get("negate", 0)
    if is_negated not in (0, 1):
        raise StarnavError(f"map {path}: negate is {shown(is_negated)}; allowed: 0 or 1")
    mode = keys.get("mode", "trinary")
    if str(mode).lower() != "trinary":
        raise StarnavError(f"map {path}: mode is {shown(mode)}; allowed: trinary")
    if not isinstance(keys["image"], str):
        raise StarnavError(f"map {path}: image is {shown(keys['image'])}; allowed: a path relative to the map's folder")
    brightness = read_brightness(path.parent / keys["image"])
    darkness = brightness if is_negated else 1.0 - brightness
    cells = np.full(darkness.shape, UNKNOWN, np.int8)
    cells[darkness > occupied_threshold] = OCCUPIED
    cells[darkness < free_threshold] = FREE
    return OccupancyMap(cells[::-1].copy(), resolution, (x, y, yaw))


def read_brightness(path: Path) -> np.ndarray:
    """Brightness of a PGM (P2, P5), PNG or BMP image, in which opacity counts as a fourth colour if any is transparent.

    It is of shape (ny, nx), 0 to 1, the upper row first. A `StarnavError` if the file is missing, broken, of another
    format or size than it says, or too large.
    """
    from PIL import Image  # late: only maps need it

    place, allowed_text = f"map image {path}", "a complete PGM (P2 or P5), PNG or BMP image"
    data = io.BytesIO(read_bytes(path, place, allowed_text))
    with explain_read_errors(place, allowed_text):
        try:
            image = Image.open(data, formats=("PPM", "PNG", "BMP"))
        except Image.UnidentifiedImageError:
            raise StarnavError(f"{place} is of another format; allowed: {allowed_text}") from None
        with image as image:
            if image.format == "PPM" and image.get_format_mimetype() != "image/x-portable-graymap":
                raise StarnavError(f"{place} is a colour or bit map; allowed: {allowed_text}")
            if image.width * image.height > LARGEST_MAP:
                raise StarnavError(f"{place} has {image.width} x {image.height} pixels; allowed: at most {LARGEST_MAP}")
            image.load()
            return _average_colors(image)


def _average_colors(image: Any) -> np.ndarray:
    if image.mode in ("P", "LA") or "transparency" in image.info:
        image = image.convert("RGBA")
    elif image.mode == "1":
        image = image.convert("L")
    pixels = np.asarray(image) / (65535.0 if image.mode.startswith("I") else 255.0)
    if image.mode == "RGBA" and (pixels[..., 3] == 1.0).all():
        pixels = pixels[..., :3]
    return pixels if pixels.ndim == 2 else pixels.mean(axis=-1)


def _read_yaml(path: Path) -> dict[str, Any]:
    if path.suffix.lower() in IMAGES:
        raise StarnavError(f"map {path} is an image; allowed: the map's YAML file, which names its image")
    keys = load_yaml(read_text(path, f"map {path}"), f"map {path}")
    check_keys(keys, f"map {path}", ("image", "resolution", "origin", "occupied_thresh", "free_thresh"))
    return keys


def _read_number(keys: dict[str, Any], key: str, path: Path) -> float:
    value = keys[key]
    if not is_number(value):
        raise StarnavError(f"map {path}: {key} is {shown(value)}; allowed: a finite number")
    return float(value)


_TRIES = 20  # of ends for a footprint
_SPARE = 0.1  # m, random places, and the way between them, are this much wider than the robot


@dataclass(frozen=True)
class RosMap:
    """A map_server map: walls where its cells are occupied, start and goal given or random where they are free."""

    file: str = parameter(
        "package://drake_starnav/maps/studio.yaml", "the map's YAML file, which names its image", path=True
    )
    unknown: str = parameter(
        "occupied",
        "what unknown cells, and all that lies beyond the map, are: occupied or free",
        choices=("occupied", "free"),
    )
    start: list[float] = parameter([], "[x, y, yaw] of the robot in the map's frame, m and rad; empty for a random one")
    goal: list[float] = parameter([], "[x, y] in the map's frame, m; empty for a random one")
    min_distance: float = parameter(2.0, "least distance of random start and goal", unit="m", low=0.0, high=1000.0)

    def make(self, rng: np.random.Generator, robot: Footprint) -> World:
        """The map's walls, with a start and a goal between which there is a way for the robot.

        Raises:
            StarnavError: see `read_map`; or the map has no free or no occupied cells, the start or the goal is not
                free, there is no way between them, or the map has no two places of `min_distance`.
        """
        for name, given_numbers, entries in (("start", self.start, ("x", "y", "yaw")), ("goal", self.goal, ("x", "y"))):
            if given_numbers:
                check_numbers(given_numbers, f"RosMap.{name}", entries)
        path = resolve_path(self.file)
        map_grid = read_map(path)
        for value, name in ((OCCUPIED, "occupied"), (FREE, "free")):
            if not (map_grid.cells == value).any():
                raise StarnavError(f"map {path} has no {name} cell; allowed: a map with free and occupied cells")
        self._check_cell("start", self.start, map_grid, path)
        self._check_cell("goal", self.goal, map_grid, path)
        unknown_is_closed = self.unknown == "occupied"
        is_solid = map_grid.cells != FREE if unknown_is_closed else map_grid.cells == OCCUPIED
        start, goal = list(self.start), list(self.goal)
        if not (start and goal):
            end_points = self._random_ends(path, map_grid, is_solid, robot, rng)
            if end_points is None:
                raise StarnavError(
                    f"map {path}: no start and goal {self.min_distance:g} m apart with a way for "
                    f"{describe_size(robot)} and {_SPARE:g} m to spare; "
                    "allowed: more free space, or a smaller robot or world.min_distance"
                )
            start, goal = end_points
        return self._world(path, map_grid, is_solid, start, goal)

    def _world(self, path: Path, grid: OccupancyMap, solid: np.ndarray, start: list[float], goal: list[float]) -> World:
        return World(
            name=path.stem,
            start=(start[0], start[1], start[2]),
            goal=(goal[0], goal[1]),
            polygons=_make_wall_rectangles(grid, solid, self.unknown == "occupied", (start[:2], goal)),
            timeout=600.0,  # a map may be of a whole floor of a building
        )

    def _random_ends(
        self, path: Path, grid: OccupancyMap, solid: np.ndarray, robot: Footprint, rng: np.random.Generator
    ) -> tuple[list[float], list[float]] | None:
        """The start (x, y, yaw) and the goal (x, y), what is empty at random; None if there are no two such places.

        Of a robot that is no disc they are for the disc around it; where there are none, for its footprint.
        """
        for radius in (robot.radius,) if robot.is_disc else (robot.radius, robot.inscribed):
            places = _Places(grid, solid, self.unknown == "occupied", radius + _SPARE)
            for _ in range(1 if radius == robot.radius else _TRIES):
                end_points = self._draw(places, list(self.start), list(self.goal), rng) if len(places.centers) else None
                if end_points is None:
                    break
                if radius == robot.radius or is_solvable(self._world(path, grid, solid, *end_points), robot, 0.0):
                    return end_points
        return None

    def _check_cell(self, name: str, place: list[float], grid: OccupancyMap, path: Path) -> None:
        """Raise `StarnavError` unless a place (x, y, ...) is empty or free in the map."""
        if not place:
            return
        cell = grid.find_cell((place[0], place[1]))
        place_text = f"RosMap.{name} is [{place[0]:g}, {place[1]:g}]"
        if cell is None:
            raise StarnavError(f"{place_text}, outside of map {path}; allowed: a place on a free cell")
        if grid.cells[cell] == OCCUPIED:
            raise StarnavError(f"{place_text}, on an occupied cell of map {path}; allowed: a place on a free cell")
        if grid.cells[cell] != FREE and self.unknown == "occupied":
            raise StarnavError(
                f"{place_text}, on an unknown cell of map {path}, and world.unknown is occupied; "
                "allowed: a place on a free cell"
            )

    def _draw(
        self, places: "_Places", start: list[float], goal: list[float], rng: np.random.Generator
    ) -> tuple[list[float], list[float]] | None:
        """The start (x, y, yaw) and the goal (x, y), what is empty at random; None if there are no two such places."""
        given_place = start[:2] or goal
        for _ in range(1 if given_place else 200):
            start_place = places.near(given_place) if given_place else places.random(rng)
            point = given_place or places.centers[start_place].tolist()
            other_places = places.find_in_reach(start_place, point, self.min_distance)
            if len(other_places):
                other_place = places.centers[rng.choice(other_places)].tolist()
                begin, end = (other_place, point) if goal else (point, other_place)
                return start or [*begin, draw_random_yaw(rng)], end
        return None


def _make_wall_rectangles(
    grid: OccupancyMap, solid: np.ndarray, closes: bool, places: Iterable[list[float]]
) -> tuple[np.ndarray, ...]:
    """The walls as rectangles in W, each of shape (4, 2); what cannot be seen from the ends is no hole in them."""
    padded_cells = np.pad(solid, 1, constant_values=closes)
    rectangles = find_solid_rectangles(padded_cells, np.array([grid.find_cell((x, y)) for x, y in places]) + 1)
    i0, j0, i1, j1 = rectangles.T - 1.0
    cell_corners = np.array([(j0, i0), (j1, i0), (j1, i1), (j0, i1)]).transpose(2, 0, 1)
    return tuple(grid.to_world(cell_corners))


class _Places:
    """The free cells at which a disc touches nothing, by which can be reached from one another; `centers` (n, 2) in W,
    m."""

    def __init__(self, grid: OccupancyMap, solid: np.ndarray, closed: bool, radius: float) -> None:
        """Cells `solid` (ny, nx) bar the way of a disc of this radius, m, and if `closed` all beyond the map."""
        passable = np.pad(~solid, 1, constant_values=not closed)
        if not closed:
            passable = np.pad(passable, int(radius / grid.resolution) + 2, constant_values=True)
        border = (len(passable) - len(solid)) // 2
        # A solid cell reaches half its diagonal beyond its centre, at most.
        free_distances = ndimage.distance_transform_edt(passable) - np.sqrt(0.5)
        area_labels, _ = ndimage.label(free_distances * grid.resolution >= radius, np.ones((3, 3)))
        area_labels = area_labels[border : border + solid.shape[0], border : border + solid.shape[1]]
        rows, columns = np.nonzero((area_labels > 0) & (grid.cells == FREE))
        self._labels = area_labels[rows, columns]
        self.centers = grid.to_world(np.column_stack((columns, rows)) + 0.5)

    def random(self, rng: np.random.Generator) -> int:
        """The number of any place."""
        return int(rng.integers(len(self.centers)))

    def near(self, point: list[float]) -> int:
        """The number of the place nearest to a point (x, y) of W, m."""
        return int(np.argmin(np.hypot(*(self.centers - point).T)))

    def find_in_reach(self, place: int, point: list[float], distance: float) -> np.ndarray:
        """Numbers of the places in reach of one that are at least a distance (m) from a point (x, y) of W."""
        is_reachable = self._labels == self._labels[place]
        return np.flatnonzero(is_reachable & (np.hypot(*(self.centers - point).T) >= distance))
