"""The paper's perception: what the scan shows is the star."""

import math

import numpy as np
import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.footprint import disc
from drake_starnav.lidar.mounts import Mount
from drake_starnav.paper import choices, perceive
from drake_starnav.paper.blend import smooth_distances
from drake_starnav.paper.star_region import compute_polar_coordinates, fit_boundary, make_range_profile
from drake_starnav.surroundings.perception import PerceptionSettings, PerceptionState
from drake_starnav.worlds import World
from tests.helpers.scans import MARGINS, RADIUS, cast, scattered

SETTINGS = PerceptionSettings(MARGINS, disc(RADIUS))


@pytest.mark.parametrize("reach", [math.inf, 2.0])
def test_each_beam_counts_alone(reach: float) -> None:
    scan = cast(scattered(np.random.default_rng(1)))
    samples, limit, *_ = make_range_profile(scan, scan.distances, RADIUS, reach)
    np.testing.assert_allclose(samples[::2], np.clip(scan.distances, 0.0, min(5.0, reach)))
    np.testing.assert_allclose(limit, min(5.0, reach))


def test_the_region_is_as_far_as_the_beams_see() -> None:
    pose = np.array((0.3, -0.2, 0.7))
    scan = cast(World("box", (0, 0, 0), (1, 0), bounds=(-1.5, -1.2, 1.4, 1.3)), pose)
    region = perceive(PerceptionState.initial(), (scan,), pose, SETTINGS).observation.region
    assert region is not None and region.margin == 0.0
    assert (
        np.abs(region.phi(pose[2] + scan.bearings) - scan.distances).max() < choices.JUMP
    )  # larger steps begin a cubic


def test_nothing_is_certified_but_hits_and_times_are_kept() -> None:
    pose = np.zeros(3)
    world = World("posts", (0, 0, 0), (3, 0), cylinders=[(0.8, 0.2, 0.1), (3.5, -0.5, 0.2), (-5.4, 0.0, 0.2)])
    scan = cast(world, pose, range_max=8.0)
    seen = perceive(PerceptionState.initial(), (scan,), pose, SETTINGS)
    surroundings = seen.surroundings
    assert not surroundings.has_views and not surroundings.certified_star.values.any()
    assert surroundings.time == scan.time
    distance = np.sort(smooth_distances(scan)[scan.hits])
    near = distance[distance < choices.RANGE]
    np.testing.assert_allclose(np.sort(np.hypot(*surroundings.recent_hits.hits.points.T)), near)


def test_points_are_as_far_and_where_the_lidar_sees_them() -> None:
    theta, distance = compute_polar_coordinates(np.array([(1.0, 3.0), (-1.0, 2.0)]), np.array((1.0, 2.0)))
    np.testing.assert_allclose((theta, distance), ((0.5 * math.pi, math.pi), (1.0, 2.0)))


def test_cubics_follow_the_slope() -> None:
    theta = 2.0 * math.pi / 360 * np.arange(360)
    box = 1.5 / np.maximum(np.abs(np.cos(theta)), np.abs(np.sin(theta)))
    fit = fit_boundary(box)
    assert np.abs(fit.values - box).max() < 1e-3
    assert 8 <= len(fit.starts) <= 90
    assert len(fit_boundary(np.full(360, 2.0)).starts) == 1


def test_a_lidar_off_the_axis_is_refused() -> None:
    scan, settings = cast(World("open", (0, 0, 0), (1, 0))), SETTINGS._replace(mounts=(Mount(0.1, 0.0, 0.0, False),))
    with pytest.raises(StarnavError, match="off the axis; allowed: one on the axis"):
        perceive(PerceptionState.initial(), (scan,), np.zeros(3), settings)
