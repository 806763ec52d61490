"""A simulated motion among discs: its desired twists, where it brakes, and what it costs."""

import math

import numpy as np
import pytest

from drake_starnav.control.avoidance_rollout import (
    COMFORT,
    CONTACT_COST,
    COST,
    ENDED,
    HEADING,
    LEAST,
    LOST,
    PATH,
    SPENT,
    STEP,
    TWIST,
    WALL_COST,
    Discs,
    Scene,
    Settings,
    V,
    X,
    Y,
    drive,
    start_row,
    wanted_twist,
)
from drake_starnav.control.moving_certificate import MOVING_MARGIN
from drake_starnav.control.rollout import FreeSpace, times_left
from drake_starnav.regions.safe_region import CertifiedRegion
from drake_starnav.regions.star_region import scan_region, united
from drake_starnav.robot import Limits
from drake_starnav.worlds.world import World
from tests.helpers.scans import MARGINS, cast

LIMITS = Limits(0.8, 2.0, 1.0, 4.0)
LINE = np.array(((0.0, 0.0), (2.0, 0.0)))
SETTINGS = Settings(slowdown=1.2, radius=0.25, spacing=MOVING_MARGIN, caution=0.5, max_speed=0.0)
NO_HITS = np.zeros((0, 2))


def scene(*places: tuple[float, float]) -> Scene:
    """Discs of 0.3 m that stay where they are, on an empty floor that is seen 5 m far."""
    world = World("empty", (0.0, 0.0, 0.0), (2.0, 0.0), bounds=(-4.0, -4.0, 4.0, 4.0))
    regions = united([scan_region(cast(world), np.zeros(3), 0.25, MARGINS)])
    known = FreeSpace.of(regions, CertifiedRegion.none())
    trajectories = np.repeat(np.array(places, float).reshape(-1, 1, 2), 60, axis=1)
    radius, comfort = np.full(len(places), 0.3), np.full(len(places), COMFORT)
    discs = Discs(trajectories, radius, comfort, np.zeros((0, 2)), 0.0)
    return Scene(LINE, times_left(LINE, LIMITS), known, discs, LIMITS, SETTINGS)


def begun(v: float = 0.0) -> np.ndarray:
    return start_row(np.zeros(3), np.array((v, 0.0)), NO_HITS, SETTINGS.radius)


def driven(row: np.ndarray, way: tuple[float, float, float], steps: int, among: Scene) -> np.ndarray:
    rows = row[None].copy()
    drive(rows, np.array([way]), steps, among)
    return rows[0]


def test_each_manoeuvre_wants_its_twist() -> None:
    wants = begun(), LINE, LIMITS, SETTINGS
    assert wanted_twist((TWIST, 0.3, -0.5), *wants) == (0.3, -0.5)
    assert wanted_twist((PATH, 1.0, 0.0), *wants) == pytest.approx((0.8, 0.0))
    v, omega = wanted_twist((HEADING, 0.5 * math.pi, 0.8), *wants)
    assert v == pytest.approx(0.0, abs=1e-12) and omega == LIMITS.max_yaw_rate
    backwards = wanted_twist((HEADING, math.pi, -0.8), *wants)
    assert backwards == pytest.approx((-0.8, 0.0))


def test_among_no_discs_it_follows_the_path_to_its_end() -> None:
    row = driven(begun(), (PATH, 1.0, 0.0), 60, scene())
    assert (row[X], row[Y]) == pytest.approx((2.0, 0.0), abs=0.15)
    assert row[SPENT] == pytest.approx(60 * STEP) and row[LEAST] == np.inf and row[LOST] == 0.0
    assert row[COST] < WALL_COST + row[SPENT]


def test_it_brakes_before_a_disc_that_stands_in_its_way() -> None:
    row = driven(begun(0.4), (TWIST, 0.4, 0.0), 17, scene((1.2, 0.0)))  # its step is shorter than the margins
    assert row[X] < 1.2 - 0.3 - SETTINGS.radius and row[V] < 0.05
    assert row[ENDED] == 0.0 and 0.0 < row[LOST] < CONTACT_COST


def test_a_contact_ends_it_and_costs_more_the_sooner_it_comes() -> None:
    costs = []
    for x in (0.6, 0.9):
        row = driven(begun(0.8), (TWIST, 0.8, 0.0), 30, scene((x, 0.0)))
        assert row[ENDED] == 1.0
        costs.append(row[LOST])
    assert costs[0] > costs[1] > CONTACT_COST


def test_rollouts_in_one_array_do_not_meddle_with_each_other() -> None:
    ways = np.array([(PATH, 1.0, 0.0), (TWIST, 0.8, 0.0), (HEADING, 1.0, -0.8)])
    rows = np.array([begun(0.1 * k) for k in range(3)])
    alone = [driven(row, tuple(way), 30, scene((0.9, 0.1))) for row, way in zip(rows, ways, strict=True)]
    drive(rows, ways, 30, scene((0.9, 0.1)))
    assert np.array_equal(rows, np.array(alone))
    assert len({float(row[COST]) for row in rows}) == 3
