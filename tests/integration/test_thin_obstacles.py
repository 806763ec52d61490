"""What is certified was seen: nothing wider than the figure that `starnav margins` prints is touched."""

import dataclasses
import math

import numpy as np
import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.margins import derive_margins
from drake_starnav.scenario.scenario_file import parse_scenario
from drake_starnav.scenario.schema import Scenario
from drake_starnav.worlds.clearance import compute_body_clearance
from drake_starnav.worlds.world import World
from tests.helpers.kinematic_robot import KinematicRobot

ELL = [
    [[-0.35, -0.2], [0.35, -0.2], [0.35, 0.2], [-0.35, 0.2]],
    [[-0.35, 0.15], [-0.1, 0.15], [-0.1, 0.5], [-0.35, 0.5]],
]
BEHIND_UNSEEN = ("lidar.angle_min=-1.92", "lidar.angle_max=1.92", "lidar.beams=1080", "lidar.rate=5")
FAR = 2.5


def declaring(overrides: tuple[str, ...], robot: RobotParameters | None = None) -> Scenario:
    scenario = parse_scenario("world: !Obstacles {}", name="poles", overrides=overrides)
    return scenario if robot is None else dataclasses.replace(scenario, robot=robot)


def among_poles(scenario: Scenario, rng: np.random.Generator) -> World:
    """Poles that are hardly wider than what is certain to be seen, in a box."""
    shape, width = scenario.robot.shape, 1.02 * derive_margins(scenario).thinnest
    places = [place for place in rng.uniform(-FAR, FAR, (40, 2)).tolist() if math.hypot(*place) > shape.radius + 0.35]
    poles, around = [(*place, 0.5 * width) for place in places], FAR + 0.3
    begin = (0.0, 0.0, float(rng.uniform(-3.0, 3.0)))
    return World("poles", begin, (0, 0), cylinders=poles, bounds=(-around, -around, around, around))


def driven_recklessly(scenario: Scenario, seed: int, seconds: float) -> tuple[float, float]:
    """The least distance that a driver keeps who rams poles, spins and backs, and its way; m."""
    rng = np.random.default_rng(seed)
    world = among_poles(scenario, rng)
    motion, robot, way, time = KinematicRobot(scenario, world, seed), scenario.robot, 0.0, 0.0
    most = np.full(len(motion.twist), robot.max_speed)
    most[-1] = robot.max_yaw_rate
    poles = world.discs[:, :2]
    while time < seconds and motion.least >= 0.0:
        mood, duration = rng.integers(4), float(rng.uniform(0.3, 1.5))
        aim = poles[rng.integers(len(poles))]
        if rng.random() < 0.6:
            aim = poles[np.argmin(np.hypot(*(poles - motion.pose[:2]).T))]
        random = rng.uniform(-most, most)
        for _ in range(round(duration / 0.1)):
            bearing = math.atan2(*(aim - motion.pose[:2])[::-1].tolist()) - motion.pose[2]
            bearing, twist, before = math.remainder(bearing, 2.0 * math.pi), random, motion.pose
            if mood < 2 and len(most) == 3:
                twist = np.array((*(most[0] * np.array((math.cos(bearing), math.sin(bearing)))), mood * random[2]))
            elif mood < 2:
                back = mood == 1 and abs(bearing) > 0.5 * math.pi
                error = math.remainder(bearing + math.pi, 2.0 * math.pi) if back else bearing
                twist = np.array(((-1.0 if back else 1.0) * most[0] * (abs(error) < 0.6), 5.0 * error))
            motion.drive(twist, 0.1)
            way += math.dist(before[:2], motion.pose[:2])
        time += duration
    return motion.least, way


@pytest.mark.parametrize(
    ("overrides", "robot"),
    [
        ((), None),
        (("lidar.dropout=0.3",), None),
        (("lidar.dropout=0.3", "lidar.rate=8"), RobotParameters(base="omnidirectional", max_speed=1.0)),
        (("lidar.dropout=0.1", "lidar.rate=8"), RobotParameters(footprint=ELL)),
        ((*BEHIND_UNSEEN, "lidar.noise=0"), RobotParameters(base="omnidirectional", footprint=ELL)),
        (BEHIND_UNSEEN, None),
        (("obstacles.min_width=0.008", "lidar.dropout=0.1"), None),
    ],
)
def test_no_driver_touches_what_is_certain_to_be_seen(
    overrides: tuple[str, ...], robot: RobotParameters | None
) -> None:
    scenario, ways = declaring(overrides, robot), []
    for seed in range(3):
        least, way = driven_recklessly(scenario, seed, 8.0)
        assert least > 0.0
        ways.append(way)
    assert sum(ways) > 1.0


def test_what_is_declared_decides_how_far_and_how_fast_it_drives() -> None:
    plain, thin, thick = (derive_margins(declaring((f"obstacles.min_width={width}",))) for width in (0, 0.006, 0.05))
    assert thin.thinnest == 0.006 and thick.thinnest == 0.05
    assert thin.safety_range < plain.safety_range == thick.safety_range
    assert thin.safety_range + 0.25 == pytest.approx(0.006 / math.radians(1.0))
    with pytest.raises(StarnavError, match=r"obstacles.min_width is 0.004 m.*allowed: at least"):
        derive_margins(declaring(("obstacles.min_width=0.004",)))


def way_along_corridor(overrides: tuple[str, ...]) -> float:
    """How far a robot comes in a corridor that leaves it 0.2 m a side, m."""
    corridor = World("corridor", (0, 0, 0), (0, 0), bounds=(-1.0, -0.45, 8.0, 0.45))
    motion = KinematicRobot(declaring(overrides), corridor, 0)
    for _ in range(40):
        motion.drive(np.array((0.8, 0.0)), 0.1)
    return float(motion.pose[0])


def test_lost_beams_that_are_declared_are_in_the_figure_and_cost_no_speed() -> None:
    alone = derive_margins(declaring(())).thinnest
    assert derive_margins(declaring(("lidar.outliers=0.01",))).thinnest == 2.0 * alone
    losing = ("lidar.dropout=0.2",)
    assert derive_margins(declaring(losing)).thinnest == 2.0 * alone
    assert way_along_corridor(losing) > 0.95 * way_along_corridor(())


def test_a_look_sees_no_farther_than_where_beams_are_apart_by_the_thinnest_obstacle() -> None:
    scenario = declaring(BEHIND_UNSEEN)
    world = World("open", (0, 0, 0), (0, 0), cylinders=[(2.0, 2.0, 0.2)])
    motion, margins = KinematicRobot(scenario, world, 0), derive_margins(scenario)
    motion.drive(np.array((0.5, 0.0)), 1.0)
    known = motion.seen.surroundings
    for view in (known.view, *known.past_views.views[:-1]):
        assert view.visible_ranges.max() * scenario.lidar.widest_gap <= margins.thinnest * (1.0 + 1e-9)
    assert compute_body_clearance(world, motion.pose[None], scenario.robot.shape)[0] > 1.0
