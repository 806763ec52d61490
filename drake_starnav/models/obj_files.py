"""Shapes that Drake's parser does not read, as OBJ files in a temporary folder."""

import atexit
import functools
import hashlib
import math
import os
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from drake_starnav.errors import StarnavError, shown
from drake_starnav.models.mesh_file import read_mesh_surfaces, read_mesh_triangles
from drake_starnav.worlds.convex_parts import split_into_convex_parts
from drake_starnav.worlds.footprints import make_cylinder_vertices

MOST_PIECES = 200
"""A mesh of more connected pieces stays one."""


@functools.lru_cache(maxsize=1000)
def convert_mesh(data: bytes, suffix: str) -> tuple[Path, ...]:
    """The connected pieces of a mesh as OBJ files."""
    vertices, triangles = read_mesh_triangles(data, suffix)
    edges = np.vstack((triangles[:, :2], triangles[:, 1:]))
    edge_graph = coo_array((np.ones(len(edges)), edges.T), (len(vertices), len(vertices)))
    piece_count, vertex_labels = connected_components(edge_graph, directed=False)
    if piece_count > MOST_PIECES:
        piece_count, vertex_labels = 1, np.zeros(len(vertices), int)
    return tuple(write_obj(vertices, triangles[vertex_labels[triangles[:, 0]] == k]) for k in range(piece_count))


@functools.lru_cache(maxsize=1000)
def paint_surfaces(data: bytes, suffix: str, folder: Path) -> tuple[tuple[Path, tuple[float, ...] | None], ...]:
    """The surfaces of a mesh as OBJ files with their colours; `folder` has the files that it names."""
    surfaces = read_mesh_surfaces(data, suffix, folder)
    return tuple((write_obj(surface.vertices, surface.triangles), surface.color) for surface in surfaces)


def _make_cone(shape: Element) -> list[tuple[np.ndarray, np.ndarray]]:
    radius, length = (float(shape.findtext(name, "nan")) for name in ("radius", "length"))
    if not (0.0 < radius < math.inf and 0.0 < length < math.inf):
        raise ValueError(f"radius {radius:g}, length {length:g}")
    rim_corners, _ = np.split(make_cylinder_vertices(radius, length), 2)
    corners = np.arange(len(rim_corners))
    side_triangles = np.column_stack((corners, np.roll(corners, -1), np.full(len(rim_corners), len(rim_corners))))
    return [(np.vstack((rim_corners, (0.0, 0.0, 0.5 * length))), np.vstack((side_triangles, _make_fan(corners[::-1]))))]


def _make_polyline_prisms(shape: Element) -> list[tuple[np.ndarray, np.ndarray]]:
    """Prisms over the convex parts of an outline."""
    height = float(shape.findtext("height", "1"))
    if not 0.0 < height < math.inf:
        raise ValueError(f"height {height:g}")
    outline = np.array([[float(x) for x in (point.text or "").split()] for point in shape.iter("point")])
    return [make_prism(part, 0.0, height) for part in split_into_convex_parts(outline)]


def _make_plane_slab(shape: Element) -> list[tuple[np.ndarray, np.ndarray]]:
    """A slab with the plane as its upper face, 1 m thick, that reaches 100 m to each side of the origin."""
    normal = np.array([float(x) for x in shape.findtext("normal", "0 0 1").split()])
    if normal.shape != (3,) or not 0.0 < np.linalg.norm(normal) < math.inf:
        raise ValueError(f"normal {normal.tolist()}")
    plane_vectors = np.linalg.svd(normal[None])[2][1:]
    slab_axes = np.vstack((plane_vectors, np.cross(*plane_vectors)))  # the last is the normal or its opposite
    slab_axes[1:] *= math.copysign(1.0, float(slab_axes[2] @ normal))
    vertices, triangles = make_prism(100.0 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]), -1.0, 0.0)
    return [(vertices @ slab_axes, triangles)]


def make_prism(outline: np.ndarray, low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and triangles of the upright prism over a convex outline, between two heights."""
    n = len(outline)
    vertices = np.vstack([np.column_stack((outline, np.full(n, z))) for z in (low, high)])
    k, following = np.arange(n), np.roll(np.arange(n), -1)
    sides = np.vstack((np.column_stack((k, following, following + n)), np.column_stack((k, following + n, k + n))))
    return vertices, np.vstack((sides, _make_fan(k[::-1]), _make_fan(k + n)))


SOLIDS: dict[str, Callable[[Element], list[tuple[np.ndarray, np.ndarray]]]] = {
    "cone": _make_cone,
    "plane": _make_plane_slab,
    "polyline": _make_polyline_prisms,
}
"""Makes the meshes, vertices (n, 3) and triangles (m, 3), of elements of SDF that Drake leaves out or that crash it: a
half space among twenty shapes does."""


def _make_fan(corners: np.ndarray) -> np.ndarray:
    return np.column_stack((np.full(len(corners) - 2, corners[0]), corners[1:-1], corners[2:]))


def check_faces(data: bytes) -> None:
    """Raise `StarnavError` for a face of an OBJ file that names a vertex, texture or normal which is not there.

    Drake's reader does not look.
    """
    file_rows = [line.split() or [b""] for line in data.splitlines()]
    counts = [sum(row[0] == kind for row in file_rows) for kind in (b"v", b"vt", b"vn")]
    for number, row in enumerate(file_rows, 1):
        for corner in row[1:] if row[0] == b"f" else ():
            for text, count, noun in zip(corner.split(b"/"), counts, ("vertex", "texture", "normal"), strict=False):
                if text and not (text.lstrip(b"-").isdigit() and 0 < abs(int(text)) <= count):
                    file_text = text.decode(errors="replace")
                    raise StarnavError(f"line {number} names the {noun} {shown(file_text)} of {count}")


def write_obj(vertices: np.ndarray, triangles: np.ndarray) -> Path:
    used_vertices, index = np.unique(triangles, return_inverse=True)
    return write(format_obj(vertices[used_vertices], index.reshape(-1, 3)).encode(), ".obj")


def format_obj(vertices: np.ndarray, triangles: np.ndarray) -> str:
    """The content of an OBJ file of that mesh, vertices (n, 3) and triangles (m, 3)."""
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (triangles + 1).tolist()]
    return "\n".join(lines) + "\n"


@functools.cache
def _make_folder() -> Path:
    """Where converted files lie until the process ends: Drake reads meshes when it comes to them."""
    folder, owner = tempfile.mkdtemp(prefix="drake_starnav_"), os.getpid()

    def remove() -> None:
        if os.getpid() == owner:  # a forked process that ends inherits this
            shutil.rmtree(folder, ignore_errors=True)

    atexit.register(remove)
    return Path(folder)


def write(data: bytes, suffix: str) -> Path:
    """A file of that content, which has it already if it was written before."""
    path = _make_folder() / f"{hashlib.sha256(data).hexdigest()[:20]}{suffix}"
    if not path.exists():
        path.write_bytes(data)
    return path
