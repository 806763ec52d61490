"""Predictive control: what the compiled cost means, and that the certificate holds for each twist it chooses."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_starnav.baselines.sampling_mpc import (
    CHANGE_WEIGHT,
    CLEARANCE_WEIGHT,
    ZONE,
    candidates,
    path_in_sight,
    predictive_twist,
    rollout_costs,
)
from drake_starnav.control import ControllerInputs, ControllerParameters, Proposal
from drake_starnav.control.braking_certificate import StarCertificate
from drake_starnav.control.path_following import followed
from drake_starnav.control.rollout import ARRIVED, CREEP_SPEED, GOAL_SLOWDOWN, heading_loss
from drake_starnav.planning.guidance import PASSED_DISTANCE, Guidance
from drake_starnav.regions.erosion import smoothed_distances
from drake_starnav.regions.perception import SCAN_MEMORY
from drake_starnav.regions.region_union import RegionUnion
from drake_starnav.regions.safe_region import CertifiedRegion, ScanMemory, certified_region
from drake_starnav.regions.star_region import scan_region, united
from drake_starnav.robot import RobotParameters
from drake_starnav.worlds.world import World
from tests.helpers.motions import actuation, certified, limited_twist, starred_twist
from tests.helpers.scans import MARGINS, RADIUS, cast, distance, free_point, in_view, scattered, seeds, smooth_region

ROBOT, PARAMETERS = RobotParameters(), ControllerParameters(kind="mpc")
LIMITS = ROBOT.limits
SPEEDS = np.array(LIMITS[:2])
PERIOD = 1.0 / PARAMETERS.rate
OPEN = CertifiedRegion(np.zeros(2), 0.0, np.full(720, 10.0), np.zeros((0, 2)))
NOWHERE = RegionUnion.none()


def known_from(world: World, pose: np.ndarray, memory: ScanMemory) -> tuple[RegionUnion, CertifiedRegion, ScanMemory]:
    scan = cast(world, pose)
    kept = MARGINS.safety_range + 2.0 * RADIUS, SCAN_MEMORY
    safe = RADIUS + MARGINS.safety
    star, memory = certified_region(memory, scan, smoothed_distances(scan), pose, safe, MARGINS.safety_range, kept)
    return united([scan_region(scan, pose, RADIUS, MARGINS)]), star, memory


def situation(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, RegionUnion, CertifiedRegion]:
    """A pose, a twist and a path of two legs in a random world, and what is known of it there."""
    rng = np.random.default_rng(seed)
    world = scattered(rng, discs=14, walls=8)
    pose = np.array((*free_point(rng, world, RADIUS + 0.02), rng.uniform(-4.0, 4.0)))
    regions, star, _ = known_from(world, pose, ScanMemory())
    path = pose[:2] + rng.uniform(-2.0, 2.0, (2, 2)).cumsum(axis=0)
    return pose, rng.uniform((0.0, -2.0), (0.8, 2.0)), path, regions, star


def plain_cost(candidate, pose, twist, path, arrives, regions, star) -> float:
    """One candidate's cost, written as the module's docstring says it."""
    v_max, omega_max, a, alpha, _ = LIMITS
    line = [pose[:2], *path]
    (x, y, yaw), (v, omega), ahead = pose, twist, 1

    def wrapped(angle):
        return (angle + math.pi) % (2.0 * math.pi) - math.pi

    def clearance(px, py):
        away = np.hypot(*(star.near_hits - (px, py)).T) if len(star.near_hits) else np.array([np.inf])
        return min(max(away.min() - ROBOT.radius, 0.0), ZONE)

    def free(px, py):
        place = np.array([(px, py)])
        return bool(regions.contains(place)[0] or star.alone.contains(place)[0])

    def bearing(start, end):
        return math.atan2(end[1] - start[1], end[0] - start[0])

    def time_to_go():
        points = [np.array((x, y)), *line[ahead:]]
        headings = [bearing(*leg) for leg in zip(points[:-1], points[1:], strict=True)]
        total = sum(np.hypot(*(e - s)) for s, e in zip(points[:-1], points[1:], strict=True)) / v_max
        total += heading_loss(wrapped(headings[0] - yaw), v, omega, LIMITS)
        bends = zip(headings[:-1], headings[1:], strict=True)
        return total + sum(heading_loss(wrapped(late - early), v_max, 0.0, LIMITS) for early, late in bends)

    best, near_walls, c = math.inf, 0.0, clearance(x, y)
    for i in range(15):
        to = line[ahead] - (x, y)
        if i < 3:
            want = np.array(candidate)
        else:
            error = wrapped(bearing((x, y), line[ahead]) - yaw)
            want = np.array((v_max * max(math.cos(error), 0.0) ** 3, np.clip(4.0 * error, -omega_max, omega_max)))
        if arrives and ahead == len(path):
            want[0] = min(want[0], GOAL_SLOWDOWN * np.hypot(*to) + CREEP_SPEED)
        after = np.array((v, omega)) + np.clip(want - (v, omega), (-0.1 * a, -0.1 * alpha), (0.1 * a, 0.1 * alpha))
        ramp = np.abs(after - (v, omega)) / (a, alpha)
        driven, turned = 0.5 * (after + (v, omega)) * ramp + after * (0.1 - ramp)
        v, omega = after
        step = driven * np.array((math.cos(yaw + 0.5 * turned), math.sin(yaw + 0.5 * turned)))
        yaw += turned
        c_next = clearance(x + step[0], y + step[1])
        if free(x + step[0], y + step[1]) and (c_next >= MARGINS.safety or c_next >= c):
            x, y, c = x + step[0], y + step[1], c_next
            near_walls += abs(driven) * (1.0 - c / ZONE) ** 2
            while ahead < len(path):
                before, corner, after_corner = line[ahead - 1 : ahead + 2]
                leg, here = after_corner - corner, np.array((x, y)) - corner
                bend = np.linalg.det(np.array((corner - before, leg)))
                if bend * np.linalg.det(np.array((leg, here))) >= 0.0 and np.hypot(*here) > PASSED_DISTANCE:
                    break
                ahead += 1
        else:
            v = 0.0
        cost = 0.1 * (i + 1) - 1.5 + CLEARANCE_WEIGHT * near_walls / v_max
        if ahead == len(path) and np.hypot(*(line[-1] - (x, y))) < ARRIVED:
            best = min(best, cost)
            break
        if i >= 7:  # the second half of the horizon
            best = min(best, cost + time_to_go())
    return best + CHANGE_WEIGHT * np.sum(np.abs(np.array(candidate) - twist) / SPEEDS)


def proposed(inputs: ControllerInputs) -> Proposal:
    return predictive_twist(inputs, (StarCertificate(inputs.star),), actuation(ROBOT), MARGINS, ROBOT)


@settings(max_examples=25, deadline=None)
@given(seeds, st.booleans())
def test_the_compiled_cost_is_the_plain_one(seed, arrives):
    pose, twist, path, regions, star = situation(seed)
    twists = candidates(twist, np.array((0.3, 1.0)), ROBOT)[::7]
    inputs = ControllerInputs(pose, twist, Guidance(path, arrives, regions), star)
    cost = rollout_costs(twists, inputs, MARGINS, ROBOT)
    plain = [plain_cost(t, pose, twist, path, arrives, regions, star) for t in twists]
    np.testing.assert_allclose(cost, plain, atol=1e-9)


@settings(max_examples=150, deadline=None)
@given(seeds, st.booleans())
def test_each_twist_is_certified_or_the_one_the_law_would_send(seed, arrives):
    pose, twist, path, regions, star = situation(seed)
    inputs = ControllerInputs(pose, twist, Guidance(path, arrives, regions), star)
    law, chosen = followed(inputs, MARGINS, ROBOT).twist, proposed(inputs).twist
    if not certified(pose, twist, chosen, PERIOD, LIMITS, star):
        np.testing.assert_array_equal(chosen, law)
    elif not np.array_equal(chosen, law):
        assert (chosen == candidates(twist, law, ROBOT)).all(axis=1).any()
    np.testing.assert_array_equal(proposed(inputs).twist, chosen)


@pytest.mark.parametrize("seed", range(6))
def test_it_never_touches_anything_on_the_way_to_places_behind_walls(seed):
    """10 s towards random way points, in sight or not: scans at 25 Hz, commands at 50 Hz."""
    rng = np.random.default_rng(seed)
    world = scattered(rng, discs=14, walls=8)
    pose, twist, memory, driven = np.array((0.0, 0.0, rng.uniform(-4.0, 4.0))), np.zeros(2), ScanMemory(), 0.0
    for k in range(500):
        if k % 2 == 0:
            regions, star, memory = known_from(world, pose, memory)
        if k % 100 == 0:
            path = rng.uniform(-3.0, 3.0, (2, 2))
        desired = proposed(ControllerInputs(pose, twist, Guidance(path, False, regions), star)).twist
        *target, _ = starred_twist(pose, twist, desired, PERIOD, LIMITS, star)
        after = limited_twist(twist, np.array(target), ROBOT, PERIOD)
        v, omega = 0.5 * (twist + after)
        middle = pose[2] + 0.5 * omega * PERIOD
        pose = pose + PERIOD * np.array((v * math.cos(middle), v * math.sin(middle), omega))
        twist = after
        driven += abs(v) * PERIOD
        assert distance(world, pose[None, :2])[0] >= RADIUS
    assert driven > 0.5


@given(st.floats(-3.1, 3.1), st.floats(0.3, 3.0), st.booleans())
def test_in_the_open_it_sets_out_at_once_and_in_the_right_direction(heading, away, arrives):
    path = away * np.array([[math.cos(heading), math.sin(heading)]])
    guidance = Guidance(path, arrives, united([WIDE]))
    v, omega = proposed(ControllerInputs(np.zeros(3), np.zeros(2), guidance, OPEN)).twist
    assert v > 0.0 or omega * heading > 0.0
    assert omega * heading >= 0.0 or abs(heading) < 0.3


WIDE = smooth_region(np.random.default_rng(0), np.zeros(2), mean=8.0)


def test_without_a_path_or_sight_the_law_decides():
    twist = np.array((0.4, 0.1))
    for path in (np.zeros((0, 2)), np.array([[3.0, 1.0]])):
        inputs = ControllerInputs(np.zeros(3), twist, Guidance(path, False, NOWHERE), OPEN)
        np.testing.assert_array_equal(proposed(inputs).twist, followed(inputs, MARGINS, ROBOT).twist)


@given(seeds)
def test_a_hidden_way_point_is_reached_over_a_place_in_sight(seed):
    pose, _, path, regions, _ = situation(seed)
    seen = path_in_sight(pose[:2], path, regions)
    if seen is None:
        assert not in_view(regions, pose[:2], path[0])
        return
    np.testing.assert_array_equal(seen[-2:], path)
    assert in_view(regions, pose[:2], seen[0])
    if len(seen) > 2:
        assert in_view(regions, seen[0], path[0])
        center = regions.center[0]
        over = np.hypot(*(center - pose[:2])) + np.hypot(*(path[0] - center))
        assert np.hypot(*(seen[0] - pose[:2])) + np.hypot(*(path[0] - seen[0])) <= over + 1e-9


def test_heading_loss_is_nothing_at_full_speed_along_the_way_and_grows_with_the_error():
    assert heading_loss(0.0, 0.8, 0.0, LIMITS) == 0.0
    assert heading_loss(0.0, 0.0, 0.0, LIMITS) == pytest.approx(0.4)  # v_max / 2a
    losses = [heading_loss(error, 0.8, 0.0, LIMITS) for error in np.linspace(0.0, math.pi, 20)]
    assert (np.diff(losses) > 0.0).all()


def test_the_laws_twist_comes_first_and_the_lattice_spans_the_limits():
    twists = candidates(np.array((0.5, 0.7)), np.array((0.3, 1.0)), ROBOT)
    np.testing.assert_array_equal(twists[:3], [(0.3, 1.0), (0.5, 0.7), (0.0, 0.7)])
    assert len(twists) == 3 + 5 * 11
    np.testing.assert_allclose(twists[3:].min(axis=0), (0.0, -2.0))
    np.testing.assert_allclose(twists[3:].max(axis=0), (0.8, 2.0))
