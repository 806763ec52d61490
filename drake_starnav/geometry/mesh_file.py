"""The triangles of STL, COLLADA and glTF files, of which Drake reads none; also of broken and hostile ones."""

import base64
import io
import json
import re
from collections.abc import Callable, Iterator
from typing import Any
from urllib.parse import unquote
from xml.etree import ElementTree

import numpy as np
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.transform import Rotation

from drake_starnav.errors import StarnavError, said_by

MOST_SHOWN = 20_000
"""Geometries that the nodes of a COLLADA scene may show, each as often as it is shown."""
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_COMPONENTS = {5121: "<u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC3": 3}


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


def gltf_triangles(text: bytes | str, load: Callable[[str], bytes]) -> tuple[np.ndarray, np.ndarray]:
    """The same of a .gltf file's scene, in its own frame (y up): only positions and indices.

    `load` returns the content of another file by its URI. Compressed meshes are refused.
    """
    try:
        gltf = json.loads(text)
        buffers = [_buffer(entry, load) for entry in gltf.get("buffers", [])]
        pieces = list(_pieces(gltf, buffers))
    except StarnavError:
        raise
    except (ValueError, KeyError, IndexError, TypeError, AttributeError, RecursionError) as error:
        raise StarnavError(f"not a valid glTF 2.0 file ({type(error).__name__}: {error})") from error
    if not pieces:
        raise StarnavError("a glTF file without triangles")
    offsets = np.cumsum([0, *(len(vertices) for vertices, _ in pieces)])
    triangles = [corners + offset for (_, corners), offset in zip(pieces, offsets[:-1], strict=True)]
    return np.vstack([vertices for vertices, _ in pieces]), np.vstack(triangles)


def _pieces(gltf: dict[str, Any], buffers: list[bytes]) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Vertices and triangles of each primitive of the scene."""
    nodes = gltf.get("nodes", [])
    if "scenes" in gltf:
        roots = gltf["scenes"][gltf.get("scene", 0)].get("nodes", [])
    else:
        roots = sorted(set(range(len(nodes))) - {child for node in nodes for child in node.get("children", [])})
    stack = [(root, np.eye(4)) for root in reversed(roots)]
    visits = 0
    while stack:
        index, parent = stack.pop()
        visits += 1
        if visits > len(nodes):
            raise ValueError("a node is reached twice")
        node = nodes[index]
        transform = parent @ _transform(node)
        stack += [(child, transform) for child in reversed(node.get("children", []))]
        if "mesh" not in node:
            continue
        for primitive in gltf["meshes"][node["mesh"]]["primitives"]:
            mode = primitive.get("mode", 4)  # 4 triangles, 5 a strip, 6 a fan; points and lines have no surface
            if mode < 4:
                continue
            if "KHR_draco_mesh_compression" in primitive.get("extensions", {}):
                raise StarnavError("a glTF file with compressed meshes")
            points = _accessor(gltf, buffers, primitive["attributes"]["POSITION"], "VEC3").astype(float)
            order = np.arange(len(points))
            if "indices" in primitive:
                order = _accessor(gltf, buffers, primitive["indices"], "SCALAR").astype(np.int64).ravel()
            if len(order) and order.max() >= len(points):
                raise ValueError(f"index {order.max()} of {len(points)} vertices")
            yield points @ transform[:3, :3].T + transform[:3, 3], _corners(order, mode)


def _corners(order: np.ndarray, mode: int) -> np.ndarray:
    if mode == 4:
        return order[: len(order) // 3 * 3].reshape(-1, 3)
    first = order[:-2] if mode == 5 else np.broadcast_to(order[:1], max(len(order) - 2, 0))
    return np.column_stack((first, order[1:-1], order[2:]))


def _transform(node: dict[str, Any]) -> np.ndarray:
    """Pose and scale of a node in its parent, shape (4, 4)."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=float).reshape(4, 4).T  # column-major
    rotation = Rotation.from_quat(node.get("rotation", (0.0, 0.0, 0.0, 1.0))).as_matrix()
    transform = np.eye(4)
    transform[:3, :3] = rotation * np.array(node.get("scale", (1.0, 1.0, 1.0)), dtype=float)
    transform[:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
    return transform


def _accessor(gltf: dict[str, Any], buffers: list[bytes], index: int, kind: str) -> np.ndarray:
    """The elements of an accessor, shape (count, width)."""
    accessor = gltf["accessors"][index]
    if "bufferView" not in accessor or "sparse" in accessor:
        raise StarnavError("a glTF file with compressed or sparse meshes")
    if accessor["type"] != kind:
        raise ValueError(f"accessor {index} holds {accessor['type']} instead of {kind}")
    view = gltf["bufferViews"][accessor["bufferView"]]
    component = np.dtype(_COMPONENTS[accessor["componentType"]])
    width, count = _WIDTHS[kind], accessor["count"]
    step = view.get("byteStride", width * component.itemsize)
    data = buffers[view["buffer"]]
    start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    return np.ndarray((count, width), component, data, start, (step, component.itemsize))


def _buffer(entry: dict[str, Any], load: Callable[[str], bytes]) -> bytes:
    uri = entry["uri"]
    if uri.startswith("data:"):
        return base64.b64decode(uri.partition(",")[2])
    return load(unquote(uri))
