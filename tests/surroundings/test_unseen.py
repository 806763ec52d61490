"""What no look has seen, where nobody stood: a robot comes no nearer to it."""

import math

import numpy as np
import shapely
from hypothesis import given, settings

from drake_starnav.geometry.footprint import Footprint, disc, find_covered_area, footprint
from drake_starnav.surroundings.unseen import BodyStep, clip_by_half_plane, find_initial_disc_radius, is_known_free
from drake_starnav.surroundings.view import View
from drake_starnav.surroundings.view_arrays import ViewArrays, view_covers
from drake_starnav.surroundings.view_history import Odometer, ViewHistory
from drake_starnav.worlds.world import World
from tests.helpers.scans import cast, scattered, seeds, seen_by, view_of

HERE = (0.0, 0.0, 0.0)
ELL = footprint(
    (((-0.3, -0.1), (0.3, -0.1), (0.3, 0.1), (-0.3, 0.1)), ((-0.3, 0.0), (-0.1, 0.0), (-0.1, 0.4), (-0.3, 0.4)))
)
BODIES = (disc(0.2), footprint(((0.4, -0.2), (0.4, 0.2), (-0.3, 0.2), (-0.3, -0.2))), ELL)


def step_of(shape: Footprint, first: np.ndarray, there: np.ndarray) -> BodyStep:
    frames = [np.array((x, y, math.cos(yaw), math.sin(yaw))) for x, y, yaw in (first, there)]
    return BodyStep(shape.body, frames[0], frames[1], False)


@settings(max_examples=150)
@given(seeds)
def test_a_body_comes_no_nearer_to_what_nobody_has_seen(seed: int) -> None:
    """To none of its places that are not where the body stands; small and large parts, small and large steps.

    And it is free to move where it leaves all of them behind at once, however near they are.
    """
    rng = np.random.default_rng(seed)
    shape, size = BODIES[rng.integers(3)], rng.choice([0.003, 0.03, 0.3])
    first = rng.uniform(-0.3, 0.3, 3)
    there = first + size * rng.uniform(-1.0, 1.0, 3)
    part = piece(rng, rng.choice([0.003, 0.02, 0.1]), 0.5)
    answer = is_known_free(
        part, len(part), ViewArrays.of(ViewHistory()), step_of(shape, first, there), np.zeros(2, int)
    )
    exact = 1e-6 if len(shape.parts) else 2e-3  # a disc is one of 48 corners here
    area, inside = shapely.Polygon(part), shapely.points(rng.uniform(part.min(axis=0), part.max(axis=0), (200, 2)))
    places = np.append(inside[shapely.contains(area, inside)], shapely.points(part))
    before, after = (shapely.distance(find_covered_area(shape, pose), places) for pose in (first, there))
    if answer:
        assert (after >= before - exact)[before > exact].all()
    elif len(shape.parts) == 1 and size < 0.01 and before.min() > 1e-4:
        assert (after - before).min() < 0.1 * size
    elif len(shape.parts):
        assert not find_covered_area(shape, first).contains(area)


def test_to_leave_or_to_pass_what_nobody_has_seen_is_to_come_no_nearer() -> None:
    box, looks = BODIES[1], ViewArrays.of(ViewHistory())
    behind = np.array([(-0.32, -0.5), (-0.31, -0.5), (-0.31, 0.5), (-0.32, 0.5)])  # 1 cm
    beside = behind * (1.0, 0.1)  # 5 cm to each side of the middle
    across = np.array([(0.3, 0.15), (0.5, 0.15), (0.5, 0.3), (0.3, 0.3)])  # partly where it stands
    for there, part, free in (
        ((0.0, 0.0, 0.0), beside, True), ((0.0, 0.1, 0.0), beside, True), ((0.1, 0.0, 0.0), behind, True),
        ((-0.001, 0.0, 0.0), behind, False), ((0.0, 0.1, 0.0), behind, False), ((0.0, 0.0, 0.1), behind, False),
        ((-0.02, 0.0, 0.0), across, True), ((0.0, -0.02, 0.0), across, True), ((0.001, 0.0, 0.0), across, False),
    ):  # fmt: skip
        assert is_known_free(part, 4, looks, step_of(box, np.zeros(3), np.array(there)), np.zeros(2, int)) == free, (
            there
        )


def at_once(*views: View) -> ViewHistory:
    """A history of views of one time."""
    return ViewHistory.of_one_time(views, [look.pose for look in views], 0.0, Odometer())


def shadows(look: View) -> shapely.Geometry:
    """All that a look did not see, as far as 9 m."""
    chords, center, hidden = look.chords, np.array(look.pose[:2]), []
    for ends in chords.ends[chords.occludes].reshape(-1, 2, 2):
        away = np.hypot(*(ends - center).T)
        if away.min() > 0.0:
            far = center + 9.0 / away[:, None] * (ends - center)
            hidden.append(shapely.MultiPoint(np.vstack((ends, far))).convex_hull)
    return shapely.union_all(hidden)


def piece(rng: np.random.Generator, size: float, reach: float = 2.5) -> np.ndarray:
    """Corners of a convex polygon somewhere, counterclockwise."""
    hull = shapely.MultiPoint(rng.uniform(-reach, reach, 2) + rng.uniform(-size, size, (6, 2))).convex_hull
    return shapely.get_coordinates(shapely.orient_polygons(hull))[:-1]


@settings(max_examples=60)
@given(seeds)
def test_what_looks_saw_is_in_none_of_their_shadows(seed: int) -> None:
    """Whole parts, and parts that several looks saw together, with views all around and limited ones."""
    rng, views = np.random.default_rng(seed), ({}, {"angle_min": -1.5, "angle_increment": 3.0 / 359})
    world = scattered(rng, discs=10, walls=6, clear=0.3)
    places = [(*rng.uniform(-0.25, 0.25, 2).tolist(), float(rng.uniform(-3.0, 3.0))) for _ in range(3)]
    seen = [view_of(cast(world, np.array(p), **views[rng.integers(2)]), p) for p in places]
    seen_then = at_once(*seen)
    looks = ViewArrays.of(seen_then)
    dark = [shadows(look).buffer(-1e-6) for look in seen]
    dark_for_all = shapely.intersection_all(dark)
    for _ in range(20):
        corners = piece(rng, rng.choice([0.02, 0.1, 0.3]))
        area = shapely.Polygon(corners)
        for k, hidden in enumerate(dark):
            if view_covers(k, looks, corners, len(corners)):
                assert not area.intersects(hidden)
        if seen_by(seen_then, corners):
            assert area.intersection(dark_for_all).area < 1e-9


def test_most_of_what_a_look_saw_it_knows() -> None:
    rng = np.random.default_rng(3)
    look = view_of(cast(scattered(rng, discs=6, walls=2), np.zeros(3)), HERE)
    dark = shadows(look)
    parts = [piece(rng, 0.03, 1.5) for _ in range(300)]
    free = [part for part in parts if shapely.distance(shapely.Polygon(part), dark) > 0.05]
    assert len(free) > 150
    assert np.mean([seen_by(at_once(look), part) for part in free]) > 0.95


@settings(max_examples=40)
@given(seeds)
def test_a_shadow_in_the_midst_of_a_place_hides_it_until_another_look_sees_it(seed: int) -> None:
    """A place of which each corner is seen, behind a pole; another look from beside sees what is behind that."""
    rng = np.random.default_rng(seed)
    bearing = rng.uniform(-3.0, 3.0)
    turn = np.array((math.cos(bearing), math.sin(bearing)))
    frame = np.array((turn, (-turn[1], turn[0])))
    world = World("pole", HERE, (2.0, 0.0), cylinders=[(*(0.5 * turn), rng.uniform(0.01, 0.02))])
    near, deep, wide = rng.uniform(0.8, 1.0), rng.uniform(0.05, 0.2), rng.uniform(0.25, 0.4)
    part = np.array([(near, -wide), (near + deep, -wide), (near + deep, wide), (near, wide)]) @ frame
    places = [(*(np.array((0.0, y)) @ frame), 0.0) for y in (0.0, 0.15)]
    looks = [view_of(cast(world, np.array(place), beams=1440), place) for place in places]
    for look in looks:
        assert not seen_by(at_once(look), part)
        assert all(seen_by(at_once(look), corner[None]) for corner in part)
    assert seen_by(at_once(*looks), part)


@given(seeds)
def test_what_is_clipped_off_lies_beyond_the_line(seed: int) -> None:
    rng, out = np.random.default_rng(seed), np.empty((9, 2))
    corners, angle, offset = piece(rng, 1.0, 0.1), rng.uniform(-3.0, 3.0), rng.uniform(-0.8, 0.8)
    normal = np.array((math.cos(angle), math.sin(angle)))
    size = clip_by_half_plane(corners, len(corners), *normal, offset, out)
    side = np.array((-normal[1], normal[0]))
    ends = ((1, 0), (1, 1), (-1, 1), (-1, 0))
    half = shapely.Polygon([offset * normal + 9.0 * (s * side - d * normal) for s, d in ends])
    kept = shapely.Polygon(out[:size]) if size > 2 else shapely.Polygon()
    assert kept.symmetric_difference(shapely.Polygon(corners).intersection(half)).area < 1e-9


def test_the_disc_of_the_start_holds_what_a_robot_covers_that_turns_and_drives_up_to_its_lidar_s_plane() -> None:
    box = footprint(((0.4, -0.25), (0.4, 0.25), (-0.4, 0.25), (-0.4, -0.25)))
    for body, beside in ((disc(0.25), 0.25), (box, 0.25)):
        for offset in (0.0, 0.1, 0.4):
            free = find_initial_disc_radius(body, 0.02, offset)
            corners = np.array([(x, y) for x in (0.0, offset) for y in (beside + 0.02, -beside - 0.02)])
            assert free >= max(np.hypot(*corners.T).max(), body.radius + 0.02)
            assert free < max(np.hypot(*corners.T).max() + 0.02, body.radius + 1.5 * 0.02)
