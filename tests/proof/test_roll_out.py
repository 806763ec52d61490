"""The code within the law: how far the samples of a motion that are checked overrate its clearance.

docs/proof.md derives the bound.
"""

import math

import numpy as np
from hypothesis import assume, example, given
from hypothesis import strategies as st

from drake_starnav.control.heading_controller import slides
from drake_starnav.control.motion import Actuation, Motion, roll_out
from drake_starnav.control.parameters import ControllerParameters
from drake_starnav.geometry.footprint import disc
from drake_starnav.parameters import declared
from drake_starnav.robot import Limits, RobotParameters
from drake_starnav.scenario.error_budget import SAMPLED
from drake_starnav.scenario.faults import DriveParameters

FINE = 2e-4
"""Step of the integration that stands for the true motion, s."""
HARDEST_BRAKING = 6.0
"""Robots that brake harder are refused, m/s^2."""
LONGEST_STOP = 5.0
"""The bound is claimed for robots that stand still within this time from full speed and from full turning rate, s."""
STILL = np.zeros(3)


def allowed(section: type, name: str) -> tuple[float, float]:
    """Least and greatest value of a parameter."""
    (field,) = (field for field in declared(section) if field.name == name)
    return field.metadata["low"], field.metadata["high"]


def within(section: type, name: str, low: float = 0.0) -> st.SearchStrategy[float]:
    """Values of a parameter that are allowed, small ones as often as large ones, but none below `low`."""
    least, greatest = allowed(section, name)
    least = max(least, low)
    return st.floats(0.0, 1.0).map(lambda share: least * (greatest / least) ** share)


@st.composite
def cases(draw: st.DrawFn) -> tuple[np.ndarray, np.ndarray, Actuation]:
    """Any twist that a robot within the declared ranges may have, any command that it may get, and the actuation."""
    limits = Limits(
        *(
            draw(within(RobotParameters, name))
            for name in ("max_speed", "max_yaw_rate", "max_acceleration", "max_yaw_acceleration")
        )
    )
    assume(limits.max_acceleration <= HARDEST_BRAKING)
    assume(limits.max_speed <= LONGEST_STOP * limits.max_acceleration)
    assume(limits.max_yaw_rate <= LONGEST_STOP * limits.max_yaw_acceleration)
    shares = draw(st.tuples(*[st.floats(-1.0, 1.0)] * 4))
    twist, target = np.array(shares).reshape(2, 2) * (limits.max_speed, limits.max_yaw_rate)
    hold = 1.0 / draw(within(ControllerParameters, "rate", low=2.0))
    delay = draw(st.just(0.0) | st.floats(*allowed(DriveParameters, "delay")))
    return twist, target, Actuation(limits, disc(draw(within(RobotParameters, "radius", low=0.01))), hold, delay)


def overrating(motion: Motion, limits: Limits) -> float:
    """By how much the least distance of an obstacle to the samples may exceed that to the motion, m, if none is nearer
    to the samples than the radius: chord, bulge and drift of docs/proof.md."""
    x, y, yaw, v, omega, time = motion.samples.T
    step, turn = np.diff(time), np.abs(np.diff(yaw))
    speed, rate = (np.maximum(abs(value[1:]), abs(value[:-1])) for value in (v, omega))
    faster = np.where(np.diff(v) != 0.0, limits.max_acceleration, 0.0)
    turned = np.where(np.diff(omega) != 0.0, limits.max_yaw_acceleration, 0.0) * step**2 / 8.0
    chord = np.hypot(np.diff(x), np.diff(y)).max(initial=0.0)
    aside = speed * rate + faster * (turn + turned)
    bulge = np.where(v[1:] * v[:-1] < 0.0, aside + faster, aside) * step**2 / 8.0
    uneven = faster * turn * step**2 / 12.0 + 2.0 / 3.0 * speed * turned * step
    drift = uneven + 0.5 * speed * step * (turn / math.sqrt(12.0) + turned) ** 2
    short = motion.footprint.radius - math.sqrt(max(motion.footprint.radius**2 - chord**2 / 4.0, 0.0))
    return float(short + bulge.max(initial=0.0) + drift.sum())


def integrated(twist: np.ndarray, target: np.ndarray, actuation: Actuation) -> np.ndarray:
    """(x, y) of the robot from (0, 0) on, while it does exactly what `roll_out` describes, shape (n, 2), m."""
    limits, _, hold, delay, _ = actuation
    rates = np.array((limits.max_acceleration, limits.max_yaw_acceleration))
    change = np.clip(target - twist, -rates * hold, rates * hold)
    time = np.arange(0.0, delay + hold + float((abs(twist + change) / rates).max()) + FINE, FINE)[:, None]
    ramp = rates * np.clip(time - delay, 0.0, hold)
    held = twist + np.clip(target - twist, -ramp, ramp)
    braked = rates * np.clip(time - delay - hold, 0.0, None)
    moving = np.sign(held) * np.clip(abs(held) - braked, 0.0, None)
    middle = 0.5 * (moving[1:] + moving[:-1]) * FINE
    yaw = np.concatenate(([0.0], np.cumsum(middle[:, 1]))) + 0.5 * np.append(middle[:, 1], 0.0)
    steps = middle[:, :1] * np.column_stack((np.cos(yaw[:-1]), np.sin(yaw[:-1])))
    return np.vstack((np.zeros((1, 2)), np.cumsum(steps, axis=0)))


def nearest(path: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Least distance of each point (m, 2) to a path (n, 2), shape (m,)."""
    return np.hypot(*np.moveaxis(path[:, None] - points, -1, 0)).min(axis=0)


@given(cases())
@example((np.array((0.22, 19.0)), np.array((0.2, 18.0)), Actuation(Limits(1.7, 20.0, 4.5, 4.0), disc(0.01), 0.05, 1.0)))
def test_the_budget_covers_what_samples_overrate(case) -> None:
    twist, target, actuation = case
    motion = roll_out(STILL, twist, target, actuation)
    if motion.grips and not slides(*twist, actuation.limits):
        assert overrating(motion, actuation.limits) <= SAMPLED


@given(cases(), st.integers(0, 2**32))
def test_samples_overrate_clearance_by_no_more_than_the_bound(case, seed: int) -> None:
    twist, target, actuation = case
    actuation = actuation._replace(delay=min(actuation.delay, 0.2))  # short enough to integrate finely
    limits, radius = actuation.limits, actuation.footprint.radius
    motion, exact = roll_out(STILL, twist, target, actuation), integrated(twist, target, actuation)
    random = np.random.default_rng(seed)
    away = random.uniform(-math.pi, math.pi, 12)
    points = exact[random.integers(len(exact), size=12)] + radius * np.column_stack((np.cos(away), np.sin(away)))
    seen = nearest(motion.position, points)
    overrated = (seen - nearest(exact, points))[seen >= radius]
    assert overrated.max(initial=0.0) <= overrating(motion, limits) + 1e-6
