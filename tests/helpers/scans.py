"""Random worlds, exact scans of them and smooth star regions to test with, by plain NumPy."""

import dataclasses
import math

import numpy as np
from hypothesis import strategies as st

from drake_starnav.geometry.footprint import Footprint, disc
from drake_starnav.geometry.se2 import compose_poses, find_pose_in_frame
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.mounts import ON_AXIS
from drake_starnav.planning.parameters import PlannerParameters
from drake_starnav.planning.roadmap import StarRoadmap, add_node
from drake_starnav.planning.state import PlannerInput
from drake_starnav.surroundings.erosion import FreeRange
from drake_starnav.surroundings.margins import Margins, ViewRetention
from drake_starnav.surroundings.observation import Observation
from drake_starnav.surroundings.region_union import RegionUnion, find_first_departure
from drake_starnav.surroundings.star_region import StarRegion, fit_region, make_scan_region
from drake_starnav.surroundings.surroundings import Surroundings, find_past_beams, observe
from drake_starnav.surroundings.unseen import BodyStep, is_known_free
from drake_starnav.surroundings.view import View, ViewParams, make_view
from drake_starnav.surroundings.view_arrays import ViewArrays
from drake_starnav.surroundings.view_history import ViewHistory
from drake_starnav.utils.snapshot import replace_fields
from drake_starnav.worlds.world import World

RADIUS = 0.25
"""Of the robot, m."""
MARGINS = Margins(
    safety=0.0145,
    preferred=0.0295,
    least=0.0105,
    thinnest=0.63 * math.radians(1.0),
    safety_range=1.2,
    smoothing_slack=0.0,
    smoothed_beams=0,
    average_scans=False,
    drop_seen_through=False,
    retention=ViewRetention(),
)
"""Of the default scenario, but the certificate's ranges are not smoothed."""
ORIGIN = np.zeros(3)
seeds = st.integers(0, 2**32 - 1)


def unit(angle: np.ndarray | float) -> np.ndarray:
    """The unit vector at an angle, rad, shape (2,), or those at many, shape (..., 2)."""
    return np.stack((np.cos(angle), np.sin(angle)), axis=-1)


def view_of_hits(hits: np.ndarray, place: np.ndarray = ORIGIN, reach: float = 99.0) -> View:
    """A view that saw nothing itself, of hits (n, 2) of scans before it, which occlude nothing."""
    return replace_fields(View.none(), robot_pose=np.asarray(place, dtype=float), further_hits=hits, reach=reach)


def view_of(scan: LaserScan, place: np.ndarray | tuple, reach: float = 3.0, shape=None) -> View:
    """What one lidar on the axis of a robot saw in one scan, from a pose."""
    shape = shape or disc(0.0)
    pose = np.array(place, dtype=float)
    view = replace_fields(View.none(), scan=scan, confirmed_scan=scan, robot_pose=pose, params=ViewParams(shape))
    return replace_fields(view, own_hits=scan.points(pose), reach=reach)


def seen_by(views: ViewHistory, part: np.ndarray) -> bool:
    """Whether views cover all of a convex polygon (n, 2), W."""
    step = BodyStep(disc(0.0).body, np.full(4, np.nan), np.full(4, np.nan), True)
    return bool(is_known_free(part, len(part), ViewArrays.of(views), step, np.zeros(2, int)))


def observe_scan(
    scan: LaserScan,
    pose: np.ndarray,
    radius: float,
    reach: float,
    before: Surroundings | None = None,
    shape: Footprint | None = None,
) -> Surroundings:
    """The surroundings after one more scan of a lidar on the axis of a robot that keeps `radius` from hits, m."""
    shape = shape or disc(RADIUS)
    margins = dataclasses.replace(MARGINS, safety=radius - shape.cover_radius, safety_range=reach)
    view = make_view(scan, ON_AXIS, pose, None, ViewParams(shape))
    before = before or Surroundings.unknown()
    return observe(before, [view], find_past_beams(before, [view], pose, shape), shape, margins)


def silence() -> LaserScan:
    """What a lidar outputs before its first scan."""
    return dataclasses.replace(LaserScan.nothing(), ranges=np.full(4, np.nan), lost_beams=True)


def cast(
    world: World,
    pose: np.ndarray = ORIGIN,
    *,
    beams: int = 360,
    range_max: float = 5.0,
    angle_min: float = -math.pi,
    angle_increment: float | None = None,
) -> LaserScan:
    """What an exact lidar at `pose` measures; a full circle unless `angle_increment` (rad) is given."""
    increment = 2.0 * math.pi / beams if angle_increment is None else angle_increment
    angle = pose[2] + angle_min + increment * np.arange(beams)
    ray = np.column_stack((np.cos(angle), np.sin(angle)))
    discs, segments = np.reshape(world.discs, (-1, 3)), np.reshape(world.segments, (-1, 4))
    to_center = discs[:, :2] - pose[:2]
    along = ray @ to_center.T
    root = discs[:, 2] ** 2 - ((to_center**2).sum(axis=1) - along**2)
    entry = along - np.sqrt(np.maximum(root, 0.0))
    ranges = np.where((root >= 0.0) & (entry > 0.0), entry, np.inf).min(axis=1, initial=np.inf)
    a, e = segments[:, :2] - pose[:2], segments[:, 2:] - segments[:, :2]
    with np.errstate(divide="ignore", invalid="ignore"):
        det = ray[:, 1:] * e[:, 0] - ray[:, :1] * e[:, 1]
        r = (a[:, 1] * e[:, 0] - a[:, 0] * e[:, 1]) / det
        t = (ray[:, :1] * a[:, 1] - ray[:, 1:] * a[:, 0]) / det
    hit = (np.abs(det) > 1e-12) & (r > 0.0) & (t >= -1e-9) & (t <= 1.0 + 1e-9)
    ranges = np.minimum(ranges, np.where(hit, r, np.inf).min(axis=1, initial=np.inf))
    ranges = np.where(ranges < range_max, ranges, np.inf)
    return LaserScan(0.0, angle_min, increment, 0.0, range_max, ranges)


def cast_rolling(
    world: World, before: np.ndarray, pose: np.ndarray, period: float, *, time: float | None = None, beams: int, **view
) -> LaserScan:
    """What a lidar measures one beam after the other while it moves evenly from a pose to another.

    Args:
        world: to look at.
        before, pose: (x, y, yaw) at the beginning and at the end, W, m and rad.
        period: time that it takes, s.
        time: at the end, s; the period if None.
        beams, view: as of `cast`.
    """
    back = np.array(find_pose_in_frame(pose, before))
    clockwise = (view.get("angle_increment") or 1.0) < 0.0
    ranges = [
        cast(
            world, compose_poses(pose, back * (i if clockwise else beams - 1 - i) / beams), beams=beams, **view
        ).ranges[i]
        for i in range(beams)
    ]
    return dataclasses.replace(
        cast(world, pose, beams=beams, **view), time=period if time is None else time, ranges=np.array(ranges),
        time_increment=(-period if clockwise else period) / beams, scan_time=period, lost_beams=True,
    )  # fmt: skip


def noisy(scan: LaserScan, noise: float, rng: np.random.Generator) -> LaserScan:
    """The scan with normal errors of its ranges, m."""
    return dataclasses.replace(scan, ranges=scan.ranges + noise * rng.standard_normal(len(scan.ranges)))


def distance(world: World, points: np.ndarray) -> np.ndarray:
    """Distance from points outside of all obstacles to the nearest surface; shape (n, 2) -> (n,), m."""
    points = np.asarray(points, dtype=float).reshape(-1, 1, 2)
    discs, segments = np.reshape(world.discs, (-1, 3)), np.reshape(world.segments, (-1, 4))
    to_discs = np.abs(np.hypot(*np.moveaxis(points - discs[:, :2], -1, 0)) - discs[:, 2])
    to_segments = segment_distance(points, segments[:, :2], segments[:, 2:])
    return np.hstack((to_discs, to_segments)).min(axis=1, initial=np.inf)


def length(*points: np.ndarray) -> float:
    """Length of the polyline over points or rows of points, m."""
    return float(np.hypot(*np.diff(np.vstack(points), axis=0).T).sum())


def segment_distance(points: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Distance from points to the segments a b; all of shape (..., 2), broadcast against each other."""
    e = b - a
    squared = np.maximum((e * e).sum(axis=-1), 1e-300)
    t = np.clip(((points - a) * e).sum(axis=-1) / squared, 0.0, 1.0)
    return np.hypot(*np.moveaxis(points - a - t[..., None] * e, -1, 0))


def scattered(rng: np.random.Generator, discs: int = 6, walls: int = 4, clear: float = 0.5) -> World:
    """A walled square of 6 m with discs, thin walls and triangles; nothing within `clear` (m) of the origin."""
    cylinders, polygons = [], []
    while len(cylinders) < discs:
        x, y, radius = *rng.uniform(-3.0, 3.0, 2), rng.uniform(0.05, 0.4)
        if math.hypot(x, y) - radius > clear:
            cylinders.append((x, y, radius))
    while len(polygons) < walls:
        center, angle, length = rng.uniform(-3.0, 3.0, 2), rng.uniform(0.0, math.pi), rng.uniform(0.3, 1.0)
        along = 0.5 * length * np.array((math.cos(angle), math.sin(angle)))
        across = 0.5 * rng.uniform(0.04, 0.3) * np.array((-math.sin(angle), math.cos(angle)))
        corners = [center + along + across, center - along + across, center - along - across]
        if rng.random() < 0.5:
            corners.append(center + along - across)
        polygon = np.array(corners)
        edges = zip(polygon, np.roll(polygon, -1, axis=0), strict=True)
        if min(segment_distance(np.zeros(2), a, b) for a, b in edges) > clear and np.hypot(*center) > clear:
            polygons.append(polygon)
    return World(
        "scattered", (0, 0, 0), (0, 0), cylinders=cylinders, polygons=tuple(polygons), bounds=(-3.0, -3.0, 3.0, 3.0)
    )


def free_point(rng: np.random.Generator, world: World, clearance: float) -> np.ndarray:
    """A random point of a `scattered` world that can be reached from the origin in a straight line, shape (2,)."""
    while True:
        point = rng.uniform(-2.5, 2.5, 2)
        if distance(world, np.linspace(0.0, 1.0, 60)[:, None] * point).min() > clearance:
            return point


def smooth_region(rng: np.random.Generator, center: np.ndarray, mean: float = 1.5) -> StarRegion:
    """A region with a smooth random boundary between 0.4 and 1.6 times `mean` (m)."""
    bearing = 2.0 * math.pi / 720 * np.arange(720)
    samples = np.full(720, mean)
    for k in range(1, 5):
        samples += mean * rng.uniform(0.0, 0.15) * np.cos(k * bearing + rng.uniform(0.0, 2.0 * math.pi))
    profile = FreeRange(samples, np.full(720, 3.0 * mean), 0.0, RADIUS)
    return fit_region(profile, center, rng.uniform(-math.pi, math.pi))


def observed(scan: LaserScan, pose: np.ndarray, margins: Margins = MARGINS) -> Observation:
    """What a planner gets of a scan taken at a pose."""
    return Observation(make_scan_region(scan, pose, RADIUS, margins), scan, pose)


def planner_input(scan: LaserScan, pose: np.ndarray | tuple, goal: np.ndarray | tuple, **changes) -> PlannerInput:
    """What a planner gets of a scan taken at a pose on the way to a goal; `changes` are of the input's fields."""
    pose, goal = np.array(pose, dtype=float), np.array(goal, dtype=float)
    given = PlannerInput(observed(scan, pose), pose[:2], goal, scan.time, PlannerParameters(), MARGINS, RADIUS)
    return given._replace(**changes)


def explored(world: World, positions: np.ndarray, margins: Margins = MARGINS) -> StarRoadmap:
    """A roadmap with a node at each position, shape (n, 2), W, m."""
    roadmap = StarRoadmap.empty(PlannerParameters(), RADIUS)
    for k, (x, y) in enumerate(positions):
        pose = np.array((x, y, 0.7 * k))
        roadmap = add_node(roadmap, observed(cast(world, pose), pose, margins), margins, RADIUS)
    return roadmap


def wandered(seed: int, nodes: int = 5, margins: Margins = MARGINS) -> tuple[World, StarRoadmap]:
    """A random world and a roadmap of it: the origin, then random places seen from there."""
    rng = np.random.default_rng(seed)
    world = scattered(rng, discs=8, walls=6)
    positions = [np.zeros(2)] + [free_point(rng, world, RADIUS + 0.05) for _ in range(nodes - 1)]
    return world, explored(world, np.array(positions), margins)


def in_view(regions: RegionUnion, start: np.ndarray, end: np.ndarray) -> bool:
    """Whether the straight segment between two places (2,) stays inside a union."""
    return bool(find_first_departure(regions, tuple(start), tuple(end), 0.0, 0.25) < 0.0)
