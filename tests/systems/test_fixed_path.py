"""A given path is driven to its end, around what stands in it, and a path that crosses itself in its order."""

import dataclasses

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.systems.analysis import Simulator

from drake_starnav.surroundings import Observation
from drake_starnav.surroundings.star_region import scan_region
from drake_starnav.systems.fixed_path import NEAR, SPACING, FixedPath
from drake_starnav.worlds.world import World
from tests.helpers.scans import MARGINS, RADIUS, cast

OPEN = World("open", (0.0, 0.0, 0.0), (4.0, 0.0), bounds=(-3.0, -3.0, 7.0, 3.0))
ANGLE = np.linspace(0.6, 6.1, 200)
EIGHT = np.column_stack((3.0 * np.sin(ANGLE), 1.5 * np.sin(2.0 * ANGLE)))
"""Most of an eight, m."""


class Led:
    """A path's guidance at poses set by hand in a world."""

    def __init__(self, path: np.ndarray, world: World) -> None:
        self.system, self.world = FixedPath(path), world
        self.simulator = Simulator(self.system)
        self.context = self.simulator.get_mutable_context()
        self.time = 0.0

    def at(self, x: float, y: float) -> np.ndarray:
        """The short-term goal once the robot has come there."""
        pose = np.array((x, y, 0.0))
        self.system.GetInputPort("observation").FixValue(self.context, Value(seen(self.world, pose)))
        self.system.GetInputPort("pose").FixValue(self.context, pose)
        self.time += 0.05
        self.simulator.AdvanceTo(self.time)
        goal = self.system.GetOutputPort("short_term_goal").Eval(self.context)
        assert np.array_equal(self.system.GetOutputPort("guidance").Eval(self.context).path[0], goal)
        return goal


def seen(world: World, pose: np.ndarray) -> Observation:
    scan = cast(world, pose)
    return Observation(scan_region(scan, pose, RADIUS, MARGINS), scan, pose)


def test_it_leads_a_little_ahead_of_the_robot_and_to_the_end_at_last() -> None:
    led = Led(np.array([(0.0, 0.0), (4.0, 0.0)]), OPEN)
    assert led.at(0.0, 0.3) == pytest.approx((0.25 * NEAR, 0.0), abs=0.25 * SPACING)
    for x in np.arange(0.0, 4.0, 0.5):
        led.at(x, 0.0)
    assert led.at(3.9, 0.0) == pytest.approx((4.0, 0.0))


def test_it_leads_behind_what_stands_in_the_path() -> None:
    blocked = dataclasses.replace(OPEN, cylinders=[(0.8, 0.0, 0.1)])
    x, y = Led(np.array([(0.0, 0.0), (0.8, 0.0), (0.8, 2.0)]), blocked).at(0.0, 0.4)
    assert x == pytest.approx(0.8) and 0.1 + RADIUS < y < 1.0


def test_a_path_that_crosses_itself_is_followed_in_its_order() -> None:
    led, ahead = Led(EIGHT, World("open", (0.0, 0.0, 0.0), (1.0, 0.0))), []
    for point in EIGHT[::4]:
        ahead.append(np.hypot(*(EIGHT - led.at(*point)).T).argmin())
    assert np.all(np.diff(ahead) >= 0)


def test_nowhere_before_the_first_scan() -> None:
    system = FixedPath(EIGHT)
    context = system.CreateDefaultContext()
    system.GetInputPort("observation").FixValue(context, Value(Observation.none()))
    system.GetInputPort("pose").FixValue(context, [1.0, 2.0, 0.0])
    assert len(system.GetOutputPort("guidance").Eval(context).path) == 0
    assert system.GetOutputPort("short_term_goal").Eval(context).tolist() == [1.0, 2.0]
