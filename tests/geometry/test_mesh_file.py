"""STL, COLLADA and glTF files: whole ones are read as they are, all others refused in no time."""

import base64
import json
import struct

import numpy as np
import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.mesh_file import depth_in_hull, gltf_triangles, mesh_triangles

CORNERS = np.array([(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3)], float)
FACES = np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])
POINTS = np.array([(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3), (1, 1, 1)], dtype="<f4")


def ascii_stl(corners: np.ndarray = CORNERS) -> bytes:
    facets = "".join(
        "facet normal 0 0 0\nouter loop\n"
        + "".join("vertex {} {} {}\n".format(*corners[k]) for k in face)
        + "endloop\nendfacet\n"
        for face in FACES
    )
    return f"solid a mesh\n{facets}endsolid a mesh\n".encode()


def binary_stl(header: bytes = b"solid") -> bytes:
    facets = b"".join(struct.pack("<12fH", 0, 0, 0, *CORNERS[face].ravel(), 0) for face in FACES)
    return header.ljust(80, b"\0") + struct.pack("<I", len(FACES)) + facets


SHOWN = '<instance_geometry url="#g"/>'


def dae(corners=CORNERS, unit: str = "1", nodes: str = "", shown: str = SHOWN, mode: str = "triangles") -> bytes:
    index = " ".join(str(k) for face in FACES for k in face)
    counts = f"<vcount>{' '.join(['3'] * len(FACES))}</vcount>" if mode == "polylist" else ""
    return (
        '<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">'
        f'<asset><unit meter="{unit}"/><up_axis>Y_UP</up_axis></asset><library_geometries><geometry id="g"><mesh>'
        f'<source id="p"><float_array id="a" count="12">{" ".join(str(x) for x in corners.ravel())}</float_array>'
        '<technique_common><accessor source="#a" count="4" stride="3"><param name="X" type="float"/>'
        '<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>'
        '<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>'
        f'<{mode} count="4"><input semantic="VERTEX" source="#v" offset="0"/>{counts}<p>{index}</p></{mode}>'
        f"</mesh></geometry></library_geometries><library_nodes>{nodes}</library_nodes><library_visual_scenes>"
        '<visual_scene id="s"><node id="n">'
        f"{shown}"
        '</node></visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>'
    ).encode()


def as_set(vertices: np.ndarray, triangles: np.ndarray) -> set:
    return {frozenset(map(tuple, vertices[triangle].round(6))) for triangle in triangles}


@pytest.mark.parametrize(
    ("data", "suffix", "scale"),
    [
        (ascii_stl(), ".stl", 1.0),
        (ascii_stl().upper(), ".stl", 1.0),
        (binary_stl(), ".stl", 1.0),
        (binary_stl(b"made by a program"), ".stl", 1.0),
        (dae(), ".dae", 1.0),
        (dae(unit="0.01"), ".dae", 0.01),
        (dae(mode="polylist"), ".dae", 1.0),
        (
            dae(nodes='<node id="k"><instance_geometry url="#g"/></node>', shown='<instance_node url="#k"/>'),
            ".dae",
            1.0,
        ),
        (dae(shown='<matrix>2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 1</matrix><instance_geometry url="#g"/>'), ".dae", 2.0),
    ],
)
def test_triangles_are_those_of_the_file(data: bytes, suffix: str, scale: float) -> None:
    vertices, triangles = mesh_triangles(data, suffix)
    assert len(vertices) == 4
    assert as_set(vertices, triangles) == as_set(scale * CORNERS, FACES)


DOUBLING = '<node id="k0"><instance_geometry url="#g"/></node>' + "".join(
    f'<node id="k{k}"><instance_node url="#k{k - 1}"/><instance_node url="#k{k - 1}"/></node>' for k in range(1, 40)
)
LOOP = '<node id="k"><instance_node url="#k"/></node>'
ENTITIES = b'<!DOCTYPE x [<!ENTITY a "aaaaaaaa"><!ENTITY b "&a;&a;&a;&a;">]>'


@pytest.mark.parametrize("suffix", [".stl", ".dae"])
@pytest.mark.parametrize(
    "data", [b"", b"\0\xff" * 300, b"hello\n" * 50, b"solid empty\nendsolid empty\n", b"[" * 10**6]
)
def test_what_is_no_mesh_is_refused(data: bytes, suffix: str) -> None:
    with pytest.raises(StarnavError, match=f"not a valid {suffix} file|a {suffix} file without triangles"):
        mesh_triangles(data, suffix)


@pytest.mark.parametrize("share", [0.1, 0.3, 0.5, 0.7, 0.9, 0.99])
@pytest.mark.parametrize(("data", "suffix"), [(ascii_stl(), ".stl"), (binary_stl(), ".stl"), (dae(), ".dae")])
def test_a_file_that_is_cut_off_is_refused(data: bytes, suffix: str, share: float) -> None:
    with pytest.raises(StarnavError, match="not a valid"):
        mesh_triangles(data[: int(share * (len(data) - 16))], suffix)


@pytest.mark.parametrize(
    ("data", "suffix", "message"),
    [
        (ascii_stl(np.where(CORNERS == 3, np.nan, CORNERS)), ".stl", "not finite"),
        (ascii_stl(np.where(CORNERS == 3, np.inf, CORNERS)), ".stl", "not finite"),
        (dae(np.where(CORNERS == 3, np.nan, CORNERS)), ".dae", "not finite"),
        (dae(np.where(CORNERS == 3, np.inf, CORNERS)), ".dae", "not finite"),
        (
            binary_stl()[:80] + struct.pack("<I", 2**32 - 1) + binary_stl()[84:],
            ".stl",
            "4294967295 facets in 284 bytes",
        ),
        (dae().replace(b"<p>0", b"<p>9"), ".dae", "not a valid"),
        (dae().replace(b"0 2 1 0", b"-5 2 1 0"), ".dae", "not a valid"),
        (dae().replace(b"<COLLADA", ENTITIES + b"<COLLADA"), ".dae", "with entities"),
        (dae(nodes=DOUBLING, shown='<instance_node url="#k39"/>'), ".dae", "shows more than 20000 geometries"),
        (
            dae(nodes='<node id="k"><instance_node url="#k"/></node>', shown='<instance_node url="#k"/>'),
            ".dae",
            "shows",
        ),
    ],
)
def test_hostile_files_are_refused(data: bytes, suffix: str, message: str) -> None:
    with pytest.raises(StarnavError, match=message):
        mesh_triangles(data, suffix)


def test_how_deep_a_mesh_is_dented() -> None:
    assert depth_in_hull(CORNERS, FACES) == pytest.approx(0.0, abs=1e-12)
    dent = np.vstack((CORNERS, [(0.0, 0.0, 0.3)]))  # the bottom's corner, pushed in
    faces = np.array([(0, 2, 4), (2, 1, 4), (1, 0, 4), *FACES[1:]])
    assert depth_in_hull(dent, faces) == pytest.approx(0.1)
    assert depth_in_hull(CORNERS[:3], FACES[:1]) == 0.0


def document(points=POINTS, order=None, mode=None, nodes=({"mesh": 0},), stride=12, order_type="<u2", uri=None):
    """A file with one primitive; `stride` (bytes) leaves gaps between the points."""
    spaced = np.zeros((len(points), stride // 4), dtype="<f4")
    spaced[:, :3] = points
    order = np.arange(len(points)) if order is None else np.asarray(order)
    data = spaced.tobytes() + order.astype(order_type).tobytes()
    component = {"<u1": 5121, "<u2": 5123, "<u4": 5125}[order_type]
    primitive = {"attributes": {"POSITION": 0}, "indices": 1, **({} if mode is None else {"mode": mode})}
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [dict(node) for node in nodes],
        "meshes": [{"primitives": [primitive]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(points), "type": "VEC3"},
            {"bufferView": 1, "componentType": component, "count": len(order), "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": spaced.nbytes, "byteStride": stride},
            {"buffer": 0, "byteOffset": spaced.nbytes, "byteLength": order.nbytes},
        ],
        "buffers": [
            {
                "byteLength": len(data),
                "uri": uri or f"data:application/octet-stream;base64,{base64.b64encode(data).decode()}",
            }
        ],
    }


def triangles_of(gltf, load=None):
    vertices, triangles = gltf_triangles(json.dumps(gltf), load or (lambda uri: pytest.fail(uri)))
    return vertices[triangles]


@pytest.mark.parametrize("stride", [12, 20])
@pytest.mark.parametrize("order_type", ["<u1", "<u2", "<u4"])
def test_points_and_indices_are_read_from_any_layout(stride, order_type):
    order = [0, 1, 2, 4, 2, 3]
    found = triangles_of(document(order=order, stride=stride, order_type=order_type))
    assert np.array_equal(found, POINTS[order].reshape(2, 3, 3))


@pytest.mark.parametrize(("mode", "corners"), [(4, [(0, 1, 2)]), (5, [(0, 1, 2), (1, 2, 3), (2, 3, 4)])])
def test_triangles_and_strips(mode, corners):
    assert np.array_equal(triangles_of(document(mode=mode)), POINTS[np.array(corners)])


def test_a_fan_shares_its_first_point():
    found = triangles_of(document(order=[4, 0, 1, 2], mode=6))
    assert np.array_equal(found, POINTS[[(4, 0, 1), (4, 1, 2)]])


def test_without_indices_points_are_taken_in_order():
    gltf = document(points=POINTS[:3])
    del gltf["meshes"][0]["primitives"][0]["indices"]
    assert np.array_equal(triangles_of(gltf), POINTS[None, :3])


def test_nodes_carry_their_children():
    half = np.sqrt(0.5)
    turn = {"rotation": [0, 0, half, half], "scale": [1, 2, 3], "translation": [5, 0, 0], "children": [1]}
    shift = {"matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 7, 1], "mesh": 0}
    (found,) = triangles_of(document(points=POINTS[:3], nodes=[turn, shift]))
    x, y, z = (POINTS[:3].astype(float) + (0.0, 0.0, 7.0)).T * [[1.0], [2.0], [3.0]]
    assert np.allclose(found, np.column_stack((5.0 - y, x, z)), atol=1e-12)


def test_a_mesh_that_two_nodes_show_is_there_twice_and_one_outside_of_the_scene_is_not():
    nodes = [{"children": [1, 2]}, {"mesh": 0}, {"mesh": 0, "translation": [0, 0, 1]}, {"mesh": 0}]
    first, second = triangles_of(document(points=POINTS[:3], nodes=nodes))
    assert np.array_equal(first + (0, 0, 1), second)


def test_buffers_may_be_files():
    gltf = document(order=[0, 1, 2])
    data = base64.b64decode(gltf["buffers"][0]["uri"].partition(",")[2])
    gltf["buffers"][0]["uri"] = "my%20data.bin"
    names = []
    triangles_of(gltf, lambda uri: names.append(uri) or data)
    assert names == ["my data.bin"]


def broken(change):
    gltf = document(order=[0, 1, 2])
    change(gltf)
    return json.dumps(gltf)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "not a valid glTF 2.0 file"),
        ("[]", "not a valid glTF 2.0 file"),
        ("{}", "without triangles"),
        (b"\xff\xfe\xfa", "not a valid glTF 2.0 file"),
        (broken(lambda g: g["nodes"][0].update(mesh=3)), "not a valid"),
        (broken(lambda g: g["nodes"][0].update(children=[0])), "a node is reached twice"),
        (broken(lambda g: g["accessors"][0].update(count=10**6)), "not a valid"),
        (broken(lambda g: g["accessors"][0].update(type="VEC2")), "VEC2 instead of VEC3"),
        (broken(lambda g: g["accessors"][0].update(count=2)), "index 2 of 2 vertices"),
        (broken(lambda g: g["accessors"][0].update(sparse={})), "compressed or sparse"),
        (broken(lambda g: g["meshes"][0]["primitives"][0].update(mode=1)), "without triangles"),
        (
            broken(lambda g: g["meshes"][0]["primitives"][0].update(extensions={"KHR_draco_mesh_compression": {}})),
            "compressed meshes",
        ),
    ],
)
def test_bad_files_are_refused_with_a_reason(text, message):
    with pytest.raises(StarnavError, match=message):
        gltf_triangles(text, lambda uri: b"")
