"""After a jump only scans from after it certify motion."""

import dataclasses

import numpy as np

from drake_starnav.surroundings.view import View
from drake_starnav.surroundings.view_history import Odometer, ViewHistory
from drake_starnav.systems.jump_guard import JumpGuard
from tests.helpers.alone import Alone
from tests.helpers.motions import only_star

RATE = 50.0
VIEW = ViewHistory.of_one_time((View.none(),), (np.zeros(3),), 0.0, Odometer())
OPEN = dataclasses.replace(only_star(np.full(720, 1.0)), current_views=VIEW, time=0.0)


class Guarded(Alone):
    """A guard."""

    def __init__(self, rolling: bool = False, holonomic: bool = False) -> None:
        system = JumpGuard(tolerance=0.02, rate=RATE, rolling=rolling, holonomic=holonomic)
        super().__init__(system, state=np.zeros(5))
        self.scanned(0.0)

    def scanned(self, time: float, previous: float = 0.0) -> None:
        self.put("surroundings", dataclasses.replace(OPEN, time=time, previous_time=previous))

    def certifies(self, x: float, y: float = 0.0, v: float = 0.0) -> bool:
        """Let one period pass, the robot at (x, y) at its end."""
        self.advance(1.0 / RATE)
        self.put("state", [x, y, 0.0, v, 0.0])
        return self.system.get_output_port().Eval(self.context).has_views


def test_driving_is_no_jump() -> None:
    guard = Guarded()
    assert all(guard.certifies(0.8 * k / RATE, v=0.8) for k in range(1, 20))


def test_driving_is_no_jump_between_two_updates_either() -> None:
    guard = Guarded()
    assert guard.certifies(0.0) and guard.certifies(3.0 / RATE, v=3.0)
    guard.advance(0.1 / RATE)
    guard.put("state", [3.3 / RATE, 0.0, 0.0, 3.0, 0.0])
    assert guard.system.get_output_port().Eval(guard.context).has_views


def test_a_base_that_drives_aside_does_not_jump() -> None:
    aside, jumping = Guarded(holonomic=True), Guarded(holonomic=True)
    assert all(aside.certifies(0.0, -0.8 * k / RATE, v=0.8) for k in range(1, 20))
    assert jumping.certifies(0.0, 0.032, v=1.6) and not jumping.certifies(0.0, 0.12, v=1.6)


def test_a_jump_withholds_the_star_until_a_later_scan() -> None:
    guard = Guarded()
    assert guard.certifies(0.0)
    assert not guard.certifies(0.03)
    assert not guard.certifies(0.03)
    guard.scanned(0.02)  # taken before the jump
    assert not guard.certifies(0.03)
    guard.scanned(0.1)
    assert guard.certifies(0.03)


def test_a_rolling_scan_placed_by_a_pose_from_before_the_jump_is_withheld() -> None:
    guard = Guarded(rolling=True)
    assert guard.certifies(0.0)
    assert not guard.certifies(0.03)
    guard.scanned(0.1, previous=0.02)
    assert not guard.certifies(0.03)
    guard.scanned(0.15, previous=0.1)
    assert guard.certifies(0.03)
