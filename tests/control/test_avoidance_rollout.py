"""A simulated motion among discs: its desired twists, where it brakes, and what it costs."""

import math

import numpy as np
import pytest

from drake_starnav.control.avoidance_rollout import (
    CONTACT_COST,
    HAZARD_TIME,
    HEADING,
    PATH,
    TWIST,
    WALL_COST,
    Scene,
    Settings,
    begun,
    drive,
    wanted_velocity,
)
from drake_starnav.control.rollout import COMFORT, STEP, Discs, FreeSpace, foreseen_discs, times_left
from drake_starnav.robot import Limits
from drake_starnav.robot.motion import Pose
from drake_starnav.safety.moving_certificate import MOVING_MARGIN
from drake_starnav.surroundings.safe_region import CertifiedRegion
from drake_starnav.surroundings.star_region import scan_region, united
from drake_starnav.tracking.prediction import PREDICTION_STEP
from drake_starnav.worlds.world import World
from tests.helpers.scans import MARGINS, cast

LIMITS = Limits(0.8, 2.0, 1.0, 4.0)
BASES = {
    "differential": LIMITS,
    "omnidirectional": LIMITS._replace(holonomic=1.0),
    "car": LIMITS._replace(steers=1.0),  # on circles of 0.5 m
}
LINE = np.array(((0.0, 0.0), (2.0, 0.0)))
SETTINGS = Settings(slowdown=1.2, radius=0.25, spacing=0.25 * MOVING_MARGIN, caution=0.5, max_speed=0.0)
NO_HITS = np.zeros((0, 2))


def scene(*places: tuple[float, float], limits: Limits = LIMITS) -> Scene:
    """Discs of 0.3 m that stay where they are, on an empty floor that is seen 5 m far."""
    world = World("empty", (0.0, 0.0, 0.0), (2.0, 0.0), bounds=(-4.0, -4.0, 4.0, 4.0))
    regions = united([scan_region(cast(world), np.zeros(3), 0.25, MARGINS)])
    known = FreeSpace.of(regions, CertifiedRegion.none())
    trajectories = np.repeat(np.array(places, float).reshape(-1, 1, 2), 60, axis=1)
    radius, comfort = np.full(len(places), 0.3), np.full(len(places), COMFORT)
    discs = Discs(trajectories, radius, comfort, np.zeros((0, 2)), 0.0)
    return Scene(LINE, times_left(LINE, limits), known, discs, limits, SETTINGS)


def begin(v: float = 0.0, limits: Limits = LIMITS) -> np.ndarray:
    twist = (v, 0.0, 0.0) if limits.holonomic else (v, 0.0)
    return begun(np.zeros(3), np.array(twist), NO_HITS, SETTINGS.radius)


def driven(start: np.ndarray, way: tuple[float, ...], steps: int, among: Scene) -> np.void:
    rows = start.copy()
    drive(start[0], np.array([way]), foreseen_discs(among.discs, 0.0, steps, SETTINGS), among, np.inf, rows)
    return rows[0]


@pytest.mark.parametrize("limits", BASES.values(), ids=BASES)
def test_each_manoeuvre_wants_its_velocity(limits: Limits) -> None:
    wants = Pose(0.0, 0.0, 0.0), (2.0, 0.0, True), limits, SETTINGS
    assert wanted_velocity((TWIST, 0.3, 0.1, -0.5), *wants) == (0.3, 0.1, -0.5)
    assert wanted_velocity((PATH, 1.0, 0.0, 0.0), *wants) == pytest.approx((0.8, 0.0, 0.0))
    assert wanted_velocity((HEADING, math.pi, -0.8, 0.0), *wants) == pytest.approx((-0.8, 0.0, 0.0))
    left = wanted_velocity((HEADING, 0.5 * math.pi, 0.8, 0.0), *wants)
    if limits.holonomic:
        assert left[:2] == pytest.approx((0.0, 0.8))
    else:
        assert left.turning == limits.max_yaw_rate and (left.ahead > 0.1) == (limits.steers > 0.0)


@pytest.mark.parametrize("limits", BASES.values(), ids=BASES)
def test_driving_in_a_direction_leads_there_forwards_and_backwards(limits: Limits) -> None:
    steps = 50 if limits.steers else 30
    for speed in (0.8, -0.8):
        for heading in np.arange(-3.0, 3.1, 0.5):
            row = driven(begin(0.0, limits), (HEADING, heading, speed, 0.0), steps, scene(limits=limits))
            course = row["yaw"] + math.atan2(row["aside"], row["ahead"])
            assert math.hypot(row["ahead"], row["aside"]) > 0.5 and math.cos(heading - course) > 0.75


@pytest.mark.parametrize("limits", BASES.values(), ids=BASES)
def test_among_no_discs_it_follows_the_path_to_its_end(limits: Limits) -> None:
    row = driven(begin(0.0, limits), (PATH, 1.0, 0.0, 0.0), 60, scene(limits=limits))
    assert (row["x"], row["y"]) == pytest.approx((2.0, 0.0), abs=0.15)
    assert row["spent"] == pytest.approx(60 * STEP) and row["least"] == np.inf and row["lost"] == 0.0
    assert row["cost"] < WALL_COST + row["spent"]


@pytest.mark.parametrize("limits", BASES.values(), ids=BASES)
@pytest.mark.parametrize("aside", [False, True])
def test_it_brakes_before_a_disc_that_stands_in_its_way(limits: Limits, aside: bool) -> None:
    """Whether that lies ahead of it or, of a base that drives aside, at its left."""
    if aside and not limits.holonomic:
        return
    start = begin(0.0 if aside else 0.4, limits)
    start["aside"] = 0.4 if aside else 0.0
    way = (TWIST, 0.0, 0.4, 0.0) if aside else (TWIST, 0.4, 0.0, 0.0)
    place = (0.0, 1.2) if aside else (1.2, 0.0)
    row = driven(start, way, 17, scene(place, limits=limits))  # its step is shorter than the margins
    assert math.hypot(row["x"], row["y"]) < 1.2 - 0.3 - SETTINGS.radius
    assert math.hypot(row["ahead"], row["aside"]) < 0.05
    assert row["ended"] == 0 and 0.0 < row["lost"] < CONTACT_COST


def test_a_contact_ends_it_and_costs_more_the_sooner_it_comes() -> None:
    costs = []
    for x in (0.6, 0.9):
        row = driven(begin(0.8), (TWIST, 0.8, 0.0, 0.0), 30, scene((x, 0.0)))
        assert row["ended"] == 1
        costs.append(row["lost"])
    assert costs[0] > costs[1] > CONTACT_COST


@pytest.mark.parametrize("speed", [0.5, 2.0])
def test_who_stands_is_at_risk_as_far_as_a_disc_comes_before_it_is_out_of_the_way(speed: float) -> None:
    """Beside the course of a disc that, as predicted, will not come: more where it is nearer, or comes this way."""

    def risk(gap: float, velocity: tuple[float, float]) -> float:
        among, times = scene((0.0, SETTINGS.radius + 0.3 + gap)), PREDICTION_STEP * np.arange(60)
        moves = among.discs.trajectories + times[None, :, None] * np.array(velocity)
        among = among._replace(discs=among.discs._replace(trajectories=moves))
        return float(driven(begin(0.0), (TWIST, 0.0, 0.0, 0.0), 1, among)["risk"])

    gaps = np.array((0.1, 0.3, 0.6, 0.9)) * HAZARD_TIME * speed
    passing = [risk(gap, (speed, 0.0)) for gap in gaps]
    assert passing == sorted(passing, reverse=True) and passing[-1] > 0.0
    assert risk(gaps[1], (0.0, -speed)) > passing[1] > risk(gaps[1], (0.0, speed))
    assert risk(1.2 * HAZARD_TIME * speed, (speed, 0.0)) == risk(gaps[0], (0.0, 0.0)) == 0.0


@pytest.mark.parametrize("limits", BASES.values(), ids=BASES)
def test_manoeuvres_that_begin_alike_are_driven_as_if_each_were_alone(limits: Limits) -> None:
    headings = [(HEADING, float(heading), speed, 0.0) for heading in range(-3, 4) for speed in (0.8, -0.8)]
    ways = [(PATH, 1.0, 0.0, 0.0), (TWIST, 0.8, 0.0, 0.0), (PATH, 0.5, 0.0, 0.0), (TWIST, 0.8, 0.0, 0.0), *headings]
    start, among = begin(0.1, limits), scene((0.9, 0.1), limits=limits)
    rows = np.repeat(start, len(ways))
    drive(start[0], np.array(ways), foreseen_discs(among.discs, 0.0, 30, SETTINGS), among, np.inf, rows)
    assert np.array_equal(rows, np.array([driven(start, way, 30, among) for way in ways]))
    assert rows[1] == rows[3] and len({float(row["cost"]) for row in rows}) > len(ways) // 2
