"""Moving obstacles: discs on given paths, and their positions at any time."""

import math
from dataclasses import field
from functools import cached_property

import numpy as np

from drake_starnav.errors import StarnavError, shown
from drake_starnav.geometry.compiled import kernel
from drake_starnav.geometry.footprint import Footprint, disc, measure_gap_to_disc
from drake_starnav.utils.snapshot import snapshot

MOVING_OBSTACLE_COLOR = (0.87, 0.55, 0.74)
"""Red, green, blue of a disc in every picture; the other colours contrast with it (`meshes.LAYERS`)."""

POINT = disc(0.0)


def _make_read_only(value: object, columns: int) -> np.ndarray:
    array = np.array(value, dtype=float).reshape((-1, columns) if columns > 1 else -1)
    array.flags.writeable = False
    return array


@snapshot
class MovingObstacles:
    """Discs that follow their own closed paths periodically and never yield; frame W.

    Attributes:
        radii: shape (n,), m.
        paths: for each disc its way points, shape (k, 3): time, x, y in s and m. The first is at time 0 and the times
            increase. Between two way points the disc moves uniformly; from the last one it continues at the first,
            instantly if that is elsewhere.
    """

    radii: np.ndarray = field(default_factory=lambda: np.zeros(0))
    paths: tuple[np.ndarray, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "radii", _make_read_only(self.radii, 1))
        object.__setattr__(self, "paths", tuple(_make_read_only(path, 3) for path in self.paths))
        if len(self.radii) != len(self.paths):
            raise StarnavError(
                f"moving obstacles: {len(self.radii)} radii for {len(self.paths)} paths; allowed: one for each"
            )
        for k, (radius, path) in enumerate(zip(self.radii, self.paths, strict=True)):
            if not (np.isfinite(radius) and radius > 0.0):
                raise StarnavError(f"moving obstacles: radii[{k}] is {radius:g}; allowed: 0 < x m")
            if len(path) < 2 or not np.isfinite(path).all():
                raise StarnavError(
                    f"moving obstacles: paths[{k}] is {shown(path.tolist())}; allowed: two or more finite [time, x, y]"
                )
            if path[0, 0] != 0.0 or (np.diff(path[:, 0]) <= 0.0).any():
                raise StarnavError(
                    f"moving obstacles: the times of paths[{k}] are {shown(path[:, 0].tolist())}; allowed: 0, then more"
                )

    def __len__(self) -> int:
        return len(self.radii)

    @cached_property
    def way_points(self) -> np.ndarray:
        """The way points of all paths one after another, shape (k, 3)."""
        return np.vstack((np.zeros((0, 3)), *self.paths))

    @cached_property
    def first(self) -> np.ndarray:
        """Where in `way_points` each path begins, and the end; shape (n + 1,)."""
        return np.cumsum([0] + [len(path) for path in self.paths])

    @cached_property
    def max_speed(self) -> float:
        """The highest speed on any path, m/s; 0 without one."""
        legs = [np.diff(path, axis=0) for path in self.paths]
        return max((float((np.hypot(leg[:, 1], leg[:, 2]) / leg[:, 0]).max()) for leg in legs), default=0.0)


def moving_obstacle_states(moving_obstacles: MovingObstacles, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities of n moving obstacles at given times, shape (m,), s, not negative.

    Returns:
        Each of shape (m, n, 2), m and m/s. At a way point the velocity is that of the leg that begins there; the step
        from the last way point to the first takes no time and has none.
    """
    times = np.ascontiguousarray(times, dtype=float)
    return _find_states_on_paths(times, moving_obstacles.way_points, moving_obstacles.first)


def compute_moving_obstacle_clearance(
    moving_obstacles: MovingObstacles, poses: np.ndarray, times: np.ndarray, footprint: Footprint = POINT
) -> np.ndarray:
    """Distance of a footprint at poses (m, 3), W, to the nearest moving obstacle at times (m,), s; shape (m,), m.

    +inf without an obstacle; negative where they overlap, to the depth of the disc's centre if that is inside, too.
    """
    if not moving_obstacles.paths:
        return np.full(len(times), np.inf)
    positions, _ = moving_obstacle_states(moving_obstacles, times)
    poses = np.ascontiguousarray(poses, dtype=float)
    return compute_disc_clearance(positions, moving_obstacles.radii, poses, footprint.body)


@kernel
def compute_disc_clearance(positions, radii, poses, body):
    """The same of a `Body` to discs of some radii (n,), m, at positions (m, n, 2), W, one row for each pose."""
    least = np.full(len(poses), np.inf)
    for k in range(len(poses)):
        frame = poses[k, 0], poses[k, 1], math.cos(poses[k, 2]), math.sin(poses[k, 2])
        for n in range(len(radii)):
            least[k] = measure_gap_to_disc(frame, body, positions[k, n, 0], positions[k, n, 1], radii[n], least[k])
    return least


def there_and_back(way_points: np.ndarray) -> np.ndarray:
    """The path of way points (k, 3), as of `MovingObstacles`, that returns through them as fast, (2 k - 1, 3)."""
    way_back = way_points[-2::-1].copy()
    way_back[:, 0] = 2.0 * way_points[-1, 0] - way_back[:, 0]
    return np.vstack((way_points, way_back))


@kernel
def _find_states_on_paths(
    times: np.ndarray, way_points: np.ndarray, first: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities (m, n, 2) at times (m,) on paths that begin at `first` (n + 1,) in way points."""
    count = len(first) - 1
    positions = np.empty((len(times), count, 2))
    velocities = np.empty((len(times), count, 2))
    for n in range(count):
        path = way_points[first[n] : first[n + 1]]
        period = path[-1, 0]
        for m in range(len(times)):
            time = times[m] % period
            k = min(np.searchsorted(path[:, 0], time, side="right"), len(path) - 1)
            previous_key, next_key = path[k - 1], path[k]
            duration = next_key[0] - previous_key[0]
            for axis in range(2):
                velocity = (next_key[1 + axis] - previous_key[1 + axis]) / duration
                velocities[m, n, axis] = velocity
                positions[m, n, axis] = previous_key[1 + axis] + velocity * (time - previous_key[0])
    return positions, velocities
