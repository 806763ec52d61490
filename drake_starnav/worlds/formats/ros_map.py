"""A world from an occupancy map, as ROS's map_server reads it."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import ndimage

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.footprint import Footprint
from drake_starnav.parameters import parameter
from drake_starnav.utils.resources import resolve_path
from drake_starnav.worlds.formats.map_file import FREE, OCCUPIED, OccupancyMap, read_map
from drake_starnav.worlds.outlines import find_solid_rectangles
from drake_starnav.worlds.solvable import describe_size, draw_random_yaw, is_solvable
from drake_starnav.worlds.world import World, check_numbers

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
