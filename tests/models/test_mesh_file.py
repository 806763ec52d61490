"""Mesh files: whole ones are read as they are, with their colours; torn ones are refused."""

import base64
import json
import struct

import numpy as np
import pytest
import trimesh
from trimesh.exchange.dae import export_collada

from drake_starnav.errors import StarnavError
from drake_starnav.models.mesh_file import Y_UP, depth_in_hull, mesh_surfaces, mesh_triangles

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
    return {frozenset(map(tuple, corners)) for corners in vertices[np.asarray(triangles)].round(6) + 0.0}


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


@pytest.mark.parametrize("suffix", [".stl", ".dae", ".gltf"])
@pytest.mark.parametrize("data", [b"", b"\0\xff" * 300, b"hello\n" * 50, b"solid empty\nendsolid empty\n"])
def test_what_is_no_mesh_is_refused(data: bytes, suffix: str) -> None:
    with pytest.raises(StarnavError, match=f"not a valid {suffix} file|a {suffix} file without triangles"):
        mesh_triangles(data, suffix)


@pytest.mark.parametrize("suffix", [".glb", ".dae"])
def test_surfaces_have_the_colours_of_the_file(suffix: str) -> None:
    scene = trimesh.Scene()
    for k, color in enumerate([(255, 0, 0, 255), (0, 128, 0, 255)]):
        material = trimesh.visual.material.PBRMaterial(baseColorFactor=color)
        box = trimesh.creation.box((1.0, 2.0, 3.0 + k))
        box.visual = trimesh.visual.TextureVisuals(material=material)
        scene.add_geometry(box)
    data = scene.export(file_type="glb") if suffix == ".glb" else export_collada(scene.dump())
    surfaces = mesh_surfaces(data, suffix)
    red, green = sorted(surfaces, key=lambda surface: surface.color[1])
    up = np.abs(Y_UP[:3, :3]) if suffix == ".glb" else np.eye(3)
    for surface, color, height in ((red, (1.0, 0.0, 0.0), 3.0), (green, (0.0, 0.502, 0.0), 4.0)):
        assert surface.color[:3] == pytest.approx(color, abs=0.01)
        assert np.ptp(surface.vertices, axis=0) == pytest.approx(up @ (1.0, 2.0, height))


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
    order = order.astype(order_type)
    data = spaced.tobytes() + order.tobytes()
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


@pytest.mark.parametrize("stride", [12, 20])
@pytest.mark.parametrize("order_type", ["<u1", "<u2", "<u4"])
def test_gltf_is_read_from_any_layout_with_z_up(stride, order_type):
    gltf = document(order=[0, 1, 2, 4, 2, 3], stride=stride, order_type=order_type)
    vertices, triangles = mesh_triangles(json.dumps(gltf).encode(), ".gltf")
    assert as_set(vertices, triangles) == as_set(POINTS.astype(float) @ Y_UP[:3, :3].T, [(0, 1, 2), (4, 2, 3)])


def test_buffers_may_be_files():
    gltf = document(order=[0, 1, 2])
    data = base64.b64decode(gltf["buffers"][0]["uri"].partition(",")[2])
    gltf["buffers"][0]["uri"] = "data.bin"
    text = json.dumps(gltf).encode()
    assert len(mesh_triangles(text, ".gltf", {"data.bin": data})[1]) == 1
    with pytest.raises(StarnavError, match="data.bin"):
        mesh_triangles(text, ".gltf")
