"""The paper's perception: what the scan shows, smoothed, is the star."""

import math

import numpy as np
import pytest

from drake_starnav.baselines.paper.perception import RANGE, fit_slopes, perceive, sight_range, smoothed_distances
from drake_starnav.control import ControllerParameters
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.planning import PlannerParameters
from drake_starnav.regions.perception import Perceived, PerceptionSettings
from drake_starnav.utils.stopwatch import Stopwatch
from drake_starnav.worlds import World
from tests.helpers.scans import RADIUS, cast, scattered

SETTINGS = PerceptionSettings(PlannerParameters(), ControllerParameters(kind="star_paper"), RADIUS)


def full_scan(ranges: np.ndarray, range_max: float = 5.0) -> LaserScan:
    return LaserScan(0.0, -math.pi, 2.0 * math.pi / len(ranges), 0.0, range_max, ranges)


def test_ranges_beyond_the_clip_are_no_returns() -> None:
    scan = full_scan(np.linspace(1.0, 3.0, 360))
    distance = smoothed_distances(scan)
    assert (distance[scan.distances > RANGE] == scan.range_max).all()
    assert (distance[scan.distances < RANGE - 0.1] < RANGE).all()
    samples, limit, margin = sight_range(scan, distance, RANGE)
    assert samples.max() == limit.max() == RANGE and margin == 0.0


@pytest.mark.parametrize("radius", [0.0, 0.25])
def test_each_beam_counts_alone(radius: float) -> None:
    scan = cast(scattered(np.random.default_rng(1)))
    samples, limit, _ = sight_range(scan, scan.distances, radius=radius)
    np.testing.assert_allclose(samples[::2], np.maximum(scan.distances - radius, 0.0))
    np.testing.assert_allclose(limit, 5.0 - radius)


def test_smoothing_takes_noise_and_crosses_jumps() -> None:
    rng = np.random.default_rng(1)
    exact = np.repeat((1.0, 1.5), 180)
    smooth = smoothed_distances(full_scan(exact + rng.normal(0.0, 0.01, 360)))
    assert np.std((smooth - exact)[20:160]) < 0.005
    assert 1.1 < smooth[179] < 1.4


def test_the_region_is_as_far_as_the_beams_see() -> None:
    pose = np.array((0.3, -0.2, 0.7))
    scan = cast(World("box", (0, 0, 0), (1, 0), bounds=(-1.5, -1.2, 1.4, 1.3)), pose)
    seen = perceive(Perceived.nothing(), scan, pose, SETTINGS)
    region = seen.observation.region
    assert region is not None and region.margin == 0.0
    near = scan.distances < RANGE
    fitted = region.phi(pose[2] + scan.bearings[near])
    assert np.median(np.abs(fitted - scan.distances[near])) < 0.02


def test_nothing_is_certified_but_near_hits_and_times_are_kept() -> None:
    pose = np.zeros(3)
    scan = cast(World("post", (0, 0, 0), (3, 0), cylinders=[(0.8, 0.2, 0.1), (1.5, -0.5, 0.2)]), pose)
    stopwatch = Stopwatch()
    seen = perceive(Perceived.nothing(), scan, pose, SETTINGS, stopwatch)
    assert not seen.safety.seen and not seen.safety.values.any() and seen.safety.time == scan.time
    assert len(seen.safety.near_hits) and np.hypot(*seen.safety.near_hits.T).max() < 1.0
    assert len(stopwatch.seconds["scan"]) == 1


def test_segments_begin_where_the_boundary_turns() -> None:
    samples = np.concatenate((np.full(360, 2.0), 2.0 + 0.05 * np.arange(180), 11.0 - 0.05 * np.arange(180)))
    fit = fit_slopes(samples)
    assert fit.starts.tolist() == [0, 361, 541]
    np.testing.assert_allclose(fit.values, samples, atol=0.05)
