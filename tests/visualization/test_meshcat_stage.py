"""What a model describes for collision only is seen, once, and the floor is not."""

import re
from pathlib import Path

from pydrake.geometry import Role
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from drake_starnav import NavigationStation, RobotParameters, Scenario, World
from drake_starnav.station.robot_geometry import read_floor_contact
from drake_starnav.station.world_geometry import add_ground
from drake_starnav.visualization.meshcat_stage import show_collision_shapes
from drake_starnav.visualization.meshes import SHELL_COLOR
from drake_starnav.visualization.recorder import find_robot_frames
from tests.station.test_robot_file import EDITED, JOINTS

POST = """<sdf version="1.7"><model name="posts"><static>true</static><link name="l">
<visual name="seen"><pose>0 0 0.5 0 0 0</pose><geometry><box><size>0.5 0.5 1</size></box></geometry></visual>
<collision name="twin"><pose>0 0 0.5 0 0 0</pose><geometry><cylinder><radius>0.2</radius><length>1</length></cylinder>
</geometry></collision>
<collision name="unseen"><pose>1.5 0 0.5 0 0 0</pose><geometry><box><size>0.4 0.4 1</size></box></geometry></collision>
</link></model></sdf>"""


def shown(add) -> list[str]:
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.01)
    add(plant)
    floor = add_ground(plant, (-1.0, -1.0, 3.0, 1.0))
    plant.Finalize()
    show_collision_shapes(plant, scene_graph, [floor])
    inspector = scene_graph.model_inspector()
    return sorted(inspector.GetName(g) for g in inspector.GetAllGeometryIds(Role.kIllustration))


def test_only_what_no_visual_shape_stands_for_is_added() -> None:
    names = shown(lambda plant: Parser(plant).AddModelsFromString(POST, "sdf"))
    assert names == ["posts::seen", "posts::unseen"]


def test_shapes_without_names_of_their_own_are_shown_both() -> None:
    """In a URDF, Drake calls both after their kind."""
    at = '<origin xyz="{} 0 0.5"/><geometry><cylinder radius="0.2" length="1"/></geometry>'
    link = f'<link name="l"><visual>{at.format(0)}</visual><collision>{at.format(1.5)}</collision></link>'
    names = shown(lambda plant: Parser(plant).AddModelsFromString(f'<robot name="two">{link}</robot>', "urdf"))
    assert len(names) == len(set(names)) == 2


def test_a_bare_robot_has_its_colour_and_no_shapes_that_are_for_the_floor_alone(tmp_path: Path) -> None:
    text = re.sub("<visual.*?</visual>", "", EDITED, flags=re.DOTALL)
    (tmp_path / "bare.urdf").write_text(text)
    robot = RobotParameters(model=str(tmp_path / "bare.urdf"), wheel_joints=JOINTS)
    station = NavigationStation(World("open", (0.0, 0.0, 0.0), (5.0, 0.0)), Scenario("test", None, robot))
    frames = find_robot_frames(station)
    show_collision_shapes(station.plant, station.scene_graph, station.floor, frames)
    inspector = station.scene_graph.model_inspector()
    drawn = [g for frame in frames for g in inspector.GetGeometries(frame, Role.kIllustration)]
    colors = [inspector.GetIllustrationProperties(g).GetProperty("phong", "diffuse") for g in drawn]
    assert len(drawn) >= 3 and {(c.r(), c.g(), c.b()) for c in colors} == {SHELL_COLOR}
    assert not any(read_floor_contact(inspector, g) for g in drawn)
    assert any(read_floor_contact(inspector, g) for g in station.robot_geometries)
