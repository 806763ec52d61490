"""How far a point, or a robot, is from the nearest obstacle of a world."""

import numpy as np
import shapely

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.footprint import Footprint, measure_least_width
from drake_starnav.geometry.se2 import place_points
from drake_starnav.worlds.moving_obstacles import compute_disc_clearance
from drake_starnav.worlds.world import World


def compute_clearance(world: World, points: np.ndarray) -> np.ndarray:
    """Signed distance from points (n, 2), m, W, to the nearest obstacle surface, shape (n,); +inf without obstacles.

    Negative inside a disc, inside a polygon and outside the bounds. Where obstacles overlap it is the smallest of
    their signed distances: exact outside, at least as deep as the deepest single obstacle inside.
    """
    return np.min([distance for distance, _ in _find_nearest(world, points).values()], axis=0)


def compute_body_clearance(world: World, poses: np.ndarray, footprint: Footprint) -> np.ndarray:
    """Signed distance from a robot to the nearest obstacle surface; negative if and only if they overlap.

    Of poses (x, y, yaw), shape (n, 3), m and rad, W: shape (n,), m. It is exact, but where a robot that is no disc
    overlaps a polygon: there it is the least width of what they share.
    """
    if footprint.is_disc:
        return compute_clearance(world, poses[:, :2]) - footprint.radius
    disc_centres = np.broadcast_to(world.discs[:, :2], (len(poses), len(world.discs), 2))
    least_gaps = compute_disc_clearance(disc_centres, world.discs[:, 2], poses, footprint.body)
    if world.bounds is not None:
        corners = place_points(poses, footprint.polygons.vertices).reshape(len(poses), -1, 2)
        lower_bounds, upper_bounds = np.reshape(world.bounds, (2, 2))
        least_gaps = np.minimum(least_gaps, np.minimum(corners - lower_bounds, upper_bounds - corners).min(axis=(1, 2)))
    for part in footprint.parts if world.polygons and len(poses) else ():
        bodies = shapely.polygons(place_points(poses, part).reshape(len(poses), -1, 2))
        (_, nearest), part_gaps = world.tree.query_nearest(bodies, return_distance=True, all_matches=False)
        for k in np.flatnonzero(part_gaps == 0.0):
            part_gaps[k] = -measure_least_width(shapely.intersection(bodies[k], world.tree.geometries[nearest[k]]))
        least_gaps = np.minimum(least_gaps, part_gaps)
    return least_gaps


def find_nearest_obstacle(world: World, point: tuple[float, float]) -> tuple[str, float]:
    """What is nearest to a point: a name for messages such as `cylinders[3]`, and the clearance to it, m."""
    distances = _find_nearest(world, np.array([point], dtype=float))
    obstacle_kind = min(distances, key=lambda name: distances[name][0][0])
    distance, index = (float(column[0]) for column in distances[obstacle_kind])
    if distance == np.inf:
        return "nothing", distance
    if obstacle_kind == "discs" and index >= len(world.cylinders):
        obstacle_kind, index = "spheres", index - len(world.cylinders)
    obstacle_names = {"discs": f"cylinders[{index:.0f}]", "bounds": "bounds"}
    return obstacle_names.get(obstacle_kind, f"{obstacle_kind}[{index:.0f}]"), distance


def _find_nearest(world: World, points: np.ndarray) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """By kind of obstacle, the signed distance of each point to the nearest one, and its number, each of shape (n,)."""
    points = np.asarray(points, dtype=float)
    if points.ndim != 2 or points.shape[1] != 2:
        raise StarnavError(f"clearance: points has shape {points.shape}; allowed: (n, 2)")
    lower_bounds, upper_bounds = np.reshape(world.bounds or (-np.inf, -np.inf, np.inf, np.inf), (2, 2))
    distances = {
        "bounds": (np.minimum(points - lower_bounds, upper_bounds - points).min(axis=1), np.zeros(len(points)))
    }
    if len(discs := world.discs):
        points_at_once = 1 + 1_000_000 // len(discs)  # points at a time, for the memory that their distances take
        point_pieces = [points[k : k + points_at_once] for k in range(0, max(len(points), 1), points_at_once)]
        disc_distances = [np.hypot(*(piece[:, None] - discs[:, :2]).T).T - discs[:, 2] for piece in point_pieces]
        distances["discs"] = (
            np.hstack([part.min(axis=1) for part in disc_distances]),
            np.hstack([part.argmin(axis=1) for part in disc_distances]),
        )
    if world.polygons and len(points):
        distances["polygons"] = _find_nearest_polygon(world.tree, shapely.points(points))
    return distances


def _find_nearest_polygon(tree: shapely.STRtree, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Signed distance of each point to the nearest polygon, and its number, each of shape (n,)."""
    (_, index), distance = tree.query_nearest(points, return_distance=True, all_matches=False)
    points_inside, polygons_around = tree.query(points, predicate="within")
    depth = shapely.distance(points[points_inside], shapely.get_exterior_ring(tree.geometries[polygons_around]))
    order = np.argsort(depth)  # where polygons overlap, the deepest is assigned last
    distance[points_inside[order]], index[points_inside[order]] = -depth[order], polygons_around[order]
    return distance, index
