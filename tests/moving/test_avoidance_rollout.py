"""A simulated motion among discs: its desired twists, where it brakes, and what it costs."""

import math

import numpy as np
import pytest

from drake_starnav.moving.avoidance import (
    CONTACT_COST,
    DRIVE_IN_DIRECTION,
    FOLLOW_PATH,
    KEEP_VELOCITY,
    MANOEUVRE,
    STEP,
    WALL_COST,
    WALL_ZONE,
    Movers,
    Scene,
    choose_velocity,
    compute_time_to_escape,
    compute_times_along,
    continue_rollout,
    make_initial_rollout,
    measure_clearance,
    predict_discs,
)
from drake_starnav.moving.certificate import MOVING_MARGIN
from drake_starnav.moving.prediction import PREDICTION_STEP
from drake_starnav.robot import Limits
from drake_starnav.surroundings.certified_star import CertifiedStar
from drake_starnav.surroundings.star_region import make_scan_region, unite_regions
from drake_starnav.worlds.world import World
from tests.helpers.scans import MARGINS, cast

LIMITS = Limits(0.8, 2.0, 1.0, 1.0, 4.0)
BASES = {
    "differential": LIMITS,
    "omnidirectional": LIMITS._replace(holonomic=1.0),
    "car": LIMITS._replace(steers=1.0),  # on circles of 0.5 m
}
LINE = np.array(((0.0, 0.0), (2.0, 0.0)))
RADIUS = 0.25
SPACING = RADIUS * MOVING_MARGIN
NO_HITS = np.zeros((0, 2))
DISC_RADIUS = 0.3


def scene(*places: tuple[float, float], limits: Limits = LIMITS) -> Scene:
    """Discs of 0.3 m that stay where they are, on an empty floor that is seen 5 m far."""
    world = World("empty", (0.0, 0.0, 0.0), (2.0, 0.0), bounds=(-4.0, -4.0, 4.0, 4.0))
    regions = unite_regions([make_scan_region(cast(world), np.zeros(3), 0.25, MARGINS)])
    position = np.array(places, float).reshape(-1, 2)
    still = np.zeros_like(position)
    radius = np.full(len(places), DISC_RADIUS)
    trajectory = np.repeat(position[:, None], 60, 1)
    movers = Movers(position, still, radius, trajectory, NO_HITS, 0.0, SPACING, caution=0.5, max_speed=0.0)
    star, times_left = CertifiedStar.none().union, compute_times_along(LINE, limits)
    return Scene(LINE, times_left, regions, star, NO_HITS, movers, limits, RADIUS, slowdown=1.2)


def begin(v: float = 0.0, limits: Limits = LIMITS) -> np.ndarray:
    twist = (v, 0.0, 0.0) if limits.holonomic else (v, 0.0)
    return make_initial_rollout(np.zeros(3), np.array(twist), scene(limits=limits))


def follow(speed: float = 0.8) -> np.ndarray:
    return np.array([(FOLLOW_PATH, speed, 0.0, 0.0, 0.0, 0.0)], MANOEUVRE)


def keep(ahead: float, aside: float = 0.0, turning: float = 0.0) -> np.ndarray:
    return np.array([(KEEP_VELOCITY, 0.0, 0.0, ahead, aside, turning)], MANOEUVRE)


def head(heading: float, speed: float = 0.8) -> np.ndarray:
    return np.array([(DRIVE_IN_DIRECTION, speed, heading, 0.0, 0.0, 0.0)], MANOEUVRE)


def driven(start: np.ndarray, manoeuvre: np.ndarray, steps: int, among: Scene) -> np.void:
    rollouts = start.copy()
    continue_rollout(start[0], manoeuvre, predict_discs(among, 0.0, steps), among, rollouts)
    return rollouts[0]


@pytest.mark.parametrize("limits", BASES.values(), ids=BASES)
def test_each_manoeuvre_wants_its_velocity(limits: Limits) -> None:
    wants = begin(0.0, limits)[0], LINE, limits, RADIUS, 1.2
    assert choose_velocity(keep(0.3, 0.1, -0.5)[0], *wants) == (0.3, 0.1, -0.5)
    assert choose_velocity(follow()[0], *wants) == pytest.approx((0.8, 0.0, 0.0))
    assert choose_velocity(head(math.pi, -0.8)[0], *wants) == pytest.approx((-0.8, 0.0, 0.0))
    left = choose_velocity(head(0.5 * math.pi)[0], *wants)
    if limits.holonomic:
        assert left[:2] == pytest.approx((0.0, 0.8))
    else:
        assert left.turning == limits.max_yaw_rate and (left.v_x > 0.1) == (limits.steers > 0.0)


@pytest.mark.parametrize("limits", BASES.values(), ids=BASES)
def test_driving_in_a_direction_leads_there_forwards_and_backwards(limits: Limits) -> None:
    steps = 50 if limits.steers else 30
    for speed in (0.8, -0.8):
        for heading in np.arange(-3.0, 3.1, 0.5):
            row = driven(begin(0.0, limits), head(heading, speed), steps, scene(limits=limits))
            course = row["yaw"] + math.atan2(row["aside"], row["ahead"])
            assert math.hypot(row["ahead"], row["aside"]) > 0.5 and math.cos(heading - course) > 0.75


def test_the_clearance_is_that_of_the_nearest_hit_up_to_the_zone_near_walls() -> None:
    rng, among = np.random.default_rng(0), scene()
    for _ in range(200):
        (x, y), reach = rng.uniform(-2.0, 2.0, 2), rng.uniform(0.1, 1.0)
        hits = (x, y) + rng.uniform(-reach, reach, (5, 2))
        expected = np.clip(np.hypot(*(hits - (x, y)).T).min() - RADIUS, 0.0, WALL_ZONE * RADIUS)
        assert measure_clearance(x, y, among._replace(hits=hits)) == pytest.approx(expected)
    assert measure_clearance(0.0, 0.0, among) == pytest.approx(WALL_ZONE * RADIUS)


def test_the_clearance_of_a_base_that_drives_sideways_is_that_of_where_it_is() -> None:
    wall = np.column_stack((np.linspace(-1.0, 1.0, 41), np.full(41, 0.62)))
    beside = scene(limits=BASES["omnidirectional"])._replace(hits=wall)
    start = make_initial_rollout(np.zeros(3), np.zeros(3), beside)
    for steps in (8, 12, 16):
        row = driven(start, keep(0.0, 0.2), steps, beside)
        assert row["clearance"] == pytest.approx(min(0.62 - row["y"] - RADIUS, WALL_ZONE * RADIUS), abs=0.002), steps
    assert row["clearance"] < 0.9 * WALL_ZONE * RADIUS


@pytest.mark.parametrize("limits", BASES.values(), ids=BASES)
def test_among_no_discs_it_follows_the_path_to_its_end(limits: Limits) -> None:
    row = driven(begin(0.0, limits), follow(), 60, scene(limits=limits))
    assert (row["x"], row["y"]) == pytest.approx((2.0, 0.0), abs=0.15)
    assert row["time"] == pytest.approx(60 * STEP) and row["comfort_cost"] == 0.0
    assert row["cost"] < WALL_COST + row["time"]


@pytest.mark.parametrize("limits", BASES.values(), ids=BASES)
@pytest.mark.parametrize("aside", [False, True])
def test_it_brakes_before_a_disc_that_stands_in_its_way(limits: Limits, aside: bool) -> None:
    """Whether that lies ahead of it or, of a base that drives aside, at its left."""
    if aside and not limits.holonomic:
        return
    start = begin(0.0 if aside else 0.4, limits)
    start["aside"] = 0.4 if aside else 0.0
    way = keep(0.0, 0.4) if aside else keep(0.4)
    place = (0.0, 1.2) if aside else (1.2, 0.0)
    row = driven(start, way, 17, scene(place, limits=limits))  # its step is shorter than the margins
    assert math.hypot(row["x"], row["y"]) < 1.2 - 0.3 - RADIUS
    assert math.hypot(row["ahead"], row["aside"]) < 0.05
    assert not row["is_over"] and 0.0 < row["comfort_cost"] < CONTACT_COST


def test_a_contact_ends_it_and_costs_more_the_sooner_it_comes() -> None:
    costs = []
    for x in (0.6, 0.9):
        row = driven(begin(0.8), keep(0.8), 30, scene((x, 0.0)))
        assert row["is_over"]
        costs.append(row["comfort_cost"])
    assert costs[0] > costs[1] > CONTACT_COST


@pytest.mark.parametrize("limits", BASES.values(), ids=BASES)
@pytest.mark.parametrize("speed", [0.5, 2.0])
def test_who_stands_is_at_risk_as_far_as_a_disc_comes_before_it_is_out_of_the_way(speed: float, limits: Limits) -> None:
    """Beside the course of a disc that, as predicted, will not come: more where it is nearer, or comes this way."""

    def risk(gap: float, velocity: tuple[float, float]) -> float:
        among = scene((0.0, RADIUS + DISC_RADIUS + gap), limits=limits)
        moves = among.movers.trajectory + PREDICTION_STEP * np.arange(60)[None, :, None] * np.array(velocity)
        among = among._replace(movers=among.movers._replace(trajectory=moves))
        return float(driven(begin(0.0, limits), keep(0.0), 1, among)["risk"])

    reach = speed * compute_time_to_escape(RADIUS + DISC_RADIUS, limits)
    gaps = np.array((0.1, 0.3, 0.6, 0.9)) * reach
    passing = [risk(gap, (speed, 0.0)) for gap in gaps]
    assert passing == sorted(passing, reverse=True) and passing[-1] > 0.0
    assert risk(gaps[1], (0.0, -speed)) > passing[1] > risk(gaps[1], (0.0, speed))
    assert risk(1.2 * reach, (speed, 0.0)) == risk(gaps[0], (0.0, 0.0)) == 0.0


def test_who_turns_slowly_or_drives_off_slowly_needs_longer_to_escape() -> None:
    times = [compute_time_to_escape(0.5, limits) for limits in (BASES["omnidirectional"], LIMITS)]
    slow = [LIMITS._replace(max_yaw_rate=0.5), LIMITS._replace(max_acceleration=0.3, max_deceleration=0.3)]
    assert times[0] == pytest.approx((0.5 + 0.32) / 0.8)
    assert times[0] < times[1] < min(compute_time_to_escape(0.5, limits) for limits in slow)
