"""Shapes that Drake's parser does not read, as OBJ files in a temporary folder."""

import atexit
import functools
import hashlib
import math
import tempfile
from collections.abc import Callable
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from drake_starnav.geometry.mesh_file import mesh_triangles
from drake_starnav.worlds.convex_parts import convex_parts

MOST_PIECES = 200
"""A mesh of more connected pieces stays one."""
_AROUND = 96
"""Sides of a cone, which is up to 0.05 % too wide."""


@functools.lru_cache(maxsize=1000)
def converted(data: bytes, suffix: str) -> tuple[Path, ...]:
    """The connected pieces of a mesh as OBJ files."""
    vertices, triangles = mesh_triangles(data, suffix)
    edges = np.vstack((triangles[:, :2], triangles[:, 1:]))
    graph = coo_array((np.ones(len(edges)), edges.T), (len(vertices), len(vertices)))
    count, label = connected_components(graph, directed=False)
    if count > MOST_PIECES:
        count, label = 1, np.zeros(len(vertices), int)
    return tuple(write_obj(vertices, triangles[label[triangles[:, 0]] == k]) for k in range(count))


def _cone(shape: Element) -> list[tuple[np.ndarray, np.ndarray]]:
    radius, length = (float(shape.findtext(name, "nan")) for name in ("radius", "length"))
    if not (0.0 < radius < math.inf and 0.0 < length < math.inf):
        raise ValueError(f"radius {radius:g}, length {length:g}")
    bearing = 2.0 * np.pi / _AROUND * np.arange(_AROUND)
    rim = radius / math.cos(np.pi / _AROUND) * np.column_stack((np.cos(bearing), np.sin(bearing)))
    vertices = np.vstack((np.column_stack((rim, np.full(_AROUND, -0.5 * length))), [(0.0, 0.0, 0.5 * length)]))
    following = np.roll(np.arange(_AROUND), -1)
    sides = np.column_stack((np.arange(_AROUND), following, np.full(_AROUND, _AROUND)))
    return [(vertices, np.vstack((sides, _fan(np.arange(_AROUND)[::-1]))))]


def _polyline(shape: Element) -> list[tuple[np.ndarray, np.ndarray]]:
    """Prisms over the convex parts of an outline."""
    height = float(shape.findtext("height", "1"))
    if not 0.0 < height < math.inf:
        raise ValueError(f"height {height:g}")
    outline = np.array([[float(x) for x in (point.text or "").split()] for point in shape.iter("point")])
    meshes = []
    for part in convex_parts(outline):
        n = len(part)
        vertices = np.vstack([np.column_stack((part, np.full(n, z))) for z in (0.0, height)])
        k, following = np.arange(n), np.roll(np.arange(n), -1)
        sides = np.vstack((np.column_stack((k, following, following + n)), np.column_stack((k, following + n, k + n))))
        meshes.append((vertices, np.vstack((sides, _fan(k[::-1]), _fan(k + n)))))
    return meshes


SOLIDS: dict[str, Callable[[Element], list[tuple[np.ndarray, np.ndarray]]]] = {"cone": _cone, "polyline": _polyline}
"""Makes the meshes, vertices (n, 3) and triangles (m, 3), of elements of SDF that Drake leaves out."""


def _fan(corners: np.ndarray) -> np.ndarray:
    """The triangles of a convex polygon."""
    return np.column_stack((np.full(len(corners) - 2, corners[0]), corners[1:-1], corners[2:]))


def write_obj(vertices: np.ndarray, triangles: np.ndarray) -> Path:
    used, index = np.unique(triangles, return_inverse=True)
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices[used].tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (index.reshape(-1, 3) + 1).tolist()]
    return write(("\n".join(lines) + "\n").encode(), ".obj")


@functools.cache
def _folder() -> Path:
    """Where converted files lie until the process ends: Drake reads meshes when it comes to them."""
    folder = tempfile.TemporaryDirectory(prefix="drake_starnav_")
    atexit.register(folder.cleanup)
    return Path(folder.name)


def write(data: bytes, suffix: str) -> Path:
    """A file of that content, which has it already if it was written before."""
    path = _folder() / f"{hashlib.sha256(data).hexdigest()[:20]}{suffix}"
    if not path.exists():
        path.write_bytes(data)
    return path
