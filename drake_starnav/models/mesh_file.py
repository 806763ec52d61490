"""The triangles of mesh files and their colours, read by trimesh."""

import io
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from drake_starnav.errors import StarnavError, said_by

Y_UP = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
"""From glTF's axes, y up, to those with z up, as Drake turns it."""


COLOR = re.compile(rb"(<(color|float)\b[^>]*>)([^<]*)(?=</)")
"""Numbers of a look in COLLADA."""

Beside = Path | Mapping[str, bytes]


class Surface(NamedTuple):
    """Triangles of one colour: vertices, shape (n, 3), m; triangles, shape (m, 3), indices of vertices; and red, green,
    blue, alpha, 0 to 1, or None of a file that gives none."""

    vertices: np.ndarray
    triangles: np.ndarray
    color: tuple[float, ...] | None


def read_mesh_triangles(data: bytes, suffix: str, folder: Beside = Path()) -> tuple[np.ndarray, np.ndarray]:
    """The triangles of a file, in metres.

    As in Gazebo, `up_axis` of COLLADA is ignored; glTF is turned from y up to z up, as Drake does.

    Args:
        data: content of the file.
        suffix: ".stl", ".dae", ".obj", ".gltf" or ".glb".
        folder: the folder of the files that it names, or their contents.

    Returns:
        vertices, shape (n, 3), each place once, and triangles, shape (m, 3), indices of vertices.

    Raises:
        StarnavError: the file is broken or empty; the caller adds its name.
    """
    mesh = _read_scene(data, suffix, folder).to_mesh()
    vertices, index = np.unique(mesh.vertices[mesh.faces].reshape(-1, 3), axis=0, return_inverse=True)
    return vertices, index.reshape(-1, 3)


def read_mesh_surfaces(data: bytes, suffix: str, folder: Beside = Path()) -> list[Surface]:
    """The same triangles, by their colours; of a texture its mean."""
    meshes_by_color: dict[tuple[float, ...] | None, list[Any]] = {}
    for mesh in _read_scene(data, suffix, folder).dump():
        mesh_look, color = mesh.visual, None
        if mesh_look.defined:
            mesh_look = mesh_look.to_color() if mesh_look.kind == "texture" else mesh_look
            color = tuple((np.atleast_2d(mesh_look.vertex_colors).mean(axis=0) / 255.0).round(3).tolist())
        meshes_by_color.setdefault(color, []).append(mesh)
    surfaces = []
    for color, meshes in meshes_by_color.items():
        first_vertices = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
        triangles = [mesh.faces + k for mesh, k in zip(meshes, first_vertices[:-1], strict=True)]
        surfaces.append(Surface(np.vstack([mesh.vertices for mesh in meshes]), np.vstack(triangles), color))
    return surfaces


def _read_scene(data: bytes, suffix: str, folder: Beside) -> Any:
    """The scene of a file; errors as of `read_mesh_triangles`."""
    import trimesh  # late: only worlds and robots with such meshes need it

    if suffix == ".dae":
        data = COLOR.sub(_make_readable_color, data)
    try:
        if suffix == ".gltf":
            json.loads(data)  # of which trimesh says that another file is missing
        file_resolver = trimesh.resolvers.FilePathResolver(str(folder), True) if isinstance(folder, Path) else folder
        with np.errstate(invalid="ignore"):  # what is not finite is refused below
            scene = trimesh.load_scene(io.BytesIO(data), file_type=suffix[1:], resolver=file_resolver, process=False)
            meshes = [mesh for mesh in scene.dump() if isinstance(mesh, trimesh.Trimesh) and len(mesh.faces)]
        mesh_corners = [mesh.vertices[mesh.faces] for mesh in meshes]
    except Exception as error:  # whatever a broken file makes a reader raise
        raise StarnavError(f"not a valid {suffix} file ({type(error).__name__}: {said_by(error)})") from None
    if not meshes:
        raise StarnavError(f"a {suffix} file without triangles")
    if not all(np.isfinite(part).all() for part in mesh_corners):
        raise StarnavError("a corner that is not finite")
    if suffix == ".dae":
        scene = scene.convert_units("meters")
    return scene.apply_transform(Y_UP) if suffix in (".gltf", ".glb") else scene


def _make_readable_color(look: re.Match[bytes]) -> bytes:
    """Numbers of a look as they are, or white where one is none: a reader would give up the triangles as well."""
    try:
        [float(word) for word in look[3].split()]
        return look[0]
    except ValueError:
        return look[1] + (b"1 1 1 1" if look[2] == b"color" else b"1")


def compute_depth_in_hull(vertices: np.ndarray, triangles: np.ndarray) -> float:
    """How deep inside the convex hull of a mesh the middles of its triangles lie, at most, m; 0 of a flat mesh."""
    try:
        hull_planes = ConvexHull(vertices).equations
    except QhullError:
        return 0.0
    middles = vertices[triangles].mean(axis=1)
    least_depths = np.full(len(middles), np.inf)
    for x, y, z, offset in hull_planes:
        np.minimum(least_depths, -(middles @ (x, y, z) + offset), out=least_depths)
    return float(least_depths.max())
