"""Points aligned with lines through other points."""

import math

import numpy as np
import pytest
from hypothesis import given, settings

from drake_starnav.geometry.se2 import inverse, now_in, placed
from drake_starnav.localization.icp import Surfaces, aligned
from drake_starnav.worlds.world import World
from tests.helpers.scans import cast, scattered, seeds

BOX = World("box", (0, 0, 0), (0, 0), bounds=(-3.0, -2.0, 3.0, 2.0))


def found(scan, points, guess, deviation, gate=0.3):
    return aligned(points, guess, np.full(3, 1.0 / deviation**2), Surfaces.of(scan, 0.1), 0.01, gate, 0.1)


def test_lines_follow_walls_but_no_corner() -> None:
    scan = cast(BOX)
    points, anchor, normal, *_ = Surfaces.of(scan, 0.1)
    on_line = np.hypot(*normal.T) > 0.5
    assert on_line.mean() > 0.95
    away = ((points - anchor) * normal).sum(axis=1)
    assert np.abs(away[on_line]).max() < 0.01
    axis = np.abs(normal[on_line]).max(axis=1)
    corner = np.hypot(*(np.abs(points[on_line]) - (3.0, 2.0)).T) < 0.4
    assert axis[~corner] == pytest.approx(1.0)
    assert not on_line[np.hypot(*(np.abs(points) - (3.0, 2.0)).T) < 0.02].any()


@given(seeds)
@settings(max_examples=15)
def test_aligned_points_return_the_pose(seed):
    rng = np.random.default_rng(seed)
    world = scattered(rng)
    pose = np.array((*rng.uniform(-0.15, 0.15, 2), rng.uniform(-0.1, 0.1)))
    points = cast(world, pose).points()
    guess = pose + np.array((*rng.uniform(-0.1, 0.1, 2), rng.uniform(-0.05, 0.05)))
    off = now_in(pose, found(cast(world), points, guess, 0.1)[0])
    assert math.hypot(*off[:2]) < 0.01 and abs(off[2]) < math.radians(0.5)


def test_certain_guess_is_kept() -> None:
    scan, pose = cast(BOX), np.array((0.1, -0.05, 0.05))
    points, guess = cast(BOX, pose).points(), np.zeros(3)
    assert found(scan, points, guess, 1e-9)[0] == pytest.approx(guess, abs=1e-6)
    right = found(scan, points, guess, 0.1)
    assert right[0] == pytest.approx(pose, abs=2e-3) and right[1] > 0.95 * len(points)
    elsewhere = placed(inverse(pose), np.array([(x, 0.1 * x) for x in np.linspace(-1.5, 1.5, 50)]))
    assert found(scan, elsewhere, pose, 0.1)[1] == 0
