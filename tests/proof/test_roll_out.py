"""The code within the law: how far the samples of a motion that are checked overrate its clearance.

docs/proof.md derives the bound.
"""

import math
from dataclasses import replace

import numpy as np
from hypothesis import assume, example, given
from hypothesis import strategies as st

from drake_starnav.control.parameters import ControllerParameters
from drake_starnav.geometry.footprint import LEAST_SIZE, Footprint, disc, footprint
from drake_starnav.navigation.validation import HARDEST_BRAKING, QUICKEST_LOCK, TIGHTEST_CIRCLE
from drake_starnav.parameters import declared
from drake_starnav.robot import BASES, Limits, RobotParameters
from drake_starnav.robot.motion import Actuation, Motion, is_sliding, roll_out
from drake_starnav.scenario.schema import DriveParameters
from tests.helpers.motions import exact_poses, exact_rates, turned

LONGEST_STOP = 5.0
"""The bound is claimed for robots that stand still within this time from full speed and from full turning rate, s."""
STRAYING, STRAYING_TIME, STRAYING_HEADING = 0.003, 0.00375, 0.01
"""What the margin has for a base of the shipped kind beside half the sampling: so far, m, but no more than full speed
takes it in this time, s, and for each metre of a lever."""
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


def _rectangle(lever: float, slenderness: float) -> Footprint:
    x = lever / math.hypot(1.0, slenderness)
    y = max(lever / math.hypot(1.0, 1.0 / slenderness), 0.5 * LEAST_SIZE + 1e-6)
    return footprint(((x, y), (-x, y), (-x, -y), (x, -y)))


@st.composite
def cases(draw: st.DrawFn) -> tuple[np.ndarray, np.ndarray, Actuation]:
    """Any twist that a robot within the declared ranges may have, any command that it may get, and the actuation."""
    drawn = {
        name: draw(within(RobotParameters, name))
        for name in ("max_speed", "max_yaw_rate", "max_acceleration", "max_yaw_acceleration", "least_radius")
    }
    drawn["max_deceleration"] = draw(st.just(0.0) | within(RobotParameters, "max_deceleration", low=0.01))
    robot = RobotParameters(base=draw(st.sampled_from(list(BASES))), **drawn)
    assume(max(robot.max_acceleration, robot.max_deceleration) <= HARDEST_BRAKING)
    assume(robot.max_speed <= LONGEST_STOP * robot.limits.max_deceleration)
    limits, count = robot.limits, len(robot.drive.components)
    size = draw(within(RobotParameters, "radius", low=0.01))
    if limits.steers:
        assume(robot.least_radius >= max(TIGHTEST_CIRCLE, 0.5 * size))
        assume(2.0 * limits.max_yaw_rate >= QUICKEST_LOCK * limits.max_yaw_acceleration)
    else:
        assume(robot.max_yaw_rate <= LONGEST_STOP * robot.max_yaw_acceleration)
    shares = draw(st.tuples(*[st.floats(-1.0, 1.0)] * (2 * count)))
    most = (limits.max_speed,) * (count - 1) + (limits.max_yaw_rate,)
    twist, target = (robot.drive.saturate(row, limits) for row in np.array(shares).reshape(2, count) * most)
    hold = 1.0 / draw(within(ControllerParameters, "rate", low=2.0))
    round = robot.drive.turns_on_the_spot and draw(st.booleans())
    shape = disc(size) if round else _rectangle(size, draw(st.floats(0.2, 1.0)))
    return twist, target, Actuation(limits, shape, hold, draw(_delays(robot.base)), robot.drive)


def _delays(base: str) -> st.SearchStrategy[float]:
    """Of drives: other bases than the differential one may have none, but for that of the controller's period."""
    return st.just(0.0) | (st.floats(*allowed(DriveParameters, "delay")) if base == "differential" else st.just(0.02))


def overrating(motion: Motion, twist: np.ndarray, target: np.ndarray, actuation: Actuation) -> float:
    """By how much the least distance of an obstacle to the samples may exceed that to the motion, m: chord, bulge and
    drift of docs/proof.md. Of discs, if none is nearer to the samples' centres than the radius; of polygons, if none
    is nearer to the samples than the least margin."""
    limits, lever, position, time = actuation.limits, motion.footprint.lever, motion.position, motion.time
    step, turn = np.diff(time), np.abs(np.diff(motion.pose[:, 2]))
    velocity, turning, bend = exact_rates(time, twist, target, actuation)
    speed, rate = (np.maximum(size[1:], size[:-1]) for size in (np.hypot(*velocity.T), abs(turning)))
    change = np.hypot(*np.diff(velocity, axis=0).T)
    sped = np.maximum(
        *(ahead_of_mean(change, most, step) for most in (limits.max_acceleration, limits.max_deceleration))
    )
    if limits.steers:
        bent, largest = abs(np.diff(bend)), np.maximum(abs(bend[1:]), abs(bend[:-1]))
        lost = bent * change * step / 9.0  # what the means of curvature and speed miss of the turn
        turned = speed * ahead_of_mean(bent, limits.max_yaw_acceleration, step) + largest * sped + lost
    else:
        lost = np.zeros(len(step))
        turned = ahead_of_mean(abs(np.diff(turning)), limits.max_yaw_acceleration, step)
    chord = (np.hypot(*np.diff(position, axis=0).T) + lever * turn).max(initial=0.0)
    kept = _kept(actuation)
    short = kept - math.sqrt(max(kept**2 - chord**2 / 4.0, 0.0))
    across = actuation.base.holonomic | (motion.twist[1:, 0] * motion.twist[:-1, 0] < 0.0)
    bulge = speed * step * (rate * step / 8.0 + turned / 2.0) + sped * (across + turn + turned)
    bulge += lever * (turn**2 / 8.0 + turned)
    shortened = turn**2 / 24.0
    extent = np.hypot(*(position - position[0]).T).max()
    arcs = min(float((shortened * speed * step).sum()), extent * float(shortened[-1] + abs(np.diff(shortened)).sum()))
    drift = 2.0 / 3.0 * (sped * rate * step + speed * turned * step) + speed * step * turned * (
        turn / 3.4 + turned / 2.0
    )
    astray = np.cumsum(lost)
    drift += astray * speed * step
    way = ((speed + lever * rate) * step).max()  # of any point: half of it leads to a sample
    return float(min(short + bulge.max(), 0.5 * way) + drift.sum() + arcs + lever * astray[-1])


def ahead_of_mean(change: np.ndarray, fastest: float, step: np.ndarray) -> np.ndarray:
    """How far the integral of a value gets from that of its mean within a step, if it ramps by a change at once."""
    share = np.minimum(change / (fastest * step), 1.0)
    return 0.5 * change * step * share * (1.0 - 0.5 * share) ** 2


def _kept(actuation: Actuation) -> float:
    """From the samples' centres of a disc, or from the samples of polygons, no obstacle is nearer, m."""
    shape, straying = actuation.footprint, min(STRAYING, STRAYING_TIME * actuation.limits.max_speed)
    return shape.radius if shape.is_disc else 0.5 * shape.sampling + straying + STRAYING_HEADING * shape.lever


def nearest(poses: np.ndarray, points: np.ndarray, shape: Footprint) -> np.ndarray:
    """Least distance of each point (m, 2) to a footprint at poses (n, 3), or to the centre of a disc, shape (m,)."""
    dx, dy = np.moveaxis(points - poses[:, None, :2], -1, 0)
    if shape.is_disc:
        return np.hypot(dx, dy).min(axis=0)
    cosine, sine = np.cos(poses[:, 2:]), np.sin(poses[:, 2:])
    half = abs(shape.parts[0]).max(axis=0)
    ahead, left = abs(cosine * dx + sine * dy) - half[0], abs(cosine * dy - sine * dx) - half[1]
    return np.hypot(np.maximum(ahead, 0.0), np.maximum(left, 0.0)).min(axis=0)


@given(cases())
@example(
    (np.array((0.22, 19.0)), np.array((0.2, 18.0)), Actuation(Limits(1.7, 20.0, 4.5, 4.5, 4.0), disc(0.01), 0.05, 1.0))
)
def test_the_budget_covers_what_samples_overrate(case) -> None:
    twist, target, actuation = case
    motion = roll_out(STILL, twist, target, actuation)
    if motion.grips and not is_sliding(*actuation.base.body_rates(twist), actuation.limits):
        assert overrating(motion, twist, target, actuation) <= 0.5 * actuation.footprint.sampling


@given(cases(), st.integers(0, 2**32))
def test_samples_overrate_clearance_by_no_more_than_the_bound(case, seed: int) -> None:
    twist, target, actuation = case
    actuation = replace(actuation, delay=min(actuation.delay, 0.2))  # short enough to integrate finely
    shape = actuation.footprint
    motion = roll_out(STILL, twist, target, actuation)
    exact = exact_poses(twist, target, actuation)
    random = np.random.default_rng(seed)
    away, at = random.uniform(-math.pi, math.pi, 12), exact[random.integers(len(exact), size=12)]
    around = np.column_stack((np.cos(away), np.sin(away)))
    if shape.is_disc:
        points = at[:, :2] + shape.radius * around
    else:
        corner = shape.parts[0][random.integers(len(shape.parts[0]), size=12)]
        points = at[:, :2] + turned(corner, at[:, 2]) + random.uniform(0.7, 1.1, (12, 1)) * _kept(actuation) * around
    seen = nearest(motion.pose, points, shape)
    overrated = (seen - nearest(exact, points, shape))[seen >= _kept(actuation)]
    assert overrated.max(initial=0.0) <= overrating(motion, twist, target, actuation) + 1e-6
