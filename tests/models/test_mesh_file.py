"""Mesh files: whole ones are read as they are, with their colours; torn ones are refused."""

import numpy as np
import pytest
import trimesh
from trimesh.exchange.dae import export_collada
from trimesh.exchange.gltf import export_gltf

from drake_starnav.errors import StarnavError
from drake_starnav.models.mesh_file import Y_UP, compute_depth_in_hull, read_mesh_surfaces, read_mesh_triangles

CORNERS = np.array([(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3)], float)
FACES = np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])


def solid(corners: np.ndarray = CORNERS) -> trimesh.Trimesh:
    return trimesh.Trimesh(corners, FACES, process=False)


ASCII_STL, BINARY_STL = solid().export(file_type="stl_ascii").encode(), solid().export(file_type="stl")


def dae(unit: str = "1") -> bytes:
    return export_collada(solid()).replace(b"<up_axis>", f'<unit meter="{unit}"/><up_axis>'.encode())


def gltf(mesh: trimesh.Trimesh, transform: np.ndarray | None = None) -> bytes:
    """One file with all that it holds."""
    scene = trimesh.Scene()
    scene.add_geometry(mesh, transform=transform)
    return export_gltf(scene, merge_buffers=True, embed_buffers=True)["model.gltf"]


def as_set(vertices: np.ndarray, triangles: np.ndarray) -> set:
    return {frozenset(map(tuple, corners)) for corners in vertices[np.asarray(triangles)].round(6) + 0.0}


@pytest.mark.parametrize(
    ("data", "suffix", "axes"),
    [
        (ASCII_STL, ".stl", np.eye(3)),
        (BINARY_STL, ".stl", np.eye(3)),
        (dae(), ".dae", np.eye(3)),
        (dae(unit="0.01"), ".dae", 0.01 * np.eye(3)),
        (gltf(solid()), ".gltf", Y_UP[:3, :3]),
    ],
)
def test_triangles_are_those_of_the_file(data: bytes, suffix: str, axes: np.ndarray) -> None:
    vertices, triangles = read_mesh_triangles(data, suffix)
    assert len(vertices) == 4
    assert as_set(vertices, triangles) == as_set(CORNERS @ axes.T, FACES)


@pytest.mark.parametrize("suffix", [".stl", ".dae", ".gltf"])
@pytest.mark.parametrize("data", [b"", b"\0\xff" * 300, b"hello\n" * 50, b"solid empty\nendsolid empty\n"])
def test_what_is_no_mesh_is_refused(data: bytes, suffix: str) -> None:
    with pytest.raises(StarnavError, match=f"not a valid {suffix} file|a {suffix} file without triangles"):
        read_mesh_triangles(data, suffix)


@pytest.mark.parametrize("suffix", [".glb", ".dae"])
def test_surfaces_have_the_colours_of_the_file(suffix: str) -> None:
    scene = trimesh.Scene()
    for k, color in enumerate([(255, 0, 0, 255), (0, 128, 0, 255)]):
        material = trimesh.visual.material.PBRMaterial(baseColorFactor=color)
        box = trimesh.creation.box((1.0, 2.0, 3.0 + k))
        box.visual = trimesh.visual.TextureVisuals(material=material)
        scene.add_geometry(box)
    data = scene.export(file_type="glb") if suffix == ".glb" else export_collada(scene.dump())
    surfaces = read_mesh_surfaces(data, suffix)
    red, green = sorted(surfaces, key=lambda surface: surface.color[1])
    up = np.abs(Y_UP[:3, :3]) if suffix == ".glb" else np.eye(3)
    for surface, color, height in ((red, (1.0, 0.0, 0.0), 3.0), (green, (0.0, 0.502, 0.0), 4.0)):
        assert surface.color[:3] == pytest.approx(color, abs=0.01)
        assert np.ptp(surface.vertices, axis=0) == pytest.approx(up @ (1.0, 2.0, height))


def test_how_deep_a_mesh_is_dented() -> None:
    assert compute_depth_in_hull(CORNERS, FACES) == pytest.approx(0.0, abs=1e-12)
    dent = np.vstack((CORNERS, [(0.0, 0.0, 0.3)]))  # the bottom's corner, pushed in
    faces = np.array([(0, 2, 4), (2, 1, 4), (1, 0, 4), *FACES[1:]])
    assert compute_depth_in_hull(dent, faces) == pytest.approx(0.1)
    assert compute_depth_in_hull(CORNERS[:3], FACES[:1]) == 0.0
