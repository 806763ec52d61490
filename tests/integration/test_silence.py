"""The whole loop under faults of its sensor and drive: it stops in time, and goes on."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_starnav.navigation import add_navigation
from drake_starnav.scenario.scenario_file import load_scenario

pytestmark = pytest.mark.slow

SILENT_FROM, SILENT_FOR = 2.0, 2.0


@pytest.mark.parametrize("faults", [[], ["lidar.delay=0.1", "drive.delay=0.05", "lidar.dropout=0.2"]])
def test_the_robot_stands_while_the_sensor_is_silent_and_drives_on_when_it_returns(faults: list[str]) -> None:
    silence = [f"lidar.silence_start={SILENT_FROM}", f"lidar.silence_duration={SILENT_FOR}"]
    scenario = load_scenario("room", overrides=[*silence, *faults])
    builder = DiagramBuilder()
    navigation = add_navigation(builder, scenario, seed=1)
    diagram = builder.Build()
    simulator = Simulator(diagram)
    station = navigation.station
    # the last scan, its delay and patience; the drive's delay; braking
    stands = SILENT_FROM + (3.0 / 20.0 + 0.1) + 0.05 + scenario.robot.max_speed / scenario.robot.max_acceleration + 0.15

    def speed_at(time: float) -> float:
        simulator.AdvanceTo(time)
        context = station.GetMyContextFromRoot(simulator.get_context())
        return float(abs(station.GetOutputPort("localization.state").Eval(context)[3]))

    assert speed_at(SILENT_FROM) > 0.2
    assert all(speed_at(time) < 0.01 for time in np.linspace(stands, SILENT_FROM + SILENT_FOR, 5))
    assert max(speed_at(time) for time in np.linspace(4.5, 6.0, 16)) > 0.2
