"""What is recorded, and how what cannot be is reported."""

import base64
import re
from pathlib import Path

import pytest
from pydrake.common.value import Value
from pydrake.geometry import Sphere
from pydrake.multibody.meshcat import ContactVisualizer, ContactVisualizerParams
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import ConstantVectorSource

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.navigation import Navigation, Parts, add_navigation
from drake_starnav.planning import Guidance
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.scenario_file import parse_scenario
from drake_starnav.scenario.schema import Scenario
from drake_starnav.station.navigation_station import NavigationStation
from drake_starnav.visualization.meshcat_stage import start_quiet_meshcat
from drake_starnav.visualization.recorder import Recorder, find_robot_path
from drake_starnav.worlds.world import World


def test_any_diagram_with_a_robot_of_ours_is_recorded(tmp_path) -> None:
    world, builder = World("nothing planned", (0.0, 0.0, 0.0), (1.0, 0.0)), DiagramBuilder()
    scenario = Scenario("test", None, RobotParameters(), LidarParameters(beams=36))
    station = builder.AddSystem(NavigationStation(world, scenario))
    still = builder.AddSystem(ConstantVectorSource([0.0, 0.0]))
    builder.Connect(still.get_output_port(), station.GetInputPort("drive.twist_command"))
    recorder = Recorder(tmp_path / "page.html")
    recorder.add_to(builder, Navigation(world, station))
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(0.2)
    recorder.finish()
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert b"set_animation" in messages(tmp_path / "page.html")
    assert "nothing planned" in page and find_robot_path(station).rpartition("/")[2] == "base_link"


class Straight(LeafSystem):
    """A planner of one's own: its guidance leads straight to a place."""

    def __init__(self) -> None:
        super().__init__()
        self.DeclareAbstractOutputPort("guidance", lambda: Value(Guidance.none()), self.calc_guidance)

    def calc_guidance(self, context, output) -> None:
        output.set_value(Guidance.along([(0.5, 0.2), (2.0, 0.0)]))


def messages(page: Path) -> bytes:
    """What a page tells Meshcat, decoded."""
    return b"".join(map(base64.b64decode, re.findall(r"base64,([A-Za-z0-9+/=]+)", page.read_text(encoding="utf-8"))))


def test_what_a_planner_of_one_s_own_sends_is_drawn_and_the_legend_lists_no_more(tmp_path: Path) -> None:
    builder, world = DiagramBuilder(), World("bare", (0.0, 0.0, 0.0), (2.0, 0.0))
    navigation = add_navigation(builder, parse_scenario("{}", name="bare"), Parts(world, planner=Straight()))
    recorder = Recorder.AddToBuilder(builder, navigation, tmp_path / "page.html")
    Simulator(builder.Build()).AdvanceTo(0.5)
    recorder.finish()
    assert recorder.recorded is not None
    drawn = {path.split("/", 2)[2].rpartition("/")[0] for path in recorder.recorded.shapes}
    listed = set(recorder.recorded.caption.legend)
    assert {"path", "short_term_goal", "goal"} <= listed
    assert listed - {"robot"} == {name.removesuffix("/robot") for name in drawn}


def test_a_page_holds_what_is_in_a_meshcat_of_one_s_own(tmp_path: Path) -> None:
    builder, meshcat = DiagramBuilder(), start_quiet_meshcat()
    navigation = add_navigation(builder, parse_scenario("{}", name="bare"), Parts(World("bare", (0, 0, 0), (2, 0))))
    meshcat.SetObject("mine/flag", Sphere(0.2))
    plant = navigation.station.plant
    recorder = Recorder.AddToBuilder(builder, navigation, tmp_path / "page.html", view="own", meshcat=meshcat)
    contacts = ContactVisualizerParams(publish_period=0.05)
    station = navigation.station.GetOutputPort("cheat.contact_results")
    visualizer = builder.AddSystem(ContactVisualizer(meshcat, contacts))
    builder.Connect(station, visualizer.contact_results_input_port())
    Simulator(builder.Build()).AdvanceTo(0.2)
    recorder.finish()
    said = messages(tmp_path / "page.html")
    assert plant.num_bodies() > 1
    assert all(part in said for part in (b"set_animation", b"mine/flag", b"contact_forces", b"starnav/footprint"))


def test_a_run_that_never_was_is_no_recording(tmp_path: Path) -> None:
    builder = DiagramBuilder()
    navigation = add_navigation(builder, parse_scenario("{}", name="bare"), Parts(World("bare", (0, 0, 0), (2, 0))))
    recorder = Recorder.AddToBuilder(builder, navigation, tmp_path / "page.html")
    builder.Build()
    with pytest.raises(StarnavError, match="was not simulated, and nothing is recorded; allowed: after AdvanceTo"):
        recorder.finish()
    assert not (tmp_path / "page.html").exists()
