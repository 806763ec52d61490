"""The scans of lidars anywhere on the robot as one scan about its axis."""

import dataclasses
import functools
import math
from collections.abc import Sequence

import numpy as np
import pytest
import shapely

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.footprint import disc, find_covered_area, footprint
from drake_starnav.geometry.se2 import compose_poses, find_pose_in_frame, transform_points
from drake_starnav.lidar.laser_scan import (
    DYNAMIC,
    HIT,
    MAPPABLE,
    STATIC,
    UNKNOWN,
    USUAL_COVER_RADIUS,
    Beams,
    LaserScan,
)
from drake_starnav.lidar.mounts import ON_AXIS, Mount, align_with_robot
from drake_starnav.lidar.outlier_filter import remove_outliers
from drake_starnav.surroundings.bearing_hits import CONNECTED_CHORD
from drake_starnav.surroundings.erosion import BEARINGS
from drake_starnav.surroundings.perception import PerceptionSettings, PerceptionState, check_fields_of_view, perceive
from drake_starnav.surroundings.polar_image import BODY_SLACK, find_view_range, make_polar_image
from drake_starnav.surroundings.view import View
from drake_starnav.surroundings.view_history import InitialFreeDisc
from drake_starnav.utils.snapshot import replace_fields
from drake_starnav.worlds.world import World
from tests.helpers.mounts import AHEAD, CENTRED, CORNERS, LIDARS, Lidar, looks, mounts
from tests.helpers.scans import MARGINS, ORIGIN, RADIUS, cast, distance, scattered

NAMES = pytest.mark.parametrize("name", LIDARS)
BODY = disc(RADIUS)
CLEAR = 0.28
"""Nothing is nearer to the robot's centre in these worlds, m."""


def views_of(scans: Sequence[LaserScan], places: Sequence[Mount]) -> list[View]:
    """Views of scans that are in frames parallel to the robot's."""
    rows = zip(scans, places, strict=True)
    return [replace_fields(View.none(), scan=scan, confirmed_scan=scan, mount=mount) for scan, mount in rows]


def merged(scans: Sequence[LaserScan], places: Sequence[Mount], earlier: Sequence = ()) -> LaserScan:
    """Their polar image."""
    return make_polar_image(views_of(scans, places), BODY, earlier)


def seen(world: World, lidars: tuple[Lidar, ...], pose: np.ndarray = ORIGIN) -> LaserScan:
    """What lidars see, about the robot's axis."""
    scans = [
        align_with_robot(scan, lidar.mount) for scan, lidar in zip(looks(world, lidars, pose), lidars, strict=True)
    ]
    return merged(scans, mounts(lidars))


def blocks(rng: np.random.Generator, discs: int, walls: int, size: float) -> World:
    """A `scattered` world without sharp corners, of a size in parts of the usual one."""
    world = scattered(rng, discs=discs, walls=walls, clear=CLEAR / size)
    rounds = [tuple(size * value for value in cylinder) for cylinder in world.cylinders]
    corners = tuple(size * np.asarray(polygon) for polygon in world.polygons if len(polygon) == 4)
    return World("blocks", (0, 0, 0), (0, 0), cylinders=rounds, polygons=corners, bounds=world.bounds)


def needles(rng: np.random.Generator, lidars: tuple[Lidar, ...], pose: np.ndarray) -> World:
    """Poles of 4 to 30 mm, those that a lidar hits."""
    poles: list[tuple[float, float, float]] = []
    while len(poles) < 14:
        x, y, radius = *rng.uniform(-1.6, 1.6, 2), rng.uniform(0.004, 0.03)
        if math.hypot(x, y) - radius > CLEAR:
            poles.append((x, y, radius))
    world = World("needles", (0, 0, 0), (0, 0), cylinders=poles, bounds=(-3.0, -3.0, 3.0, 3.0))
    ends = [
        align_with_robot(scan, lidar.mount).points(lidar.mount.find_lidar_pose(pose))
        for scan, lidar in zip(looks(world, lidars, pose), lidars, strict=True)
    ]
    away = [np.abs(np.hypot(*(np.vstack(ends) - pole[:2]).T) - pole[2]).min() for pole in poles]
    kept = [pole for pole, least in zip(poles, away, strict=True) if least < 1e-6]
    return World("needles", (0, 0, 0), (0, 0), cylinders=kept, bounds=(-3.0, -3.0, 3.0, 3.0))


def seen_area(beams: Beams, pose: Sequence[float] | np.ndarray, *, past: bool) -> shapely.Geometry:
    """The union of the triangles between neighbouring beams, up to the chord of two hits or else the nearer end."""
    distances, following = beams.distances, np.roll(beams.distances, -1)
    bits, sight = (HIT | MAPPABLE, beams.certain_range) if past else (HIT, math.inf)
    hits = (beams.kinds & bits == bits) & (distances <= sight)
    ends, next_ends = (beams.directions * distances[:, None], np.roll(beams.directions * distances[:, None], -1, 0))
    connected = hits & np.roll(hits, -1) & (np.hypot(*(ends - next_ends).T) < CONNECTED_CHORD * beams.cover_radius)
    nearer = np.minimum(np.minimum(distances, following), sight)
    sides = np.where(connected, distances, nearer), np.where(connected, following, nearer)
    corners = [side[:, None] * np.roll(beams.directions, -k, 0) for k, side in enumerate(sides)]
    triangles = np.stack((np.zeros_like(corners[0]), *corners), axis=1)
    placed = transform_points(np.asarray(pose), triangles.reshape(-1, 2)).reshape(triangles.shape)
    polygons = shapely.polygons(placed if beams.seam < math.inf else placed[:-1])
    return shapely.union_all(shapely.buffer(polygons, 1e-8, quad_segs=1))


@pytest.mark.parametrize("seed", range(20))
def test_rays_are_free_only_where_a_view_has_seen_or_the_robot_stands(seed: int) -> None:
    """Any number of lidars, with limited views, lost beams, moving obstacles, and past views."""
    rng = np.random.default_rng(seed)
    world, box = blocks(rng, 8, 6, 1.0), footprint(((0.3, 0.2), (-0.25, 0.2), (-0.25, -0.2), (0.3, -0.2)))
    body, here, past_count = (BODY, box)[seed % 2], np.array((0.0, 0.0, rng.uniform(-3.0, 3.0))), 3 * (seed % 3)

    def look(pose: np.ndarray) -> tuple[LaserScan, Mount]:
        beams, mount = int(rng.choice((90, 181, 360, 720))), Mount(*rng.uniform(-0.2, 0.2, 2), 0.0, False)
        step = 2.0 * math.pi / beams if rng.random() < 0.4 else rng.uniform(2.0, 6.0) / beams
        scan = cast(
            world, mount.find_lidar_pose(pose), beams=beams, range_max=rng.uniform(2.0, 5.0),
            angle_min=rng.uniform(-3.0, 3.0), angle_increment=step,
        )  # fmt: skip
        ranges = np.where(rng.random(beams) < 0.02, math.nan, scan.ranges)
        motion = np.where(rng.random(beams) < 0.02, DYNAMIC, STATIC) if seed % 4 == 3 else None
        return dataclasses.replace(scan, ranges=ranges, lost_beams=True, motion=motion, thinnest=0.011), mount

    scans, places = zip(*[look(here) for _ in range(rng.integers(1, 9))], strict=True)
    earlier = []
    for _ in range(past_count):
        pose = np.array((*rng.uniform(-0.3, 0.3, 2), rng.uniform(-3.0, 3.0)))
        scan, mount = look(pose)
        earlier.append((scan.beams, np.array(find_pose_in_frame(here, mount.find_lidar_pose(pose)))))
    image = make_polar_image(views_of(scans, places), body, earlier)
    seen = [seen_area(scan.beams, (*mount[:2], 0.0), past=False) for scan, mount in zip(scans, places, strict=True)]
    seen += [seen_area(beams, pose, past=True) for beams, pose in earlier]
    around_axis = find_covered_area(body, ORIGIN) if body is box else shapely.Point(0.0, 0.0).buffer(RADIUS, 256)
    known = shapely.union_all([*seen, around_axis.buffer(BODY_SLACK + 1e-5, 256)]).buffer(1e-6)
    shapely.prepare(known)
    rays = np.column_stack((np.cos(image.bearings), np.sin(image.bearings)))
    lines, sight = [
        shapely.linestrings(np.stack((0.0 * rays, np.reshape(reach, (-1, 1)) * rays), axis=1))
        for reach in (image.distances, image.range_max)
    ]
    assert shapely.covers(known, lines).all()
    gaps = shapely.difference(sight, known)
    exact = np.where(shapely.is_empty(gaps), image.range_max, shapely.distance(shapely.Point(0.0, 0.0), gaps))
    assert image.distances.mean() > 0.97 * exact.mean()


def test_a_ray_along_a_rough_wall_is_free_up_to_it() -> None:
    mount, beams = Mount(0.3, 0.3, 0.0, False), 2000
    bearing = np.linspace(-math.pi, math.pi, beams, endpoint=False)
    rough = np.where(np.arange(beams) % 2, 0.302, 0.298)  # below the lidar, about the x axis
    ranges = np.where(bearing < 0.0, rough / np.maximum(-np.sin(bearing), 1e-9), np.inf)
    x = mount.x + ranges * np.cos(bearing)
    ranges[~((x > 1.0) & (x < 3.0))] = np.inf
    scan = LaserScan(0.0, -math.pi, 2.0 * math.pi / beams, 0.05, 5.0, ranges)
    free = merged([scan], (mount,)).distances[BEARINGS // 2]
    assert 0.99 < free < 1.1


@NAMES
def test_space_at_the_rim_of_certified_regions_is_free(name: str) -> None:
    lidars, rng = LIDARS[name], np.random.default_rng(11)
    settings, least = PerceptionSettings(MARGINS, BODY, mounts(lidars)), math.inf
    for k in range(90):
        pose = np.array((0.0, 0.0, rng.uniform(-3.0, 3.0)))
        world = needles(rng, lidars, pose) if k % 3 == 2 else blocks(rng, *((6, 8, 1.0), (10, 14, 0.45))[k % 3])
        state = perceive(PerceptionState.initial(), looks(world, lidars, pose), pose, settings)
        star = state.surroundings.certified_star
        chosen = rng.integers(0, len(star.values), 60)
        bearing = star.bearing_0 + 2.0 * math.pi / len(star.values) * chosen
        reach = star.values[chosen] * np.repeat((1.0, rng.random()), 30)
        centers = reach[:, None] * np.column_stack((np.cos(bearing), np.sin(bearing)))
        least = min(least, (distance(world, centers) - RADIUS).min())
        assert star.values.mean() > 0.1
    assert least > 0.0


@NAMES
def test_rays_end_where_space_is_free(name: str) -> None:
    lidars, rng = LIDARS[name], np.random.default_rng(12)
    for _ in range(20):
        world, pose = blocks(rng, 6, 8, 1.0), np.array((0.0, 0.0, rng.uniform(-3.0, 3.0)))
        scan = seen(world, lidars, pose)
        truth = cast(world, pose, beams=BEARINGS)
        past = scan.distances - truth.distances
        assert past.max() < 0.5 * CONNECTED_CHORD * USUAL_COVER_RADIUS  # chords cut corners
        assert (np.abs(past[scan.hits]) < 0.02).mean() > 0.97
        assert scan.full_circle and scan.distances.mean() > 0.9 * np.minimum(truth.distances, scan.range_max).mean()


def test_what_only_the_axis_would_see_is_unknown() -> None:
    world = World("post", (0, 0, 0), (0, 0), cylinders=[(0.2, 0.6, 0.1)])
    scan = seen(world, (Lidar(Mount(0.2, 0.0, 0.0, False)),))
    bearing = math.radians(86.0)  # past the post's left side, behind which the lidar sees nothing
    beam = round((bearing + math.pi) / scan.angle_increment) % BEARINGS
    assert scan.lost[beam] and 0.6 < scan.distances[beam] < 4.0
    beyond = scan.distances[beam] * np.array((math.cos(bearing), math.sin(bearing))) - (0.2, 0.0)
    edge = 0.5 * math.pi + math.asin(0.1 / 0.6)
    assert math.atan2(beyond[1], beyond[0]) == pytest.approx(edge, abs=math.radians(1.0))


def test_what_was_seen_earlier_is_free_or_a_surface_where_no_lidar_looks() -> None:
    """A wall behind, seen before the robot turned away; one where it looks counts as it is seen now."""
    behind, front = [np.array(((x, -2), (x + 0.1, -2), (x + 0.1, 2), (x, 2))) for x in (-1.0, 1.0)]
    view = Lidar(Mount(0.2, 0.0, 0.0, False), math.pi, 181)
    before, now = (World("walls", (0, 0, 0), (0, 0), polygons=each) for each in ((behind, front + 0.02), (front,)))
    looked = [(looks(before, (view,), np.array((0.0, 0.0, yaw)))[0], compose_poses((0, 0, yaw), view.mount[:3]))
              for yaw in (0.0, 2.0, 4.0)]  # fmt: skip
    start, (scan,) = InitialFreeDisc.of_radius(0.5).beams, looks(now, (view,))
    alone = merged([scan], (view.mount,))
    known = merged([scan], (view.mount,), [*((each.beams, place) for each, place in looked), (start, ORIGIN)])
    back, ahead = 0, BEARINGS // 2
    assert alone.lost[back] and alone.distances[back] < RADIUS + 0.01
    assert known.hits[back] and known.distances[back] == pytest.approx(0.9, abs=0.01)  # its near side
    assert known.distances[ahead] == pytest.approx(1.0, abs=1e-3) == alone.distances[ahead]
    assert known.lost.sum() < 0.2 * alone.lost.sum()


def test_the_range_shrinks_by_the_offset() -> None:
    scan = seen(World("empty", (0, 0, 0), (0, 0)), AHEAD)
    assert not scan.lost.any() and not scan.hits.any()
    assert 5.0 - 0.2 - 1e-3 < scan.range_max < 5.0 - 0.2


def checked(*lidars: Lidar) -> None:
    """Check whether the views of lidars suffice."""
    check_fields_of_view(looks(World("empty", (0, 0, 0), (0, 0)), lidars), mounts(lidars), BODY, backwards=False)


def test_views_that_meet_all_around_suffice() -> None:
    for lidars in (CENTRED, *LIDARS.values()):
        checked(*lidars)
    checked(Lidar(ON_AXIS, math.pi, 181))
    checked(Lidar(Mount(0.0, 0.0, 0.3, True), math.radians(220.0), 221))


@pytest.mark.parametrize("shorter", [0, 1])
@pytest.mark.parametrize("range_max", [1.0, 2.5, 4.0])
def test_lidars_of_different_range_see_as_far_as_each_does(shorter: int, range_max: float) -> None:
    empty = World("empty", (0, 0, 0), (0, 0))
    scans = looks(empty, CORNERS)
    scans[shorter] = looks(empty, CORNERS, range_max=range_max)[shorter]
    check_fields_of_view(scans, mounts(CORNERS), BODY, backwards=False)
    scans = [align_with_robot(scan, lidar.mount) for scan, lidar in zip(scans, CORNERS, strict=True)]
    around = merged(scans, mounts(CORNERS))
    least = min(find_view_range(*each) for each in zip(scans, mounts(CORNERS), strict=True))
    assert around.distances.min() >= least > 0.6 * range_max
    assert around.lost.any() and (around.distances > 4.5).any(), "beyond the shorter range it is unknown"


@NAMES
def test_what_moves_or_may_move_is_told_of_the_scan_about_the_axis_too(name: str) -> None:
    world = World("three", (0, 0, 0), (0, 0), [(1.5, 0.0, 0.3), (-0.4, 1.5, 0.3), (-0.4, -1.5, 0.3)])
    known = {STATIC: world.cylinders[0], UNKNOWN: world.cylinders[1], DYNAMIC: world.cylinders[2]}
    scans = []
    for scan, lidar in zip(looks(world, LIDARS[name]), LIDARS[name], strict=True):
        scan = align_with_robot(scan, lidar.mount)
        ends, motion = scan.points(np.array((lidar.mount.x, lidar.mount.y, 0.0))), np.full(len(scan.ranges), STATIC)
        for state, (x, y, radius) in known.items():
            motion[np.flatnonzero(scan.hits)[np.hypot(*(ends - (x, y)).T) < radius + 1e-6]] = state
        scans.append(dataclasses.replace(scan, motion=motion))
    around = merged(scans, mounts(LIDARS[name]))
    for state, (x, y, radius) in known.items():
        away = around.points_at(around.distances, np.ones(len(around.ranges), bool), ORIGIN) - (x, y)
        its = np.hypot(*away.T) < radius + 0.01
        assert its.sum() > 10
        assert (around.motion[its] == state).mean() > 0.9, "but where a ray grazes it"
        assert around.hits[its].any() == (state != DYNAMIC) and around.mappable_hits[its].any() == (state == STATIC)
        assert (around.may_leave[its] != (state == STATIC)).mean() > 0.9


def test_views_that_tell_too_little_are_refused() -> None:
    checked(CORNERS[0])  # whose blind side is looked at on the way
    for x in (0.0, 0.2):
        checked(Lidar(Mount(x, 0.0, 0.0, False), math.pi, 181))
    sides = [Lidar(Mount(0.1, y, 5.0 * y, False), 2.4, 241) for y in (0.1, -0.1)]  # to both sides
    checked(*sides)
    with pytest.raises(StarnavError, match="a lidar sees from -40 to 97 degrees, .*; allowed: views that reach 90 deg"):
        checked(sides[0])
    with pytest.raises(StarnavError, match="from -73 to 107 degrees, .*; allowed: views that reach 90 degrees to each"):
        checked(Lidar(Mount(0.0, 0.0, 0.3, False), math.pi, 181))
    with pytest.raises(StarnavError, match="a lidar is mounted 0.3 m from the robot's axis; allowed: up to"):
        checked(Lidar(Mount(0.3, 0.0, 0.0, False)))
    with pytest.raises(StarnavError, match="lidar.beams is 30, one every 12 degrees"):
        checked(Lidar(Mount(0.1, 0.0, 0.0, False), beams=30))


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_outliers_are_found_by_each_lidar_before_their_scans_are_merged(noise: float) -> None:
    world = World("room", (0, 0, 0), (0, 0), bounds=(-3.0, -3.0, 3.0, 3.0))
    settings = PerceptionSettings(MARGINS, BODY, mounts(CORNERS))
    scans = looks(world, CORNERS)
    ranges = scans[1].ranges.copy()
    ranges[100] = 0.9
    scans[1] = type(scans[1])(0.0, scans[1].angle_min, scans[1].angle_increment, 0.0, 5.0, ranges)
    plain = perceive(PerceptionState.initial(), scans, ORIGIN, settings)
    assert len(plain.latest_views) == 2
    filtering = settings._replace(filter_scan=functools.partial(remove_outliers, noise=noise))
    known = perceive(PerceptionState.initial(), scans, ORIGIN, filtering)
    assert np.hypot(*plain.surroundings.certified_star.boundary.points.T).min() < 1.2
    counts = [[np.count_nonzero(view.scan.hits) for view in each.latest_views] for each in (plain, known)]
    assert counts[0] == [counts[1][0], counts[1][1] + 1]  # the stray hit is none; it may hide what is thin


def test_a_polygon_s_lidars_see_from_its_corners() -> None:
    x, y = 0.4, 0.25
    box = footprint(((x, y), (-x, y), (-x, -y), (x, -y)))
    pair = (
        Lidar(Mount(x, -y, -0.25 * math.pi, False), 1.5 * math.pi, 271),
        Lidar(Mount(-x, y, 0.75 * math.pi, False), 1.5 * math.pi, 271),
    )
    empty = World("empty", (0, 0, 0), (0, 0))
    check_fields_of_view(looks(empty, pair), mounts(pair), box, backwards=False)
    check_fields_of_view(looks(empty, pair[:1]), mounts(pair[:1]), box, backwards=False)
