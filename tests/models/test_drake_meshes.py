import base64
import json
from pathlib import Path

import numpy as np
import pytest
import trimesh
from pydrake.common import MemoryFile
from pydrake.geometry import Convex, InMemoryMesh, Mesh

from drake_starnav.errors import StarnavError
from drake_starnav.models.drake_meshes import compute_hull_faces, read_shape_triangles
from tests.models.test_mesh_file import gltf

# Two tetrahedra that share the face 0 1 2.
VERTICES = np.array([(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3), (0.5, 0.5, -1)], dtype=float)
OUTSIDE = {(0, 1, 3), (0, 2, 3), (1, 2, 3), (0, 1, 4), (0, 2, 4), (1, 2, 4)}
VTK = (
    "# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 double\n"
    + "\n".join(" ".join(map(str, vertex)) for vertex in VERTICES)
    + "\nCELLS 2 10\n4 0 1 2 3\n4 0 2 1 4\nCELL_TYPES 2\n10\n10\n"
)
OBJ = "".join(f"v {x} {y} {z}\n" for x, y, z in VERTICES) + "".join(
    f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in sorted(OUTSIDE)
)
POSE = trimesh.transformations.euler_matrix(0.5 * np.pi, 0.0, 0.0)
POSE[:3, :3] = POSE[:3, :3] @ np.diag((1.0, 2.0, 1.0))
POSE[:3, 3] = 0.1, 0.2, 0.3
GLTF = gltf(trimesh.Trimesh(VERTICES, sorted(OUTSIDE), process=False), POSE).decode()
CONTENTS = {".obj": OBJ, ".vtk": VTK, ".gltf": GLTF}
SCALE = np.array([2.0, 0.5, 1.5])


def mesh_of(extension, tmp_path, in_memory):
    if in_memory:
        file = MemoryFile(contents=CONTENTS[extension], extension=extension, filename_hint="solid")
        return Mesh(InMemoryMesh(mesh_file=file), SCALE)
    path = tmp_path / f"solid{extension}"
    path.write_text(CONTENTS[extension])
    return Mesh(str(path), SCALE)


def enclosed_volume(vertices, triangles):
    """Of the solid, m3, whichever way its faces are turned: from a point inside."""
    a, b, c = np.moveaxis(vertices[triangles] - vertices.mean(axis=0), 1, 0)
    return np.abs(np.einsum("ij,ij->i", a, np.cross(b, c))).sum() / 6.0


@pytest.mark.parametrize("in_memory", [False, True])
@pytest.mark.parametrize("extension", sorted(CONTENTS))
def test_triangles_are_where_drake_has_the_mesh(extension, in_memory, tmp_path):
    shape = mesh_of(extension, tmp_path, in_memory)
    vertices, triangles = read_shape_triangles(shape, "solid")
    hull = shape.GetConvexHull()  # the solid is convex except for the edge 0 1, so all its vertices are on the hull
    expected = {tuple(np.round(hull.vertex(k), 6) + 0.0) for k in range(hull.num_vertices())}
    assert {tuple(np.round(vertex, 6) + 0.0) for vertex in vertices[np.unique(triangles)]} >= expected
    assert vertices.min(axis=0) == pytest.approx(np.min([*expected], axis=0), abs=1e-6)
    assert vertices.max(axis=0) == pytest.approx(np.max([*expected], axis=0), abs=1e-6)
    extra = 2.0 if extension == ".gltf" else 1.0  # its node's scale
    assert enclosed_volume(vertices, triangles) == pytest.approx(extra * np.prod(SCALE) * 8.0 / 6.0, rel=1e-6)


def test_a_file_beside_a_gltf_file_is_found(tmp_path):
    content = json.loads(GLTF)
    data = base64.b64decode(content["buffers"][0]["uri"].partition(",")[2])
    content["buffers"][0]["uri"] = "solid.bin"
    path = tmp_path / "solid.gltf"
    path.write_text(json.dumps(content))
    with pytest.raises(StarnavError, match=r"solid\.gltf.* of geometry post: .*solid\.bin"):
        read_shape_triangles(Mesh(str(path), 1.0), "post")
    (tmp_path / "solid.bin").write_bytes(data)
    beside = read_shape_triangles(Mesh(str(path), SCALE), "post")
    file = MemoryFile(contents=json.dumps(content), extension=".gltf", filename_hint="solid")
    binary = MemoryFile(contents=data, extension=".bin", filename_hint="solid.bin")
    for extra in (binary, Path(tmp_path / "solid.bin")):
        shape = Mesh(InMemoryMesh(mesh_file=file, supporting_files={"solid.bin": extra}), SCALE)
        for found, expected in zip(read_shape_triangles(shape, "post"), beside, strict=True):
            assert np.array_equal(found, expected)
    with pytest.raises(StarnavError, match=r"not a valid \.gltf file .*solid\.bin"):
        read_shape_triangles(Mesh(InMemoryMesh(mesh_file=file), 1.0), "post")


def test_a_hull_has_flat_faces_around_all_vertices(tmp_path):
    path = tmp_path / "solid.obj"
    path.write_text(OBJ)
    vertices, faces = compute_hull_faces(Convex(str(path), 2.0), "solid")
    for face in faces:
        normal = np.cross(vertices[face[1]] - vertices[face[0]], vertices[face[2]] - vertices[face[0]])
        heights = (vertices - vertices[face[0]]) @ normal / np.linalg.norm(normal)
        assert (heights < 1e-9).all() and np.allclose(heights[face], 0.0, atol=1e-9)
