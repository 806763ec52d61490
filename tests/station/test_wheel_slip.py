"""Wheels lose no more than the declared share of their speed, drawn once a second."""

import numpy as np
import pytest

from drake_starnav.station.fault_models import wheel_shares
from drake_starnav.station.wheel_slip import SLIP_PERIOD, WheelSlip

SLIP, SEED = 0.2, 7
SIDES = np.array((0, 0, 1))
DESIRED = np.array((0.0, 0.0, 0.0, 3.0, 3.0, -2.0))


def slipping(time: float) -> np.ndarray:
    system = WheelSlip(sides=SIDES, slip=SLIP, seed=SEED)
    context = system.CreateDefaultContext()
    system.GetInputPort("desired_state").FixValue(context, DESIRED)
    context.SetTime(time)
    return system.GetOutputPort("slipping_state").Eval(context)


@pytest.mark.parametrize("index", range(4))
def test_the_wheels_of_a_side_keep_their_share_for_one_period(index: int) -> None:
    expected = DESIRED[3:] * wheel_shares(SLIP, SEED, index)[SIDES]
    for time in (index * SLIP_PERIOD, (index + 0.999) * SLIP_PERIOD):
        np.testing.assert_array_equal(slipping(time), (0.0, 0.0, 0.0, *expected))
    assert (np.abs(expected) >= (1.0 - SLIP) * np.abs(DESIRED[3:])).all()


def test_the_shares_differ_from_period_to_period() -> None:
    assert len({tuple(slipping(index * SLIP_PERIOD)) for index in range(5)}) == 5
