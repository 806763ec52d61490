"""The surfaces of Drake's `Mesh` and `Convex` shapes as triangles and convex faces."""

import contextlib
import tempfile
from pathlib import Path

import numpy as np
from pydrake.geometry import Convex, Mesh, ReadObjToTriangleSurfaceMesh, RefineVolumeMeshIntoVtkFileContents

from drake_starnav.errors import StarnavError
from drake_starnav.models import mesh_file
from drake_starnav.utils.files import explain_missing_file

READABLE = (".obj", ".gltf", ".vtk")
DENT = 0.01
"""Drake collides with the convex hull of a mesh. Where that differs by more than this, it is no contact to go by, m."""


def compute_hull_faces(shape: Convex, name: str) -> tuple[np.ndarray, list[np.ndarray]]:
    """The convex hull of a shape: vertices, shape (n, 3), m, and the indices of each face; errors as of
    `read_shape_triangles`."""
    try:
        hull = shape.GetConvexHull()
    except RuntimeError as error:
        raise _make_unreadable_error(shape, name, str(error)) from error
    face_data, faces, k = hull.face_data(), [], 0
    while k < len(face_data):  # count, then that many vertices
        faces.append(np.array(face_data[k + 1 : k + 1 + face_data[k]]))
        k += 1 + face_data[k]
    return np.array([hull.vertex(k) for k in range(hull.num_vertices())]), faces


def read_shape_triangles(shape: Mesh, name: str) -> tuple[np.ndarray, np.ndarray]:
    """The surface of a mesh: vertices, shape (n, 3), m, scaled, and triangles, shape (m, 3).

    Args:
        shape: a surface in an .obj or .gltf file, or tetrahedra in a .vtk file, of which the boundary is the surface.
        name: of the geometry, for errors.

    Raises:
        StarnavError: the file is missing or broken, or of another kind.
    """
    readers = {".obj": _read_obj, ".gltf": _read_gltf, ".vtk": _read_vtk}
    extension = shape.extension().lower()
    if extension not in readers:
        raise _make_unreadable_error(shape, name, f"a {extension} file")
    if shape.source().is_path() and (why := explain_missing_file(Path(shape.source().path()))):
        raise _make_unreadable_error(shape, name, why)
    try:
        vertices, triangles = readers[extension](shape)
    except (RuntimeError, OSError, StarnavError) as error:
        raise _make_unreadable_error(shape, name, str(error)) from error
    if not len(triangles):
        raise _make_unreadable_error(shape, name, "no triangles")
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise _make_unreadable_error(shape, name, f"a corner that is not among its {len(vertices)} vertices")
    return vertices * shape.scale3(), triangles


def is_hollow(shape: Mesh, name: str) -> bool:
    """Whether some of a mesh's surface lies more than `DENT` inside its hull; errors as in `read_shape_triangles`."""
    return mesh_file.compute_depth_in_hull(*read_shape_triangles(shape, name)) > DENT


def _read_obj(shape: Mesh) -> tuple[np.ndarray, np.ndarray]:
    source = shape.source()
    with contextlib.ExitStack() as stack:
        if source.is_path():
            path = Path(source.path())
        else:
            path = Path(stack.enter_context(tempfile.TemporaryDirectory())) / "mesh.obj"
            path.write_bytes(source.in_memory().mesh_file.contents())
        mesh = ReadObjToTriangleSurfaceMesh(path)
    triangle_corners = [[triangle.vertex(k) for k in range(3)] for triangle in mesh.triangles()]
    return np.array(mesh.vertices()), np.array(triangle_corners)


def _read_gltf(shape: Mesh) -> tuple[np.ndarray, np.ndarray]:
    source = shape.source()
    if source.is_path():
        path = Path(source.path())
        return mesh_file.read_mesh_triangles(path.read_bytes(), ".gltf", path.parent)
    files = source.in_memory().supporting_files.items()
    buffer_files = {uri: Path(f).read_bytes() if isinstance(f, str | Path) else f.contents() for uri, f in files}
    return mesh_file.read_mesh_triangles(source.in_memory().mesh_file.contents(), ".gltf", buffer_files)


def _read_vtk(shape: Mesh) -> tuple[np.ndarray, np.ndarray]:
    # Drake reads the file and writes it in one fixed form: all points, then all cells as "4 a b c d".
    file_words = RefineVolumeMeshIntoVtkFileContents(shape.source()).split()
    points_start, cells = file_words.index("POINTS"), file_words.index("CELLS")
    vertices = np.array(file_words[points_start + 3 : cells], dtype=float).reshape(-1, 3)
    cell_count = int(file_words[cells + 1])
    tetrahedra = np.array(file_words[cells + 3 : cells + 3 + 5 * cell_count], dtype=np.int64).reshape(-1, 5)[:, 1:]
    sides = tetrahedra[:, [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]].reshape(-1, 3)
    _, first_sides, side_counts = np.unique(np.sort(sides, axis=1), axis=0, return_index=True, return_counts=True)
    return vertices, sides[first_sides[side_counts == 1]]


def _make_unreadable_error(shape: Mesh | Convex, name: str, why: str) -> StarnavError:
    kinds = ", ".join(READABLE)
    return StarnavError(
        f"lidar: mesh {shape.source().description()} of geometry {name}: {why}; allowed: a readable {kinds} file"
    )
