"""Poses between logged poses."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_starnav.geometry.footprint import disc, footprint
from drake_starnav.geometry.trajectory import (
    STUCK_RADIUS,
    STUCK_TIME,
    Motion,
    compute_motion_metrics,
    count_stops,
    find_least_gaps,
    select_samples,
    sum_time_stuck,
)

MOTION = Motion(np.array([1.0, 2.0, 4.0]), np.array([(0.0, 0.0, 3.0), (1.0, -1.0, -3.0), (1.0, 3.0, -3.0)]))
STEP = 0.005


def test_logged_poses_are_met_others_lie_between_and_outside_of_them_it_stands() -> None:
    for time, place in (
        (2.0, (1.0, -1.0)),
        (1.5, (0.5, -0.5)),
        (3.0, (1.0, 1.0)),
        (0.0, (0.0, 0.0)),
        (9.0, (1.0, 3.0)),
    ):
        assert MOTION.at(time)[:2] == pytest.approx(place)
    assert MOTION.duration == 4.0
    assert math.cos(MOTION.at(1.5)[2]) == pytest.approx(-1.0)  # it turns the short way across pi


def test_gaps_are_between_footprints() -> None:
    still, times = np.zeros((2, 3)), np.array([0.0, 1.0])
    passing = np.array([(2.0, 1.0, 0.0), (-2.0, 1.0, 0.0)])
    far = np.full((2, 3), (0.0, -5.0, 0.0))
    footprints = [disc(0.25), disc(0.25), disc(0.5)]
    gaps = find_least_gaps(footprints, [Motion(times, poses) for poses in (still, passing, far)])
    assert gaps == pytest.approx([0.5, 0.5, 4.25], abs=0.02)


DISC = disc(0.25)


def metrics(v, omega, positions=None, clearances=None, body=DISC):
    twists = np.column_stack((v, omega))
    positions = np.cumsum(np.column_stack((v, np.zeros(len(v)))) * STEP, axis=0) if positions is None else positions
    clearances = np.ones(len(v)) if clearances is None else clearances
    return compute_motion_metrics(positions, twists, clearances, time_step=STEP, footprint=body)


def test_steady_driving_is_smooth() -> None:
    found = metrics(np.full(4000, 0.8), np.full(4000, -0.5), clearances=np.linspace(0.1, 0.5, 4000))
    assert found.jerk_mps3 == pytest.approx(0.0, abs=1e-9)
    assert found.yaw_rate_change_radps2 == pytest.approx(0.0, abs=1e-9)
    assert found.twist_energy_m2ps == pytest.approx(20.0 * (0.64 + 0.5 * (0.25 * 0.5) ** 2))
    assert found.mean_clearance_m == pytest.approx(0.3)
    assert (found.stops, found.stuck_s) == (0, 0.0)


@given(amplitude=st.floats(0.05, 0.4), period=st.floats(2.0, 6.0))
def test_of_a_sine(amplitude, period) -> None:
    """v = sin: the root mean square jerk is a w^2/sqrt(2); omega = sin: its mean absolute slope is 2 a w/pi."""
    w = 2.0 * math.pi / period
    sine = amplitude * np.sin(w * np.arange(round(10.0 * period / STEP)) * STEP)
    found = metrics(0.5 + sine, sine)
    assert found.jerk_mps3 == pytest.approx(amplitude * w**2 / math.sqrt(2.0), rel=0.03)
    assert found.yaw_rate_change_radps2 == pytest.approx(2.0 * amplitude * w / math.pi, rel=0.03)


@pytest.mark.parametrize(
    ("v", "count"),
    [
        ([0.0, 0.0, 0.5, 0.5], 0),  # the beginning is no stop
        ([0.0, 0.5, 0.05, 0.5], 0),  # slow is not standing
        ([0.0, 0.5, 0.05, 0.01, 0.0, 0.5], 1),
        ([0.5, 0.0, 0.05, 0.0, 0.05, 0.0], 1),  # creeping is not driving
        ([0.5, 0.0, -0.5, 0.0], 2),
        ([0.5, 0.019, 0.5], 1),
        ([0.5, 0.021, 0.5], 0),
        ([0.101, 0.0], 1),
        ([0.099, 0.0], 0),
        ([], 0),
    ],
)
def test_stops(v, count) -> None:
    assert count_stops(np.abs(v)) == count


def test_a_robot_whose_corners_move_does_not_stop() -> None:
    v, omega = np.repeat((0.8, 0.0), 400), np.repeat((0.0, 1.0), 400)
    bar = footprint(((0.4, -0.2), (0.4, 0.2), (-0.4, 0.2), (-0.4, -0.2)))
    assert [metrics(v, omega, body=body).stops for body in (disc(0.25), bar)] == [1, 0]
    assert metrics(v, 0.0 * omega, body=bar).stops == 1


def test_time_stuck() -> None:
    drive = np.column_stack((np.arange(0.0, 4.0, 0.08), np.zeros(50)))  # 0.8 m/s for 5 s
    stand = np.repeat(drive[-1:], 100, axis=0)  # 10 s
    assert sum_time_stuck(drive, 0.1) == 0.0
    slack = STUCK_RADIUS / 0.8 + 0.1  # the way into the circle counts as well
    assert sum_time_stuck(np.vstack((drive, stand)), 0.1) == pytest.approx(10.0, abs=slack)
    again = np.vstack((drive, stand, drive + drive[-1], stand + drive[-1]))
    assert sum_time_stuck(again, 0.1) == pytest.approx(20.0, abs=2.0 * slack)
    assert sum_time_stuck(np.vstack((drive, stand[: round(0.8 * STUCK_TIME / 0.1)], drive + drive[-1])), 0.1) == 0.0


@pytest.mark.parametrize(("far", "stuck"), [(0.24, 9.9), (0.26, 0.0)])
def test_to_and_fro_near_a_place_is_being_stuck_there(far: float, stuck: float) -> None:
    x = far * (np.arange(100) % 2)
    assert sum_time_stuck(np.column_stack((x, np.zeros(100))), 0.1) == pytest.approx(stuck)


def test_kept_samples_suffice_at_every_time() -> None:
    times = np.linspace(0.0, 8.0, 1601)
    along = np.where(times < 3.0, times**2 / 3.0, np.minimum(3.0, times))  # it stops
    points = np.column_stack((along, 0.4 * np.sin(2.0 * along)))
    kept = select_samples(times, points, 0.02)
    again = np.column_stack([np.interp(times, times[kept], points[kept, k]) for k in (0, 1)])
    assert np.hypot(*(again - points).T).max() <= 0.02
    assert (kept[0], kept[-1]) == (0, 1600) and len(kept) < 40
    assert list(select_samples(times[:1], points[:1], 0.02)) == [0]
