"""Planar pose and twist of a floating base."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.math import RollPitchYaw
from pydrake.systems.analysis import Simulator

from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.station.planar_localization import PlanarLocalization, read_planar_states

angles = st.floats(-3.1, 3.1)
numbers = st.floats(-10.0, 10.0)


def localized(positions: np.ndarray, velocities: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pose and state that the system outputs for a multibody state."""
    system = PlanarLocalization(
        num_positions=len(positions), num_velocities=len(velocities), lidars=[LidarParameters()]
    )
    context = system.CreateDefaultContext()
    system.GetInputPort("multibody_state").FixValue(context, np.concatenate((positions, velocities)))
    return system.GetOutputPort("pose").Eval(context), system.GetOutputPort("state").Eval(context)


def floating(x: float, y: float, rpy: tuple[float, float, float], wheels: int = 2) -> np.ndarray:
    """Positions of a floating base 0.05 m above the ground, with turned wheels behind it in the vector."""
    return np.concatenate((RollPitchYaw(rpy).ToQuaternion().wxyz(), [x, y, 0.05], np.full(wheels, 7.0)))


@given(x=numbers, y=numbers, yaw=angles, v=numbers, omega=numbers)
def test_a_robot_that_drives_forward_is_where_it_is(x, y, yaw, v, omega) -> None:
    velocities = [0.0, 0.0, omega, v * math.cos(yaw), v * math.sin(yaw), 0.0, 9.0, 9.0]
    pose, state = localized(floating(x, y, (0.0, 0.0, yaw)), np.array(velocities))
    assert pose == pytest.approx([x, y, yaw], abs=1e-9)
    assert state == pytest.approx([x, y, yaw, v, omega], abs=1e-9)


@given(roll=st.floats(-0.5, 0.5), pitch=st.floats(-0.5, 0.5), yaw=angles)
def test_yaw_is_that_of_roll_pitch_yaw_when_the_robot_tilts(roll, pitch, yaw) -> None:
    pose, _ = localized(floating(0.0, 0.0, (roll, pitch, yaw)), np.zeros(8))
    assert pose[2] == pytest.approx(yaw, abs=1e-9)


def test_the_pose_of_a_scan_is_that_at_the_last_one_of_any_lidar() -> None:
    lidars = [LidarParameters(rate=20.0), LidarParameters(rate=8.0)]
    system = PlanarLocalization(num_positions=3, num_velocities=3, lidars=lidars)
    simulator = Simulator(system)
    context, port = simulator.get_mutable_context(), system.GetInputPort("multibody_state")
    due = sorted({*(k / 20.0 for k in range(20)), *(k / 8.0 for k in range(8))})
    for k in range(100):  # it drives along x by 1 m/s
        time = 0.01 * k + 0.006
        port.FixValue(context, [0.01 * k, 0.0, 0.0, 1.0, 0.0, 0.0])
        simulator.AdvanceTo(time)
        last = max(each for each in due if each <= time)
        assert system.GetOutputPort("scan_pose").Eval(context)[0] == pytest.approx(last, abs=0.006)


@given(st.lists(st.tuples(numbers, numbers, angles, numbers, numbers, numbers), min_size=1, max_size=5))
def test_many_states_at_once_are_those_of_the_port(rows) -> None:
    positions = [floating(x, y, (0.1, 0.2, yaw)) for x, y, yaw, *_ in rows]
    velocities = [np.array([0.3, 0.1, omega, v_x, v_y, 0.0, 9.0, 9.0]) for *_, v_x, v_y, omega in rows]
    expected = [localized(p, v)[1] for p, v in zip(positions, velocities, strict=True)]
    assert read_planar_states(np.hstack((positions, velocities)), 9) == pytest.approx(np.array(expected), abs=1e-9)
