import math

import numpy as np
from hypothesis import given, settings

from drake_starnav.planning.frontiers import ARRIVAL_DISTANCE, PROBE_DISTANCE, Frontiers, edge_frontiers
from drake_starnav.planning.parameters import PlannerParameters
from drake_starnav.regions.erosion import FreeRange
from drake_starnav.regions.star_region import StarRegion, fit_region, scan_region
from tests.helpers.scans import MARGINS, RADIUS, cast, scattered, seeds

PARAMETERS = PlannerParameters()


def polar(region: StarRegion, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    offset = points - region.center
    return np.hypot(*offset.T), np.arctan2(offset[:, 1], offset[:, 0])


def stepped(low: float, high: float, limit: float) -> StarRegion:
    """Range `low` on the first half turn, `high` on the second."""
    return fit_region(FreeRange(np.repeat((low, high), 360), np.full(720, limit), 0.0), np.array((1.0, 2.0)), 0.5)


@settings(max_examples=25)
@given(seeds)
def test_stands_lie_inside_the_region_and_probes_outside(seed):
    rng = np.random.default_rng(seed)
    pose = np.array((*rng.uniform(-0.2, 0.2, 2), rng.uniform(-4.0, 4.0)))
    region = scan_region(cast(scattered(rng, discs=12, walls=6), pose, range_max=2.5), pose, RADIUS, MARGINS)
    found = edge_frontiers(region, 7)
    assert len(found) and (found.owner == 7).all()
    radius, theta = polar(region, found.viewpoint)
    assert radius.min() > ARRIVAL_DISTANCE
    sample = (theta - region.bearing_0) / (2.0 * math.pi / 720)
    np.testing.assert_allclose(sample, np.rint(sample), atol=1e-6)  # on a sample's bearing its value bounds exactly
    assert (radius <= region.boundary.values[np.rint(sample).astype(int) % 720]).all()
    assert not region.contains(found.probe).any()


def test_an_edge_is_lined_with_stands_from_the_near_to_the_far_side():
    region = stepped(1.0, 3.0, 5.0)
    found = edge_frontiers(region, 0)
    radius, theta = polar(region, found.viewpoint)
    first, last = (theta - region.bearing_0) % (2.0 * math.pi) < math.pi + 0.1, theta
    assert len(found) == 2 * 8 and first.sum() == 8  # 1.12, 1.37, ... 2.87 at both jumps
    np.testing.assert_allclose(np.sort(radius)[::2], 1.12 + 0.25 * np.arange(8), atol=1e-9)
    _, across = polar(region, found.probe)
    turned = np.abs((across - last + math.pi) % (2.0 * math.pi) - math.pi)
    step = 2.0 * math.pi / 720  # viewpoints lie one sample off the jump, probes across it
    np.testing.assert_allclose(turned, step + np.maximum(PROBE_DISTANCE / radius, 1.5 * step))


def test_a_step_too_small_for_the_robot_is_no_frontier():
    assert len(edge_frontiers(stepped(1.0, 1.19, 5.0), 0)) == 0
    assert len(edge_frontiers(stepped(1.0, 1.25, 5.0), 0)) == 2


def test_an_arc_without_obstacles_is_lined_with_stands_at_its_rim():
    region = fit_region(FreeRange(np.full(720, 2.0), np.full(720, 2.0), 0.0), np.zeros(2), 0.0)
    found = edge_frontiers(region, 0)
    radius, theta = polar(region, found.viewpoint)
    np.testing.assert_allclose(radius, 1.98)
    np.testing.assert_allclose(np.hypot(*found.probe.T), 2.0 + PROBE_DISTANCE)
    gaps = 2.0 * np.diff(np.sort(theta % (2.0 * math.pi)))
    assert gaps.min() >= 0.25 and gaps.max() < 0.25 + 2.0 * 2.0 * 2.0 * math.pi / 720
    hidden = fit_region(FreeRange(np.full(720, 2.0), np.full(720, 4.0), 0.0), np.zeros(2), 0.0)
    assert len(edge_frontiers(hidden, 0)) == 0


def test_frontiers_join_and_select_in_order():
    a = Frontiers(np.ones((2, 2)), np.zeros((2, 2)), np.array([0, 1]))
    both = a.joined(Frontiers(np.full((1, 2), 3.0), np.full((1, 2), 4.0), np.array([2])))
    assert both.owner.tolist() == [0, 1, 2] and len(Frontiers.none().joined(a)) == 2
    chosen = both.where(np.array([False, True, True]))
    assert chosen.owner.tolist() == [1, 2] and chosen.viewpoint[1].tolist() == [3.0, 3.0]
