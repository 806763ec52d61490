"""The separation is a lower bound of the distance, and decides contact."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings

from drake_starnav.geometry.footprint import Footprint, disc, find_covered_area, footprint
from drake_starnav.surroundings.chords import Chords
from drake_starnav.surroundings.separation import (
    ESCAPE_CLEARANCE,
    ClearanceLimits,
    is_collision_free,
    measure_body_chord_distance,
)
from drake_starnav.surroundings.view_arrays import ViewArrays
from drake_starnav.surroundings.view_history import ViewHistory
from tests.helpers.scans import seeds

ELL = footprint(
    (
        ((-0.3, -0.125), (0.3, -0.125), (0.3, 0.125), (-0.3, 0.125)),
        ((-0.3, -0.1), (-0.05, -0.1), (-0.05, 0.4), (-0.3, 0.4)),
    )
)


NONE, ROUND = ViewArrays.of(ViewHistory()), disc(0.3)


def gap(pose: np.ndarray, shape: Footprint, surface: Chords) -> float:
    """The bound of a footprint's distance from a single chord and what it hides, m."""
    frame = np.array((pose[0], pose[1], math.cos(pose[2]), math.sin(pose[2])))
    return float(
        measure_body_chord_distance(frame, surface.ends[0], surface.center, surface.occludes[0], shape.body, math.inf)
    )


def chords(ends: np.ndarray, shades: np.ndarray, center: np.ndarray) -> Chords:
    """Surfaces; and which of them hide what is behind."""
    return Chords(ends, np.ones(len(ends), bool), shades, center)


def hidden(ends: np.ndarray, shades: bool, center: np.ndarray) -> shapely.Geometry:
    """A chord (4,) with all that it hides from a place, as far as anything comes here."""
    corners = ends.reshape(2, 2)
    far = center + (1000.0 if shades else 1.0) * (corners - center)
    return shapely.MultiPoint(np.vstack((corners, far))).convex_hull


def test_the_separation_is_never_more_than_the_distance_and_decides_contact():
    rng = np.random.default_rng(5)
    for k in range(400):
        shape = ELL if k % 4 else ROUND
        pose, center = np.array((*rng.uniform(-0.5, 0.5, 2), rng.uniform(-math.pi, math.pi))), rng.uniform(-0.5, 0.5, 2)
        ends = rng.uniform(-1.0, 1.0, 4)
        ends[2:] = ends[:2] + rng.choice([0.1, 1.0]) * rng.uniform(-1.0, 1.0, 2)
        for shades in (False, True):
            body, apart = (
                find_covered_area(shape, pose),
                gap(pose, shape, chords(ends[None], np.array([shades]), center)),
            )
            exact = shapely.distance(body, hidden(ends, shades, center))
            assert apart <= exact + (1e-9 if k % 4 else 2e-3)
            assert (apart > 0.0) == (exact > 1e-12) or abs(apart) < 2e-3


@settings(max_examples=300)
@given(seeds)
def test_a_motion_keeps_clear_if_it_does_so_at_each_of_its_poses(seed: int) -> None:
    """Of each surface by the margin or by the bound that holds at first: else it is refused, and only then; in steps
    of any length."""
    rng = np.random.default_rng(seed)
    steps = rng.choice([0.005, 0.1, 1.0]) * rng.standard_normal((rng.integers(2, 9), 3)) * (1.0, 1.0, 2.0)
    poses = rng.uniform(-1.0, 1.0, 3) * (0.5, 0.5, math.pi) + np.cumsum(steps, axis=0)
    count = rng.integers(1, 4)
    ends = np.empty((count, 4))
    ends[:, :2] = poses[rng.integers(len(poses), size=count), :2] + rng.uniform(-0.9, 0.9, (count, 2))
    ends[:, 2:] = ends[:, :2] + rng.uniform(-0.1, 0.1, (count, 2))
    surfaces = chords(ends, rng.random(count) < 0.5, poses[0, :2] + rng.uniform(-0.1, 0.1, 2))
    margin, room = rng.uniform(ESCAPE_CLEARANCE, 0.1), rng.choice([rng.uniform(0.1, 2.0), 99.0])
    accepts = is_collision_free(poses, surfaces, NONE, ELL.body, ClearanceLimits(margin, room))
    inside = (np.hypot(*(poses[:, :2] - surfaces.center).T) <= room).all()
    bounds, distances = np.empty((2, count, len(poses)))
    for j in range(count):
        one = chords(ends[j : j + 1], surfaces.occludes[j : j + 1], surfaces.center)
        behind = hidden(ends[j], surfaces.occludes[j], surfaces.center)
        bounds[j] = [gap(pose, ELL, one) for pose in poses]
        distances[j] = [shapely.distance(find_covered_area(ELL, pose), behind) for pose in poses]
    kept = np.where(bounds[:, :1] < margin, np.maximum(bounds[:, :1], ESCAPE_CLEARANCE), margin)
    if accepts:
        assert inside and (distances >= kept - 2e-9).all()
    else:  # a place that an occluding chord hides may come nearer though the nearest one does not
        needed = np.where(surfaces.occludes[:, None], margin, kept)
        assert not (inside and (bounds >= needed).all())


@pytest.mark.parametrize(("room", "clear"), [(0.29, False), (0.31, True), (-1.0, False)])
def test_what_leaves_the_known_area_does_not_keep_clear(room: float, clear: bool) -> None:
    nothing = chords(np.zeros((0, 4)), np.zeros(0, bool), np.array((1.0, 2.0)))
    poses = np.array(((1.0, 2.0, 0.0), (1.3, 2.0, 0.0), (1.0, 2.1, 0.0)))
    assert is_collision_free(poses, nothing, NONE, ELL.body, ClearanceLimits(0.01, room)) == clear


@settings(max_examples=60)
@given(seeds)
def test_surfaces_count_as_far_as_the_robot_can_get_with_its_margin(seed: int) -> None:
    """From where the scan was taken straight on, with its farthest corner ahead."""
    rng = np.random.default_rng(seed)
    center, bearing, margin = rng.uniform(-3.0, 3.0, 2), rng.uniform(-math.pi, math.pi), rng.uniform(0.01, 0.1)
    ahead = np.array((math.cos(bearing), math.sin(bearing)))
    corner = max(np.vstack(ELL.parts), key=np.linalg.norm)
    way = np.cumsum(rng.uniform(0.1, 1.0, rng.integers(2, 6)))
    poses = np.column_stack((center + way[:, None] * ahead, np.full(len(way), bearing - math.atan2(*corner[::-1]))))
    for share in (0.9, 1.1):
        hit = poses[-1, :2] + (ELL.radius + share * margin) * ahead
        beyond = hit + rng.uniform(0.0, 0.2) * ahead + rng.uniform(-0.5, 0.5) * np.array((-ahead[1], ahead[0]))
        for ends in ((hit, beyond), (beyond, hit)):
            surface = chords(np.hstack(ends)[None], np.array([False]), center)
            assert is_collision_free(poses, surface, NONE, ELL.body, ClearanceLimits(margin, 9.0)) == (share > 1.0)


@pytest.mark.parametrize("margin", [0.01, 0.1])
@pytest.mark.parametrize(("nudge", "clear"), [(0.0009, True), (0.0011, False), (0.004, False)])
def test_a_nudge_into_the_margin_and_back_is_noticed(margin: float, nudge: float, clear: bool) -> None:
    wall = chords(np.array([(0.301 + margin, -0.05, 0.301 + margin, 0.05)]), np.array([False]), np.zeros(2))
    poses = np.array([(0.0, 0.0, 0.0), (nudge, 0.0, 0.0), (0.0, 0.0, 0.0)])
    assert is_collision_free(poses, wall, NONE, ELL.body, ClearanceLimits(margin, 9.0)) == clear
