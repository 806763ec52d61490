"""The paper's perception: what the scan shows is the star."""

import math

import numpy as np
import pytest

from drake_starnav.baselines.paper import constants
from drake_starnav.baselines.paper.perception import TOLERANCE, perceive, sight_range
from drake_starnav.geometry.footprint import disc
from drake_starnav.surroundings.perception import Perceived, PerceptionSettings
from drake_starnav.worlds import World
from tests.helpers.scans import MARGINS, RADIUS, cast, scattered

SETTINGS = PerceptionSettings(MARGINS, disc(RADIUS))


@pytest.mark.parametrize(("reach", "less"), [(math.inf, 0.0), (math.inf, 0.25), (2.0, 0.0)])
def test_each_beam_counts_alone(reach: float, less: float) -> None:
    scan = cast(scattered(np.random.default_rng(1)))
    samples, limit, *_ = sight_range(scan, scan.distances, RADIUS, reach, less)
    np.testing.assert_allclose(samples[::2], np.clip(scan.distances - less, 0.0, min(5.0, reach) - less))
    np.testing.assert_allclose(limit, min(5.0, reach) - less)


def test_the_region_is_as_far_as_the_beams_see() -> None:
    pose = np.array((0.3, -0.2, 0.7))
    scan = cast(World("box", (0, 0, 0), (1, 0), bounds=(-1.5, -1.2, 1.4, 1.3)), pose)
    region = perceive(Perceived.nothing(), (scan,), pose, SETTINGS).observation.region
    assert region is not None and region.margin == 0.0
    assert np.abs(region.phi(pose[2] + scan.bearings) - scan.distances).max() < TOLERANCE * RADIUS


def test_nothing_is_certified_but_hits_and_times_are_kept() -> None:
    pose = np.zeros(3)
    world = World("posts", (0, 0, 0), (3, 0), cylinders=[(0.8, 0.2, 0.1), (3.5, -0.5, 0.2), (-5.4, 0.0, 0.2)])
    scan = cast(world, pose, range_max=8.0)
    seen = perceive(Perceived.nothing(), (scan,), pose, SETTINGS)
    assert not seen.safety.seen and not seen.safety.values.any() and seen.safety.time == scan.time
    distance = np.sort(scan.distances[scan.hits])
    near = distance[distance < constants.RANGE]
    np.testing.assert_allclose(np.sort(np.hypot(*seen.safety.near_hits.T)), near)
    assert len(near) < len(distance)
