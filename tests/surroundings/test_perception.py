"""Perception of one scan; `tests/systems/test_star_perception.py` follows many of them."""

import dataclasses
import functools
import math

import numpy as np

from drake_starnav.geometry.footprint import disc
from drake_starnav.lidar import LaserScan
from drake_starnav.lidar.mounts import Mount
from drake_starnav.lidar.outlier_filter import remove_outliers
from drake_starnav.planning import PlannerParameters
from drake_starnav.surroundings import make_scan_region
from drake_starnav.surroundings.perception import PerceptionSettings, PerceptionState, perceive
from drake_starnav.surroundings.view import ViewParams, carry_view, make_view
from drake_starnav.worlds import World
from tests.helpers.scans import MARGINS, cast

RADIUS, PLANNER = 0.25, PlannerParameters()
SETTINGS = PerceptionSettings(MARGINS, disc(RADIUS))
POST = World("post", (0.0, 0.0, 0.0), (5.0, 0.0), cylinders=[(1.5, 0.2, 0.3)])
POSES = np.array([(0.0, 0.0, 0.3), (0.2, 0.05, 0.4)])


def looks(*poses: np.ndarray) -> list[PerceptionState]:
    """Perception's state after each scan of `POST` from these poses."""
    known = [PerceptionState.initial()]
    for number, pose in enumerate(poses):
        scan = dataclasses.replace(cast(POST, pose), time=0.1 * number)
        known.append(perceive(known[-1], (scan,), pose, SETTINGS))
    return known[1:]


def test_the_region_is_that_of_the_scan_and_the_star_also_of_the_one_before() -> None:
    first, second = looks(*POSES)
    assert first.observation.region is not None and second.observation.region is not None
    expected = make_scan_region(second.observation.scan, POSES[1], RADIUS, MARGINS)
    assert np.array_equal(second.observation.region.boundary.values, expected.boundary.values)
    assert (first.surroundings.time, second.surroundings.time, second.surroundings.previous_time) == (0.0, 0.1, 0.0)
    (alone,) = looks(POSES[1])
    assert len(second.surroundings.recent_hits.hits.points) > len(alone.surroundings.recent_hits.hits.points)
    assert (second.surroundings.certified_star.values <= alone.surroundings.certified_star.values + 1e-12).all()


def test_the_number_of_beams_may_vary_from_scan_to_scan() -> None:
    known, free = PerceptionState.initial(), []
    for number, beams in enumerate((450, 455, 449, 456)):
        scan = cast(POST, POSES[0], beams=beams, angle_min=0.0, angle_increment=2.0 * math.pi / (beams - 1))
        known = perceive(known, (dataclasses.replace(scan, time=0.1 * number),), POSES[0], SETTINGS)
        free.append(known.observation.region.free_range)
    assert {len(samples) for samples in free} == {898}
    assert max(np.abs(samples - free[0]).mean() for samples in free) < 0.03


def test_the_region_of_a_limited_view_ends_at_what_was_hit_beside_the_view() -> None:
    """Rays along the edge of a view tell nothing of what stands beside them: the robot is as wide on both sides."""
    post, view = np.array((1.0, 0.0)), math.radians(135.0)
    world = World("post", (0.0, 0.0, 0.0), (5.0, 0.0), cylinders=[(*post, 0.05)])
    state = PerceptionState.initial()
    for number, turned in enumerate((0.0, -view - 0.1)):  # the post is 0.1 rad beside the view at last
        pose = np.array((0.0, 0.0, turned))
        scan = cast(world, pose, beams=541, angle_min=-view, angle_increment=view / 270)
        state = perceive(state, (dataclasses.replace(scan, time=0.1 * number),), pose, SETTINGS)
    region = state.observation.region
    assert region is not None
    assert not state.observation.scan.hits.any() and len(state.observation.past_hits)
    again = state.observation.refit(RADIUS, MARGINS).region
    assert again is not None and np.array_equal(again.free_range, region.free_range)
    wider = state.observation.refit(RADIUS + 0.05, MARGINS).region
    assert wider is not None and wider.free_range.sum() < region.free_range.sum()
    around = 0.05 + RADIUS - 0.01
    ring = post + around * np.column_stack((np.cos(np.linspace(0, 6.28, 99)), np.sin(np.linspace(0, 6.28, 99))))
    assert not region.contains(ring).any()
    assert region.contains(np.array((0.0, -2.0)))


def test_a_lidar_on_the_axis_is_not_merged_with_what_it_saw_before() -> None:
    for view in (math.pi, math.radians(135.0), math.radians(90.0)):
        scan = cast(POST, POSES[0], beams=361, angle_min=-view, angle_increment=2.0 * view / 360)
        state = perceive(PerceptionState.initial(), (scan,), POSES[0], SETTINGS)
        again = perceive(state, (dataclasses.replace(scan, time=0.1),), POSES[0], SETTINGS).observation
        assert np.array_equal(again.scan.ranges, scan.ranges, equal_nan=True)
        assert again.region is not None
        expected = make_scan_region(again.scan, POSES[0], RADIUS, MARGINS)
        assert np.array_equal(again.region.free_range, expected.free_range)


def test_a_view_is_carried_with_its_confirmed_scan() -> None:
    ranges = np.full(360, 2.0)
    ranges[90] = 0.8  # a lone hit, which nothing confirms
    scan = LaserScan(0.0, -math.pi, math.radians(1.0), 0.0, 5.0, ranges)
    params = ViewParams(disc(RADIUS), filter_scan=functools.partial(remove_outliers, noise=0.01))
    view = make_view(scan, Mount(0.1, 0.0, 0.0, False), np.zeros(3), None, params)
    assert view.confirmed_scan is not view.scan
    carried = carry_view(view, np.array((0.05, 0.0, 0.1)), 0.1)
    assert carried.time == carried.scan.time == carried.confirmed_scan.time == 0.1
