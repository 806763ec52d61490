"""One goal after the other."""

import math

import numpy as np

from drake_starnav.geometry.footprint import disc, footprint
from drake_starnav.geometry.trajectory import STANDING
from drake_starnav.robot import BASES
from drake_starnav.systems.goal_sequence import HEADING_TOLERANCE, Arrival, GoalSequence, TurningRoom
from tests.helpers.alone import Alone

PERIOD = 0.1


class Visited(Alone):
    """A sequence whose robot is moved by hand."""

    def __init__(self, *goals: tuple[float, ...], base: str = "differential") -> None:
        super().__init__(GoalSequence(goals, tolerance=0.3, period=PERIOD, footprint=disc(2.0), base=BASES[base]))

    def at(self, x: float, y: float, yaw: float = 0.0, omega: float = 0.0) -> tuple[list[float], float, list[float]]:
        """Goal, heading and times one period after the robot came to a pose."""
        self.put("state", [x, y, yaw, 0.0, omega])
        self.advance(PERIOD)
        goal, heading, reached = map(self.out, ("goal", "heading", "reached"))
        return goal.tolist(), float(heading[0]), reached[np.isfinite(reached)].tolist()


def test_the_next_goal_follows_as_soon_as_one_is_reached() -> None:
    visited = Visited((1.0, 0.0), (2.0, 0.0))
    assert visited.at(0.0, 0.0)[0] == [1.0, 0.0]
    assert visited.at(0.69, 0.0)[2] == []
    goal, heading, times = visited.at(0.71, 0.0)
    assert goal == [2.0, 0.0] and math.isnan(heading) and np.allclose(times, 2 * PERIOD)
    goal, heading, times = visited.at(2.0, 0.0)
    assert goal == [2.0, 0.0] and math.isnan(heading) and np.allclose(times, [2 * PERIOD, 3 * PERIOD])
    assert visited.at(5.0, 0.0)[2] == times  # what was reached stays so


def test_a_heading_is_asked_for_at_its_goal_only_and_must_be_taken() -> None:
    visited = Visited((1.0, 0.0, 3.0), (4.0, 0.0))
    assert math.isnan(visited.at(0.0, 0.0, 3.0)[1])
    assert visited.at(0.9, 0.0)[1:] == (3.0, [])
    assert math.isnan(visited.at(0.5, 0.0)[1])  # pushed away
    assert visited.at(0.9, 0.0, 3.0 - 2.0 * HEADING_TOLERANCE)[1:] == (3.0, [])
    goal, heading, times = visited.at(0.9, 0.0, 3.0 - 0.5 * HEADING_TOLERANCE - 2.0 * math.pi)
    assert goal == [4.0, 0.0] and math.isnan(heading) and len(times) == 1


def test_a_car_may_leave_its_goal_to_manoeuvre_and_must_come_back() -> None:
    visited = Visited((1.0, 0.0, 3.0), base="car")
    assert math.isnan(visited.at(0.5, 0.0)[1]), "it has not arrived"
    assert visited.at(0.9, 0.0)[1:] == visited.at(0.2, 0.5, 3.0)[1:] == (3.0, [])
    assert math.isnan(visited.at(-9.0, 0.0)[1]), "pushed away"
    assert visited.at(0.9, 0.0)[1] == 3.0 and len(visited.at(0.9, 0.0, 3.0)[2]) == 1


def test_a_heading_is_taken_when_the_robot_stands() -> None:
    visited = Visited((1.0, 0.0, 3.0))
    assert visited.at(1.0, 0.0, 3.0, 0.51 * STANDING)[1:] == (3.0, [])
    assert len(visited.at(1.0, 0.0, 3.0, 0.49 * STANDING)[2]) == 1


def test_a_robot_that_is_no_disc_and_stands_beside_its_goal_turns_to_the_heading_there() -> None:
    """A disc has nothing to gain by it."""
    box = footprint(((0.4, -0.25), (0.4, 0.25), (-0.4, 0.25), (-0.4, -0.25)))
    for shape, away, speed, turning, turns in (
        (box, 0.08, 0.0, False, True), (box, 0.08, 0.2, False, False), (box, 0.08, 0.2, True, True),
        (box, 0.2, 0.0, False, False), (box, 0.2, 0.2, True, True),
        (disc(0.4), 0.08, 0.0, True, False), (disc(0.4), 0.02, 0.2, False, True),
    ):  # fmt: skip
        room = TurningRoom.of(BASES["differential"], shape, 0.03)
        arrival = Arrival.at((1.0, 0.0, 3.0), np.array((1.0, away, 3.0, speed, 0.0)), room, turning)
        assert math.isfinite(arrival.heading) == turns and arrival.reached == (away < 0.03)
