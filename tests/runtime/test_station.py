"""The station of drivers hands on what it is given, and is a robot."""

import dataclasses

import numpy as np
from pydrake.common.value import Value

from drake_starnav import LidarParameters, Scenario
from drake_starnav.lidar.mounts import ON_AXIS, Mount
from drake_starnav.runtime.station import AskedGoal, DriverStation, make_empty_scan

LIDARS = LidarParameters(), LidarParameters(beams=180)
SCENARIO = Scenario("two", None, lidar=LIDARS[0], lidars=LIDARS)


def test_outputs_are_inputs() -> None:
    station = DriverStation(SCENARIO, (ON_AXIS, Mount(0.1, 0.0, 0.0, False)))
    context = station.CreateDefaultContext()
    scans = [dataclasses.replace(make_empty_scan(lidar), time=float(k)) for k, lidar in enumerate(LIDARS)]
    for name, value in zip(("scan", "scan_2"), scans, strict=True):
        station.GetInputPort(name).FixValue(context, Value(value))
    station.GetInputPort("state").FixValue(context, np.arange(5.0))
    station.GetInputPort("scan_pose").FixValue(context, np.arange(3.0) + 10.0)
    assert [station.GetOutputPort(f"{name}.scan").Eval(context) for name in ("lidar", "lidar_2")] == scans
    assert station.GetOutputPort("localization.pose").Eval(context).tolist() == [0.0, 1.0, 2.0]
    assert station.GetOutputPort("localization.state").Eval(context).tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert station.GetOutputPort("localization.scan_pose").Eval(context).tolist() == [10.0, 11.0, 12.0]
    assert station.scenario is SCENARIO and len(station.mounts) == 2


def test_the_goal_is_what_is_asked_for() -> None:
    goal = AskedGoal()
    context = goal.CreateDefaultContext()
    goal.GetInputPort("goal").FixValue(context, np.array((1.0, 2.0)))
    goal.GetInputPort("heading").FixValue(context, np.array([0.5]))
    assert goal.GetOutputPort("goal").Eval(context).tolist() == [1.0, 2.0]
    assert goal.GetOutputPort("heading").Eval(context).tolist() == [0.5]
