"""Model files as Gazebo has them, in a form that Drake reads: nothing that blocks the way is left out."""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import trimesh

from drake_starnav.errors import StarnavError
from drake_starnav.models.model_files import MOST_LINKS, Models
from drake_starnav.models.model_folders import FOLDERS
from tests.models.test_mesh_file import ASCII_STL, BINARY_STL, dae, solid
from tests.models.test_obj_files import points_of

LINK = '<link name="l"><collision name="c"><geometry>{}</geometry></collision></link>'
MODEL = '<model name="m"><static>1</static>{}</model>'
INCLUDE = '<world name="w"><include><uri>model://crate</uri></include></world>'
SENSOR = '<sensor name="s" type="ray"/>'
BOX = LINK.format("<box><size>1 1 1</size></box>")


@pytest.fixture(autouse=True)
def _no_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in (*FOLDERS, "AMENT_PREFIX_PATH"):
        monkeypatch.delenv(name, raising=False)


def sdf(folder: Path, content: str, name: str = "m.sdf") -> Path:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f'<?xml version="1.0"?><sdf version="1.7">{content}</sdf>')
    return path


def prepared(path: Path) -> ElementTree.Element:
    return ElementTree.parse(Models().model(path)).getroot()


def hulls(root: ElementTree.Element) -> list[tuple[tuple, tuple]]:
    """Least and greatest corner of each mesh to collide with."""
    found = []
    for uri in root.iter("uri"):
        points = points_of(Path((uri.text or "").removeprefix("file://")))
        found.append((tuple(points.min(axis=0).round(3)), tuple(points.max(axis=0).round(3))))
    return found


def test_only_what_concerns_bodies_stays(tmp_path: Path) -> None:
    world = (
        '<world name="w"><physics type="ode"/><gui/><light name="sun"/><plugin name="p" filename="p.so"/>'
        f"{MODEL.format(BOX.replace('</link>', SENSOR + '</link>'))}"
        '<state world_name="w"><model name="m"><pose>9 0 0 0 0 0</pose></model></state></world>'
    )
    root = prepared(sdf(tmp_path, world, "m.world"))
    assert {part.tag for part in root.find("world")} == {"model"}
    assert {part.tag for part in root.find("world/model/link")} == {"collision"}


@pytest.mark.parametrize("uri", ["model://sun", "model://ground_plane", "https://fuel.server/1.0/models/Ground Plane"])
def test_the_floor_and_the_sun_are_everywhere(uri: str, tmp_path: Path) -> None:
    root = prepared(sdf(tmp_path, f'<world name="w"><include><uri>{uri}</uri></include>{MODEL.format(BOX)}</world>'))
    assert [part.tag for part in root.find("world")] == ["model"]


def test_what_does_not_move_needs_no_inertia(tmp_path: Path) -> None:
    loose = MODEL.replace("<static>1</static>", "").format(BOX.replace("</link>", "<inertial/></link>"))
    joined = loose.replace("</model>", "<joint/></model>")
    static = loose.replace("<link", "<static>true</static><link", 1)
    for weld, inertials in ((True, 1), (False, 2)):
        root = ElementTree.parse(Models(weld=weld).model(sdf(tmp_path, loose + joined + static))).getroot()
        assert len(list(root.iter("inertial"))) == inertials


def test_models_of_one_name_are_told_apart(tmp_path: Path) -> None:
    sdf(tmp_path, MODEL.format(BOX), "crate/model.sdf")
    include = "<include><uri>model://crate</uri></include>"
    root = prepared(sdf(tmp_path, f'<world name="w">{MODEL.format(BOX) * 2}{include * 2}</world>'))
    assert [model.get("name") for model in root.iter("model")] == ["m", "m_1"]
    assert [include.findtext("name") for include in root.iter("include")] == ["crate", "crate_1"]


def test_a_folder_has_the_file_of_its_highest_version(tmp_path: Path) -> None:
    for name, shape in (("old.sdf", "sphere"), ("new.sdf", "box")):
        sdf(tmp_path / "crate", MODEL.format(LINK.format(f"<{shape}/>")), name)
    (tmp_path / "crate/model.config").write_text(
        '<model><sdf version="1.10">new.sdf</sdf><sdf version="1.9">old.sdf</sdf></model>'
    )
    root = prepared(sdf(tmp_path, INCLUDE))
    inside = ElementTree.parse(root.findtext("world/include/uri").removeprefix("file://")).getroot()
    assert inside.find(".//geometry")[0].tag == "box"


@pytest.mark.parametrize(("data", "suffix"), [(ASCII_STL, "stl"), (BINARY_STL, "STL"), (dae(), "dae"), (dae(), "DAE")])
@pytest.mark.parametrize("uri", ["meshes/a b.{}", "file://{{}}/meshes/a%20b.{}", "package://crate/meshes/a b.{}"])
def test_meshes_become_files_that_drake_reads(data: bytes, suffix: str, uri: str, tmp_path: Path) -> None:
    folder = tmp_path / "crate"
    (folder / "meshes").mkdir(parents=True)
    (folder / f"meshes/a b.{suffix}").write_bytes(data)
    name = uri.format(suffix).format(folder)
    path = sdf(folder, MODEL.format(LINK.format(f"<mesh><uri>{name}</uri><scale>2 2 2</scale></mesh>")))
    root = prepared(path)
    assert hulls(root) == [((0.0, 0.0, 0.0), (1.0, 2.0, 3.0))]
    assert root.findtext(".//scale") == "2 2 2"
    robot = tmp_path / "crate/r.urdf"
    robot.write_text(
        f'<robot name="r"><link name="l"><collision><geometry><mesh filename="{name}"/></geometry></collision></link>'
        "</robot>"
    )
    (mesh,) = prepared(robot).iter("mesh")
    assert Path(mesh.get("filename").removeprefix("file://")).suffix == ".obj"


def test_what_is_drake_s_own_stays(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("v 0 0 0\n")
    mesh = LINK.format("<mesh><uri>a.obj</uri><drake:declare_convex/></mesh>")
    models = MODEL.format(f"{mesh}<drake:collision_filter_group/>") + MODEL.format(LINK.format("<drake:capsule/>"))
    root = prepared(sdf(tmp_path, models))
    for tag in ("declare_convex", "collision_filter_group", "capsule"):
        assert len(list(root.iter(f"{{http://drake.mit.edu}}{tag}"))) == 1


def test_pieces_of_a_mesh_that_do_not_hang_together_collide_apart(tmp_path: Path) -> None:
    far = solid(np.array([(9, 0, 0), (9, 1, 0), (9, 0, 1), (10, 0, 0)]))
    trimesh.util.concatenate([solid(), far]).export(tmp_path / "two.stl")
    root = prepared(sdf(tmp_path, MODEL.format(LINK.format("<mesh><uri>two.stl</uri></mesh>"))))
    assert sorted(hulls(root)) == [((0, 0, 0), (1, 2, 3)), ((9, 0, 0), (10, 1, 1))]
    assert [collision.get("name") for collision in root.iter("collision")] == ["c", "c_1"]


POINTS = "".join(f"<point>{x} {y}</point>" for x, y in ((0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (INCLUDE.replace("crate", "gone"), "include 'model://gone' is not found; .*PATH"),
        ('<world name="w"><include><uri>m.sdf</uri></include></world>', "includes itself"),
        ('<world name="w"><population name="p"/></world>', "has a <population>"),
        ("<world", "cannot be read: .*XML"),
        ("<xacro:macro/>", "m.sdf: xacro: unbound prefix.*; allowed: a file that xacro expands"),
        ("<model>" * 20_000 + "</model>" * 20_000, "is nested too deeply"),
    ],
)
def test_broken_files_are_refused(content: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(StarnavError, match=message):
        Models().model(sdf(tmp_path, content))


@pytest.mark.parametrize("kind", ["sdf", "urdf"])
def test_looks_are_converted_with_their_colours_and_left_out_where_nothing_can_be_read(
    kind: str, tmp_path: Path
) -> None:
    two = trimesh.Scene()
    for color in ((255, 0, 0, 255), (0, 0, 255, 255)):
        box = trimesh.creation.box((1.0, 1.0, 1.0))
        box.visual = trimesh.visual.TextureVisuals(material=trimesh.visual.material.PBRMaterial(baseColorFactor=color))
        two.add_geometry(box)
    (tmp_path / "two.glb").write_bytes(two.export(file_type="glb"))
    (tmp_path / "a.obj").write_text("v 0 0 0\n")
    (tmp_path / "a.stl").write_bytes(ASCII_STL)
    (tmp_path / "torn.dae").write_bytes(dae()[:-40])
    (tmp_path / "folder.stl").mkdir()
    mesh = "<mesh><uri>{0}</uri></mesh>" if kind == "sdf" else '<mesh filename="{0}"/>'
    looks = "".join(
        f'<visual name="{name}"><geometry>{mesh.format(name)}</geometry></visual>'
        for name in ("a.obj", "gone.obj", "torn.dae", "folder.stl", "a.stl", "two.glb")
    )
    path, models = sdf(tmp_path, MODEL.format(BOX.replace("</link>", f"{looks}</link>"))), Models()
    if kind == "urdf":
        path = tmp_path / "r.urdf"
        path.write_text(f'<robot name="r"><link name="base_link">{looks}</link></robot>')
    shown = list(ElementTree.parse(models.model(path)).getroot().iter("visual"))
    assert [visual.get("name") for visual in shown] == ["a.obj", "a.stl", "two.glb", "two.glb_1"]
    meshes = [visual.find("geometry/mesh") for visual in shown]
    assert all((mesh.findtext("uri") or mesh.get("filename")).endswith(".obj") for mesh in meshes)
    looks = [[*each.iterfind("material/diffuse"), *each.iterfind("material/color")] for each in shown]
    colors = [color.text or color.get("rgba") for (color,) in looks[2:]]
    assert looks[:2] == [[], []] and sorted(colors) == ["0 0 1 1", "1 0 0 1"]
    folder, gone, torn = sorted(models.unseen)
    assert (folder, gone) == ("folder.stl (a folder)", "gone.obj (no such file)")
    assert torn.startswith("torn.dae (not a valid .dae file")


def test_the_files_of_directives_are_replaced(tmp_path: Path) -> None:
    sdf(tmp_path / "crate", MODEL.format(BOX), "model.sdf")
    path = tmp_path / "w.dmd.yaml"
    path.write_text(
        "directives:\n- add_model: {name: a, file: crate/model.sdf}\n- add_model:\n    name: b\n"
        "    file: package://drake_models/none.urdf\n- add_directives: {file: 'more.dmd.yaml'}\n"
    )
    (tmp_path / "more.dmd.yaml").write_text("directives:\n- add_model: {name: c, file: model://crate/model.sdf}\n")
    models = Models()
    text = models.model(path).read_text()
    assert "package://drake_models/none.urdf" in text
    assert text.count('file: "file:///') == 2


@pytest.mark.parametrize(
    ("shape", "message"),
    [
        ("<torus/>", "collision c is a torus; allowed: box, sphere"),
        ("<box><size>1 1 1</size></box><sphere><radius>2</radius></sphere>", "collision c has 2 shapes; allowed: one"),
        ("<plane><normal>0 0 0</normal></plane>", "plane: normal .* a solid"),
        ("<mesh><uri>gone.stl</uri></mesh>", "mesh 'gone.stl': no such file"),
        *((f"<mesh><uri>folder.{kind}</uri></mesh>", f"mesh 'folder.{kind}': a folder") for kind in ("stl", "obj")),
        ("<mesh><uri>bad.stl</uri></mesh>", "bad.stl: a .stl file without triangles"),
        ("<mesh><uri>bad.stl</uri><submesh><name>a</name></submesh></mesh>", "is a part of a mesh"),
        ("<cone><radius>-1</radius><length>2</length></cone>", "cone: radius -1, length 2; allowed: a solid"),
        (f"<polyline>{POINTS}<height>0</height></polyline>", "polyline: height 0"),
    ],
)
def test_what_cannot_be_built_is_refused(shape: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "bad.stl").write_bytes(b"bad")
    for kind in ("stl", "obj"):
        (tmp_path / f"folder.{kind}").mkdir()
    with pytest.raises(StarnavError, match=message):
        Models().model(sdf(tmp_path, MODEL.format(LINK.format(shape))))


def test_files_that_include_each_other_make_a_bounded_number_of_links(tmp_path: Path) -> None:
    sdf(tmp_path, MODEL.format(BOX), "s0.sdf")
    for k in range(1, 9):
        includes = "".join(f"<include><uri>s{k - 1}.sdf</uri><name>q{n}</name></include>" for n in range(10))
        sdf(tmp_path, f'<model name="m{k}">{includes}</model>', f"s{k}.sdf")
    with pytest.raises(StarnavError, match=f"makes more than {MOST_LINKS} links"):
        Models().model(tmp_path / "s8.sdf")
    text = "".join(f"- add_directives: {{file: s2.sdf, n: {n}}}\n" for n in range(20))
    with pytest.raises(StarnavError, match=f"makes more than {MOST_LINKS} links"):
        Models().directives(text, tmp_path)
    assert len(prepared(tmp_path / "s1.sdf").findall("model/include")) == 10


@pytest.mark.parametrize(
    "content",
    [
        LINK.format("<sphere><radius>1e200</radius></sphere>"),
        LINK.format("<box><size>1 inf 1</size></box>"),
        LINK.format("<cylinder><radius>1</radius><length>nan</length></cylinder>"),
        f"<pose>1e9 0 0 0 0 0</pose>{BOX}",
    ],
)
def test_what_reaches_farther_than_any_world_is_refused(content: str, tmp_path: Path) -> None:
    with pytest.raises(StarnavError, match=r"m.sdf has .* in <(geometry|pose)>; allowed: at most 1e\+06 m"):
        Models().model(sdf(tmp_path, MODEL.format(content)))


@pytest.mark.parametrize("face", ["99999999 2 3", "0 1 2", "-4 1 2", "1/1 2/1 3/1", "1//1 2//1 3//1", "a b c"])
def test_a_face_of_what_is_not_there_is_refused(face: str, tmp_path: Path) -> None:
    (tmp_path / "bad.obj").write_text(f"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf -1 -2 -3\nf {face}\n")
    with pytest.raises(StarnavError, match="bad.obj: line 6 names the (vertex|texture|normal) .* of (0|3)"):
        Models().model(sdf(tmp_path, MODEL.format(LINK.format("<mesh><uri>bad.obj</uri></mesh>"))))
