import math

import numpy as np
from hypothesis import given, settings

from drake_starnav.geometry.se2 import transform_points
from drake_starnav.surroundings.bearing_hits import measure_half_chords
from drake_starnav.surroundings.erosion import FreeRange, compute_free_range
from drake_starnav.surroundings.star_region import StarRegion, fit_region, unite_regions
from tests.helpers.scans import MARGINS, RADIUS, cast, scattered, seeds, unit

STEP = 2.0 * math.pi / 720


def seen_from(seed: int) -> tuple[StarRegion, np.ndarray, np.ndarray]:
    """A region in a random world, the hits it was made from, in W, and their half gaps."""
    rng = np.random.default_rng(seed)
    pose = np.array((*rng.uniform(-0.2, 0.2, 2), rng.uniform(-4.0, 4.0)))
    scan = cast(scattered(rng), pose)
    profile = compute_free_range(scan, scan.distances, RADIUS, MARGINS)
    region = fit_region(profile, pose[:2], pose[2] + scan.angle_min)
    return region, scan.points(pose), measure_half_chords(scan.distances, scan.beams)[scan.hits]


@settings(max_examples=20)
@given(seeds)
def test_what_is_nearer_than_phi_is_inside_and_nothing_else(seed):
    region, _, _ = seen_from(seed)
    theta = np.random.default_rng(seed).uniform(-math.pi, math.pi, 200)
    phi = region.phi(theta)
    theta, phi = theta[phi > 0.01], phi[phi > 0.01]
    for share in (0.0, 0.5, 1.0 - 1e-6, 1.0 + 1e-6, 2.0):
        inside = region.contains(region.center + share * phi[:, None] * unit(theta))
        assert (inside == (share < 1.0)).all()


@settings(max_examples=20)
@given(seeds)
def test_phi_is_the_smaller_of_the_samples_beside_a_bearing(seed):
    region, _, _ = seen_from(seed)
    values = region.boundary.values
    for share in (0.01, 0.5, 0.99):
        theta = region.bearing_0 + STEP * (np.arange(720) + share)
        np.testing.assert_array_equal(region.phi(theta), np.minimum(values, np.roll(values, -1)))
    assert region.phi(np.zeros((2, 3))).shape == (2, 3)


@settings(max_examples=30)
@given(seeds)
def test_contained_points_have_the_clearance_that_the_region_states(seed):
    region, hits, gap = seen_from(seed)
    points = region.center + np.random.default_rng(seed).uniform(-3.0, 3.0, (2000, 2))
    inside = region.contains(points)
    assert inside.any() and not inside.all()
    away = np.hypot(*np.moveaxis(points[inside][:, None] - hits, -1, 0))
    assert (away - np.hypot(RADIUS + region.margin, gap)).min() > -1e-9
    assert (np.hypot(*(points[inside] - region.center).T) <= region.reach).all()


def test_where_nothing_was_seen_there_is_no_room():
    region = fit_region(FreeRange(np.zeros(720), np.zeros(720), 0.0, RADIUS), np.ones(2), 0.0)
    assert region.contains(np.ones(2)) and not region.contains(np.array((1.001, 1.0)))
    assert region.phi(0.4) == 0.0


@settings(max_examples=10)
@given(seeds)
def test_a_region_in_another_frame_contains_the_same_points(seed):
    region, _, _ = seen_from(seed)
    rng = np.random.default_rng(seed)
    frame = rng.uniform(-3.0, 3.0, 3)
    points = region.center + rng.uniform(-3.0, 3.0, (500, 2))
    there = transform_points(frame, points)
    union, offset = unite_regions((region,)).transformed(frame), points - region.center
    share = np.hypot(*offset.T) / np.maximum(region.phi(np.arctan2(offset[:, 1], offset[:, 0])), 1e-9)
    away = np.abs(share - 1.0) > 1e-2  # not where rounding decides
    assert np.mean(region.transformed(frame).contains(there[away]) == region.contains(points[away])) > 0.99
    found = union.contains(there[away])
    assert np.mean(found == region.contains(points[away])) > 0.99
