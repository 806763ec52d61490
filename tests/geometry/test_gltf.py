import base64
import json

import numpy as np
import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.gltf import gltf_triangles

CORNERS = np.array([(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3), (1, 1, 1)], dtype="<f4")


def document(points=CORNERS, order=None, mode=None, nodes=({"mesh": 0},), stride=12, order_type="<u2", uri=None):
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
    assert np.array_equal(found, CORNERS[order].reshape(2, 3, 3))


@pytest.mark.parametrize(("mode", "corners"), [(4, [(0, 1, 2)]), (5, [(0, 1, 2), (1, 2, 3), (2, 3, 4)])])
def test_triangles_and_strips(mode, corners):
    assert np.array_equal(triangles_of(document(mode=mode)), CORNERS[np.array(corners)])


def test_a_fan_shares_its_first_point():
    found = triangles_of(document(order=[4, 0, 1, 2], mode=6))
    assert np.array_equal(found, CORNERS[[(4, 0, 1), (4, 1, 2)]])


def test_without_indices_points_are_taken_in_order():
    gltf = document(points=CORNERS[:3])
    del gltf["meshes"][0]["primitives"][0]["indices"]
    assert np.array_equal(triangles_of(gltf), CORNERS[None, :3])


def test_nodes_carry_their_children():
    half = np.sqrt(0.5)
    turn = {"rotation": [0, 0, half, half], "scale": [1, 2, 3], "translation": [5, 0, 0], "children": [1]}
    shift = {"matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 7, 1], "mesh": 0}
    (found,) = triangles_of(document(points=CORNERS[:3], nodes=[turn, shift]))
    x, y, z = (CORNERS[:3].astype(float) + (0.0, 0.0, 7.0)).T * [[1.0], [2.0], [3.0]]
    assert np.allclose(found, np.column_stack((5.0 - y, x, z)), atol=1e-12)


def test_a_mesh_that_two_nodes_show_is_there_twice_and_one_outside_of_the_scene_is_not():
    nodes = [{"children": [1, 2]}, {"mesh": 0}, {"mesh": 0, "translation": [0, 0, 1]}, {"mesh": 0}]
    first, second = triangles_of(document(points=CORNERS[:3], nodes=nodes))
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
