"""What is too large to move, and what only touches it."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.moving.surfaces import find_large_surfaces
from drake_starnav.worlds.world import World
from tests.helpers.scans import cast, seeds
from tests.helpers.scenes import Scene, hall

WIDTH = 1.2
HALF = 3.0


def large(scan: LaserScan, noise: float = 0.01) -> np.ndarray:
    return find_large_surfaces(scan, WIDTH, noise)


def own(scan: LaserScan, pose: np.ndarray, disc: tuple[float, float, float]) -> np.ndarray:
    """Which beams hit a disc, without noise."""
    points = scan.points_at(scan.distances, np.ones(len(scan.ranges), bool), pose)
    return np.abs(np.hypot(points[:, 0] - disc[0], points[:, 1] - disc[1]) - disc[2]) < 0.04


@settings(max_examples=50, deadline=None)
@given(seed=seeds, radius=st.floats(0.15, 0.6), gap=st.sampled_from([0.0, 0.01, 0.05, 0.2]))
def test_a_disc_against_a_wall_is_not_part_of_it(seed: int, radius: float, gap: float) -> None:
    rng = np.random.default_rng(seed)
    disc = (HALF - radius - gap, rng.uniform(-2.0, 2.0), radius)
    scene = Scene(hall(disc, half=HALF), (), lambda t: np.zeros((0, 2)))
    pose = np.array((*rng.uniform(-2.0, 1.5, 2), rng.uniform(-3.0, 3.0)))
    scan = scene.scan(0.0, pose, rng)
    points = scan.points_at(scan.distances, np.ones(360, bool), pose)
    hit = own(scan, pose, disc)
    assert not large(scan)[hit & (points[:, 0] < HALF - 0.1)].any()  # the rest touches the wall


@settings(max_examples=150, deadline=None)
@given(
    seed=seeds,
    radius=st.floats(0.15, 0.5),
    gap=st.floats(0.0, 0.3),
    slant=st.floats(0.0, 1.2),
    away=st.floats(0.9, 9.0),
    beams=st.sampled_from([120, 360, 1000]),
    noise=st.sampled_from([0.0, 0.01]),
)
def test_discs_in_a_row_are_no_wall(seed, radius, gap, slant, away, beams, noise) -> None:
    """Nor where nothing else is in view, nor from so far that the gaps between them cannot be seen."""
    rng = np.random.default_rng(seed)
    along = (2.0 * radius + gap) * np.array((math.sin(slant), math.cos(slant)))
    places = np.array((away + radius, 0.0)) + np.arange(-3, 4)[:, None] * along
    row = World("row", (0, 0, 0), (0, 0), cylinders=[(*place, radius) for place in places], bounds=(-20, -20, 20, 20))
    scan = cast(row, np.array((0.0, 0.0, rng.uniform(-3.0, 3.0))), beams=beams, range_max=10.0)
    ranges = scan.ranges + noise * rng.standard_normal(beams)
    scan = dataclasses.replace(scan, ranges=np.where(scan.hits, np.maximum(ranges, 0.0), np.inf))
    assert scan.hits.any()
    assert not large(scan, noise).any()


def test_walls_are_large_wherever_the_scan_begins() -> None:
    for yaw in np.linspace(-math.pi, math.pi, 9):
        assert large(cast(hall(half=HALF), np.array((0.3, -0.4, yaw)), beams=720)).all()


@pytest.mark.parametrize("noise", [0.01, 0.02, 0.03])
def test_noise_tears_no_wall_to_pieces_and_makes_no_disc_part_of_one(noise: float) -> None:
    disc = (HALF - 0.3, 0.4, 0.3)
    bare, standing = (Scene(hall(*discs, half=HALF), (), lambda t: np.zeros((0, 2)), 720) for discs in ((), (disc,)))
    for seed in range(10):
        rng = np.random.default_rng(seed)
        pose = np.array((0.3, -0.4, rng.uniform(-3.0, 3.0)))
        assert large(bare.scan(0.0, pose, rng, noise), noise).mean() > 0.97
        scan = standing.scan(0.0, pose, rng, noise)
        hit = np.hypot(*(standing.scan(0.0, pose).points(pose) - disc[:2]).T) < 0.3 + 1e-6
        points = scan.points(pose)
        assert hit.sum() > 8
        assert not large(scan, noise)[hit & (points[:, 0] < HALF - 0.15)].any()


@pytest.mark.parametrize("thickness", [0.05, 0.12, 0.4])
def test_the_end_of_a_partition_is_part_of_it(thickness: float) -> None:
    wall = np.array([(0.5, 0.6), (2.5, 0.6), (2.5, 0.6 + thickness), (0.5, 0.6 + thickness)])
    scan = cast(dataclasses.replace(hall(half=4.0), polygons=(wall,)), np.zeros(3))
    points = scan.points_at(scan.distances, np.ones(360, bool), np.zeros(3))
    on_it = (points[:, 0] > 0.49) & (points[:, 0] < 2.0) & (points[:, 1] > 0.59) & (points[:, 1] < 1.01)
    assert on_it.sum() > 10
    assert large(scan)[on_it].all()


@pytest.mark.parametrize("radius", [0.3, 0.6, 0.8, 1.5])
def test_columns_are_large_if_they_are_seen_to_be_wider(radius: float) -> None:
    scan = cast(hall((1.5 + radius, 0.0, radius), half=6.0))
    hit = own(scan, np.zeros(3), (1.5 + radius, 0.0, radius))
    assert (large(scan)[hit] == (radius > 0.7)).mean() > 0.9  # grazing beams are too far apart to belong together


def test_lost_beams_part_nothing() -> None:
    scan = cast(hall(half=2.0))
    lost = np.zeros(360, bool)
    lost[::7] = True
    with_losses = dataclasses.replace(scan, ranges=np.where(lost, np.nan, scan.ranges), lost_beams=True)
    np.testing.assert_array_equal(large(with_losses), ~lost)


def test_a_piece_of_a_wall_between_two_things_is_not_known_to_be_large() -> None:
    world = World("slit", (0, 0, 0), (0, 0), cylinders=[(0.0, 1.0, 0.4), (0.0, -1.0, 0.4)], bounds=(-4, -4, 4, 4))
    scan = cast(world, np.array((-1.5, 0.0, 0.0)))
    assert not large(scan)[np.abs(scan.bearings) < 0.2].any()
