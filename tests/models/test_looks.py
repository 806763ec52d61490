"""A look that cannot be read as it stands does not refuse a robot: nothing drives into it."""

import warnings

import pytest
from pydrake.geometry import Role
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlant
from pydrake.systems.framework import DiagramBuilder

from drake_starnav import RobotParameters, StarnavError
from drake_starnav.models.mesh_file import read_mesh_surfaces
from drake_starnav.models.model_files import Models, parse_xml
from drake_starnav.station import add_robot, plant_config
from tests.helpers.robots import joint, link, robot, wheel

LOOK = "<visual>{}<geometry><box size='{}'/></geometry>{}</visual>"
CART = robot("{}", wheel("left", 0.0, 0.16), wheel("right", 0.0, -0.16)).replace("</link>", "{}</link>", 1)
FINGER = joint("finger") + link("finger").replace('iyy="0.001" izz="0.001"', 'iyy="0" izz="0"')


def added(text: str, tmp_path) -> list[str]:
    """The warnings with which a robot is added to a plant."""
    path = tmp_path / "cart.urdf"
    path.write_text(text, encoding="utf-8")
    plant, scene_graph = AddMultibodyPlant(plant_config(), DiagramBuilder())
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        add_robot(plant, scene_graph, RobotParameters(model=str(path)), (0.0, 0.0, 0.0))
    return [str(each.message) for each in caught]


@pytest.mark.parametrize(
    ("look", "words"),
    [
        (LOOK.format("", "1 1 1", "<material name='grey'/>"), ""),
        (LOOK.format("", "1 1 1", "<material name='a'><diffuse>0.1 0.1 0.2 1</diffuse></material>"), ""),
        (LOOK.format("", ".1 .1 .1", "<material name='a'><color rgba='1 0 0 1'/></material>")
         + LOOK.format("", ".2 .1 .1", "<material name='a'><color rgba='0 1 0 1'/></material>"), ""),
        (LOOK.format("", "1 1 1", "<material name='a'><color rgba='0.8 0.8 0.8'/></material>"), "colour '0.8 0.8 0.8'"),
        (LOOK.format("", "1 1 1", "<material name='a'><color rgba='0.8 0.8.0 1 1'/></material>"), "colour '0.8 0.8.0"),
        (LOOK.format("", "1 1.0.0 1", ""), "a look of link base_link"),
        (LOOK.format("<origin xyz='0 0 nan'/>", "1 1 1", ""), "a look of link base_link"),
    ],
)  # fmt: skip
def test_a_look_is_repaired_or_left_out_and_named(look: str, words: str, tmp_path) -> None:
    said = added(CART.format(look, ""), tmp_path)
    assert words in " ".join(said)
    assert bool(said) == bool(words)


GATE = """<sdf version="1.7"><model name="gate"><static>true</static><link name="beam"><collision name="c"><geometry>
<box><size>1 1 1</size></box></geometry></collision><visual name="v"><pose>{}</pose><geometry><box><size>{}</size></box>
</geometry><material><diffuse>{}</diffuse></material></visual></link></model></sdf>"""


@pytest.mark.parametrize(
    ("look", "words", "shown"),
    [
        (("0 0 0 0 0 0", "1 1 1", "0.8 0.8 0.8"), "", 1),
        (("0 0 0 0 0 0", "1 1 1", "red"), "colour 'red'", 1),
        (("0 0 0 0 0 0", "1 1 1", "2 0 0 1"), "colour '2 0 0 1'", 1),
        (("0 0 0 0 0 0", "1 1 1", "0.8 0.8.0 1 1"), "colour '0.8 0.8.0 1 1'", 1),
        (("0 0 0 0 0 0", "1 1.0.0 1", "1 0 0 1"), "a look of link beam", 0),
        (("0 0 nan 0 0 0", "1 1 1", "1 0 0 1"), "a look of link beam", 0),
    ],
)
def test_a_look_in_sdf_is_repaired_or_left_out_as_in_urdf(look, words: str, shown: int, tmp_path) -> None:
    path = tmp_path / "gate.sdf"
    path.write_text(GATE.format(*look), encoding="utf-8")
    files = Models(weld=True)
    plant, scene_graph = AddMultibodyPlant(plant_config(), DiagramBuilder())
    Parser(plant).AddModels(str(files.model(path)))
    assert words in " ".join(files.unseen) and bool(words) == bool(files.unseen)
    assert len(scene_graph.model_inspector().GetAllGeometryIds(Role.kIllustration)) == shown


def test_an_impossible_inertia_is_a_warning_that_names_file_and_link(tmp_path) -> None:
    said = " ".join(added(CART.format("", FINGER), tmp_path))
    assert "cart.urdf: link finger: While parsing inertia" in said


DAE = """<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset/>
<library_effects><effect id="e"><profile_COMMON><technique sid="c"><phong><diffuse><color>{}</color></diffuse><specular>
<color>{}</color></specular></phong></technique></profile_COMMON></effect></library_effects><library_materials>
<material id="m"><instance_effect url="#e"/></material></library_materials><library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="9">0 0 0 1 0 0 0 1 0</float_array><technique_common><accessor source="#a"
count="3" stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
</accessor></technique_common></source><vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="1" material="r"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles></mesh>
</geometry></library_geometries><library_visual_scenes><visual_scene id="s"><node id="n"><instance_geometry url="#g">
<bind_material><technique_common><instance_material symbol="r" target="#m"/></technique_common></bind_material>
</instance_geometry></node></visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene>
</COLLADA>"""


@pytest.mark.parametrize("numbers", [("0.1 0.6 0.1 1", "0 0 0.01.0"), ("0.1 x 0.1 1", "0 0 0 1")])
def test_triangles_outlive_a_colour_that_is_no_number(numbers: tuple[str, str]) -> None:
    (surface,) = read_mesh_surfaces(DAE.format(*numbers).encode(), ".dae")
    assert len(surface.triangles) == 1


def test_a_world_in_xacro_is_expanded_as_a_robot_is(tmp_path) -> None:
    pytest.importorskip("xacro")
    path = tmp_path / "shelf.urdf.xacro"
    path.write_text(
        '<robot name="w" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:property name="d" value="${0.5*2}"/><link '
        'name="shelf"><collision><geometry><box size="${d} 1 1"/></geometry></collision></link></robot>'
    )
    written = Models(weld=True).model(path).read_text(encoding="utf-8")
    assert parse_xml(written.encode()).find("link/collision/geometry/box").get("size") == "1.0 1 1"
    path.write_text('<robot name="w" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:none/></robot>')
    with pytest.raises(StarnavError, match="shelf.urdf.xacro"):
        Models(weld=True).model(path)
