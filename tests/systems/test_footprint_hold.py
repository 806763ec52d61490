"""Whatever footprints are told: what is in force contains them, and shrinks only while the robot stands."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.common.value import Value
from pydrake.systems.analysis import Simulator

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.footprint import MOST_PARTS, Footprint, covered, disc, footprint
from drake_starnav.geometry.trajectory import STANDING
from drake_starnav.robot import RobotParameters
from drake_starnav.systems.footprint_hold import FootprintHold
from tests.helpers.footprints import LONG, ROUND, WIDE
from tests.helpers.scans import MARGINS

RATE = 50.0
DRIVES, STANDS = (0.5, 0.0), (0.0, 0.0)


class Held:
    """A hold under a simulator, fed by hand."""

    def __init__(self, robot: RobotParameters | None = None, margins=lambda robot: MARGINS) -> None:
        robot = robot or RobotParameters()
        self.size = len(robot.drive.components)
        self.system = FootprintHold(robot, margins, rate=RATE)
        self.simulator = Simulator(self.system)
        self.context = self.simulator.get_mutable_context()

    def told(self, shape: object, state: tuple = STANDS, twist: tuple = STANDS) -> Footprint:
        """What is in force after an update, before which a footprint is told to a robot of such (v, omega)."""
        self.at_once(shape, state, twist)
        self.simulator.AdvanceTo(self.context.get_time() + 1.01 / RATE)
        return self.in_force()

    def at_once(self, shape: object, state: tuple = DRIVES, twist: tuple = DRIVES) -> Footprint:
        """What is in force in the same instant."""
        self.system.GetInputPort("footprint").FixValue(self.context, Value[object](shape))
        self.system.GetInputPort("state").FixValue(self.context, [0.0, 0.0, 0.0, *state])
        self.system.GetInputPort("twist_command").FixValue(self.context, [*twist, 0.0][: self.size])
        return self.in_force()

    def in_force(self) -> Footprint:
        return self.system.get_output_port().Eval(self.context).robot.shape


def rectangles(low: float) -> st.SearchStrategy:
    size = st.floats(low, 0.8)
    return st.tuples(size, size, size, size).map(lambda s: ((-s[0], -s[1]), (s[2], -s[1]), (s[2], s[3]), (-s[0], s[3])))


shapes = st.one_of(
    st.floats(0.1, 0.8).map(disc),
    rectangles(0.1).map(footprint),
    st.tuples(rectangles(0.05), rectangles(0.05)).map(footprint),
)


def area(shape: Footprint, wider: float) -> shapely.Geometry:
    """A footprint, widened or, if negative, narrowed; a disc as a polygon with 4096 corners at least."""
    if shape.is_disc:
        return shapely.Point(0.0, 0.0).buffer(shape.radius + wider, quad_segs=1024)
    return covered(shape, np.zeros(3)).buffer(wider)


@settings(max_examples=40, deadline=None)
@given(st.lists(st.tuples(shapes, st.booleans(), st.booleans()), min_size=1, max_size=12))
def test_whatever_is_told_what_is_in_force_contains_it_and_shrinks_only_while_the_robot_stands(told) -> None:
    held = Held()
    before = held.in_force() if held.at_once(ROUND) else None
    for shape, moves, is_commanded in told:
        state, twist = DRIVES if moves else STANDS, DRIVES if is_commanded else STANDS
        assert area(held.at_once(shape, state, twist), 1e-5).covers(area(shape, 0.0)), "at once"
        now = held.told(shape, state, twist)
        assert area(now, 1e-5).covers(area(shape, 0.0))
        if moves or is_commanded:
            assert area(now, 1e-5).covers(area(before, 0.0)), "shrunk in motion"
        else:
            assert area(shape, 1e-5).covers(area(now, 0.0)), "not shrunk at rest"
        before = now


def test_a_footprint_that_changes_all_the_time_stays_simple() -> None:
    held = Held()
    for k in range(400):
        angle = 0.1 * k
        turn = np.array(((math.cos(angle), math.sin(angle)), (-math.sin(angle), math.cos(angle))))
        arm = np.array(((0.0, -0.02), (0.6, -0.02), (0.6, 0.02), (0.0, 0.02))) @ turn
        now = held.told(footprint(tuple(map(tuple, arm.tolist()))), DRIVES, DRIVES)
        assert len(now.parts) <= MOST_PARTS and len(now.polygons.offsets) < 200
    assert now.radius < 0.6 * math.sqrt(2.0) + 0.05


@pytest.mark.parametrize(
    ("state", "twist", "shrinks"),
    [
        (STANDS, STANDS, True),
        ((0.4 * STANDING, -0.5 * STANDING / LONG.radius), STANDS, True),
        ((0.6 * STANDING, -0.5 * STANDING / LONG.radius), STANDS, False),
        ((1.1 * STANDING, 0.0), STANDS, False),
        ((0.0, 0.9 * STANDING / LONG.radius), STANDS, True),
        ((0.0, 1.1 * STANDING / LONG.radius), STANDS, False),
        (STANDS, (0.001, 0.0), False),
        (STANDS, (0.0, 0.001), False),
    ],
)
def test_it_stands_if_neither_the_robot_nor_its_command_moves(state, twist, shrinks) -> None:
    held = Held()
    assert held.told(LONG).radius == pytest.approx(LONG.radius)
    assert (held.told(ROUND, state, twist).radius < LONG.radius) == shrinks


def test_one_that_is_contained_changes_nothing_and_one_that_contains_replaces() -> None:
    held = Held()
    first = held.system.get_output_port().Eval(held.context) if held.told(LONG) else None
    held.told(ROUND, DRIVES, DRIVES)
    assert held.system.get_output_port().Eval(held.context) is first
    both = held.told(WIDE, DRIVES, DRIVES)
    assert len(both.parts) == 2
    square = footprint(((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)))
    assert len(held.told(square, DRIVES, DRIVES).parts) == 1


def test_a_car_s_disc_is_a_polygon_and_its_command_stands_without_speed() -> None:
    held = Held(RobotParameters(base="car"))
    assert not held.told(LONG, STANDS, (0.0, 1.5)).is_disc
    assert not held.told(disc(0.3), STANDS, (0.0, 1.5)).is_disc
    assert held.in_force().radius == pytest.approx(0.3)


def test_the_margins_are_those_of_the_robot_in_force() -> None:
    asked = []

    def margins(robot: RobotParameters):
        asked.append(robot)
        return MARGINS

    held = Held(RobotParameters(max_speed=0.4), margins)
    held.told(LONG)
    assert [robot.shape.radius for robot in asked] == pytest.approx([ROUND.radius, LONG.radius])
    assert all(robot.max_speed == 0.4 for robot in asked)


def test_one_for_which_the_scenario_is_refused_ends_the_run() -> None:
    def margins(robot: RobotParameters):
        if robot.radius > 0.5:
            raise StarnavError("too large; allowed: a smaller one")
        return MARGINS

    with pytest.raises(StarnavError, match="port footprint: too large; allowed: a smaller one"):
        Held(margins=margins).told(WIDE)
