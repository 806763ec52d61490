"""The triangles of STL and COLLADA files, which Drake does not read; also of broken and hostile ones."""

import io
import re
from typing import Any
from xml.etree import ElementTree

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from drake_starnav.errors import StarnavError, said_by

MOST_SHOWN = 20_000
"""Geometries that the nodes of a COLLADA scene may show, each as often as it is shown."""
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def mesh_triangles(data: bytes, suffix: str) -> tuple[np.ndarray, np.ndarray]:
    """The triangles of a file, in metres, in its own axes: as in Gazebo, `up_axis` of COLLADA is ignored.

    Args:
        data: content of the file.
        suffix: ".stl" or ".dae".

    Returns:
        vertices, shape (n, 3), and triangles, shape (m, 3), indices of vertices.

    Raises:
        StarnavError: the file is broken, empty or would take too much memory; the caller adds its name.
    """
    try:
        corners = _stl(data) if suffix == ".stl" else _dae(data)
    except StarnavError:
        raise
    except Exception as error:  # whatever a broken file makes a reader raise
        raise StarnavError(f"not a valid {suffix} file ({type(error).__name__}: {said_by(error)})") from None
    if not len(corners):
        raise StarnavError(f"a {suffix} file without triangles")
    if not np.isfinite(corners).all():
        raise StarnavError("a corner that is not finite")
    vertices, index = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    return vertices, index.reshape(-1, 3)


def depth_in_hull(vertices: np.ndarray, triangles: np.ndarray) -> float:
    """How deep inside the convex hull of a mesh the middles of its triangles lie, at most, m; 0 of a flat mesh."""
    try:
        planes = ConvexHull(vertices).equations
    except QhullError:
        return 0.0
    middles = vertices[triangles].mean(axis=1)
    depth = np.full(len(middles), np.inf)
    for x, y, z, offset in planes:
        np.minimum(depth, -(middles @ (x, y, z) + offset), out=depth)
    return float(depth.max())


def _stl(data: bytes) -> np.ndarray:
    """The corners of a file's facets, shape (m, 3, 3)."""
    count = int.from_bytes(data[80:84], "little")
    if len(data) == 84 + _FACET.itemsize * count:
        return np.frombuffer(data, _FACET, count, 84)["corners"].astype(float)
    text = data.decode("ascii", "replace").lower()
    if not (text.lstrip().startswith("solid") and "endsolid" in text):
        raise ValueError(f"{count} facets in {len(data)} bytes")
    corners = re.findall(r"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", text)
    return np.array(corners, float).reshape(-1, 3, 3)


def _dae(data: bytes) -> np.ndarray:
    import collada  # late: only worlds with such meshes need it

    _check_dae(data)
    scene = collada.Collada(io.BytesIO(data), ignore=[collada.common.DaeUnsupportedError])
    pieces = [np.zeros((0, 3, 3))]
    for shown in scene.scene.objects("geometry"):
        for part in shown.primitives():
            if isinstance(part, collada.polylist.BoundPolylist):
                part = part.triangleset()  # noqa: PLW2901
            if isinstance(part, collada.triangleset.BoundTriangleSet):  # the others are lines
                pieces.append(part.vertex[part.vertex_index])
    return np.vstack(pieces).astype(float) * (scene.assetInfo.unitmeter or 1.0)


def _check_dae(data: bytes) -> None:
    """Raise a `StarnavError` for what would take its reader too long, or what it would read as something else."""
    if re.search(rb"<!(DOCTYPE|ENTITY)", data):
        raise StarnavError("a COLLADA file with entities")  # a few may expand to billions
    root = ElementTree.fromstring(data)
    for values in root.iter():
        if values.tag.endswith("float_array") and "nan" in (values.text or "").lower():
            raise StarnavError("a corner that is not finite")
    nodes = {f"#{node.get('id')}": node for node in root.iter() if node.tag.endswith("}node") and node.get("id")}
    known: dict[str, int] = {}
    scenes = [element for element in root.iter() if element.tag.endswith("visual_scene")]
    if sum(_shown(element, nodes, known) for element in scenes) > MOST_SHOWN:
        raise StarnavError(f"a COLLADA file that shows more than {MOST_SHOWN} geometries")


def _shown(element: Any, nodes: dict[str, Any], known: dict[str, int]) -> int:
    """How many geometries an element shows, itself and by the nodes that it names."""
    count = 0
    for part in element.iter():
        kind = part.tag.rpartition("}")[2]
        if kind == "instance_geometry":
            count += 1
        elif kind == "instance_node":
            name = part.get("url", "")
            if name not in known:
                known[name] = MOST_SHOWN + 1  # of a node that shows itself
                known[name] = _shown(nodes[name], nodes, known) if name in nodes else 0
            count = min(count + known[name], MOST_SHOWN + 1)
    return count
