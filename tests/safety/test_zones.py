"""Keep-out polygons and speed zones, asked about motions and driven into by a reckless driver."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.polyline import measure_signed_distance
from drake_starnav.robot import RobotParameters
from drake_starnav.robot.motion import roll_out
from drake_starnav.safety.certificates import all_accept
from drake_starnav.safety.shield import find_certified_twist, ramp_twist
from drake_starnav.safety.zones import KeepOut, SpeedZone
from tests.helpers.motions import PERIOD, actuation
from tests.helpers.scans import seeds
from tests.helpers.scenes import moved

ROBOT = RobotParameters()
SQUARE = np.array([(1.0, -0.5), (2.0, -0.5), (2.0, 0.5), (1.0, 0.5)])
ELL = np.array([(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)])


@pytest.mark.parametrize(
    ("place", "distance"),
    [
        ((1.5, 0.5), -0.5),
        ((1.5, 1.5), 0.5),
        ((0.5, 1.9), -0.1),
        ((3.0, 2.0), np.sqrt(2.0)),
        ((0.9, 0.9), -np.sqrt(0.02)),
    ],
)
def test_the_distance_is_negative_inside_in_either_order(place, distance) -> None:
    for polygon in (ELL, ELL[::-1]):
        assert measure_signed_distance(polygon, np.array([place]))[0] == pytest.approx(distance)


def driven(certificate, seed: int, speed: float = 0.8) -> tuple[np.ndarray, np.ndarray]:
    """Places and speeds of a driver who heads for the square at any angle, 8 s."""
    rng, pose, twist, commands = np.random.default_rng(seed), np.zeros(3), np.zeros(2), actuation(ROBOT)
    pose[1], places, speeds = rng.uniform(-0.8, 0.8), [], []
    for k in range(400):
        if k % 25 == 0:
            omega = rng.uniform(-1.0, 1.0)
        target, _ = find_certified_twist(pose, twist, np.array((speed, omega)), (certificate,), commands)
        after = np.array(ramp_twist(twist, target, commands))
        pose, twist = moved(pose, 0.5 * (twist + after), PERIOD), after
        places.append(pose[:2])
        speeds.append(abs(twist[0]))
    return np.array(places), np.array(speeds)


@settings(max_examples=15, deadline=None)
@given(seeds)
def test_a_reckless_driver_stays_out_of_the_polygon(seed) -> None:
    places, speeds = driven(KeepOut(SQUARE), seed)
    assert measure_signed_distance(SQUARE, places).min() >= ROBOT.radius
    assert speeds.max() > 0.5


@settings(max_examples=15, deadline=None)
@given(seeds, st.floats(0.1, 0.6))
def test_a_reckless_driver_is_slow_in_the_zone(seed, limit) -> None:
    places, speeds = driven(SpeedZone(SQUARE, limit), seed)
    inside = measure_signed_distance(SQUARE, places) <= 0.0
    assert not inside.any() or speeds[inside].max() <= limit + 1e-9
    assert speeds.max() > 0.6


def test_one_that_is_too_near_already_may_only_go_away() -> None:
    near, still = np.array((0.9, 0.0, 0.0)), np.zeros(2)
    for target, passes in ((np.array((0.3, 0.0)), False), (np.array((-0.3, 0.0)), True)):
        assert all_accept(roll_out(near, still, target, actuation(ROBOT)), (KeepOut(SQUARE),)) == passes


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (
            lambda: KeepOut(np.zeros((2, 2))),
            r"KeepOut.polygon is \[\[0.0, 0.0\], \[0.0, 0.0\]\]; allowed: three or more \[x, y\]",
        ),
        (lambda: KeepOut(SQUARE * np.nan), r"KeepOut.polygon\[0\] is \[nan, nan\]; allowed: finite \[x, y\]"),
        (lambda: KeepOut(SQUARE, margin=-1.0), "KeepOut.margin is -1.0; allowed: 0 m or more"),
        (lambda: SpeedZone(SQUARE, 0.0), "SpeedZone.max_speed is 0.0; allowed: more than 0 m/s"),
        (lambda: SpeedZone(SQUARE[:, :1], 1.0), r"SpeedZone.polygon\[0\] is \[1.0\]; allowed"),
    ],
)
def test_what_makes_no_zone_is_refused(make, words) -> None:
    with pytest.raises(StarnavError, match=words):
        make()
