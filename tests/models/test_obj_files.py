"""Meshes, cones, planes and extruded outlines as OBJ files."""

import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull

from drake_starnav.models.obj_files import MOST_PIECES, SOLIDS, convert_mesh, write_obj
from tests.models.test_mesh_file import CORNERS, FACES, solid


def points_of(path: Path) -> np.ndarray:
    return np.array([line.split()[1:] for line in path.read_text().splitlines() if line.startswith("v")], float)


def is_closed_outwards(vertices: np.ndarray, triangles: np.ndarray) -> bool:
    """Whether the triangles bound their convex hull, seen counter-clockwise from outside."""
    mesh = trimesh.Trimesh(vertices, triangles, process=False)
    return mesh.is_watertight and mesh.volume == pytest.approx(ConvexHull(vertices).volume)


def test_a_file_is_written_once_and_holds_what_is_used() -> None:
    path = write_obj(np.vstack((CORNERS, [(9, 9, 9)])), FACES)
    assert write_obj(CORNERS, FACES) == path
    np.testing.assert_array_equal(points_of(path), CORNERS)
    assert [line for line in path.read_text().splitlines() if line.startswith("f")][0] == "f 1 3 2"


def test_files_outlast_a_forked_process() -> None:
    script = """
import multiprocessing
from drake_starnav.models.obj_files import write
path = write(b"", ".obj")
child = multiprocessing.get_context("fork").Process(target=int)
child.start()
child.join()
assert child.exitcode == 0 and path.exists()
print(path)
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert not Path(done.stdout.strip()).exists()


@pytest.mark.parametrize("count", [3, MOST_PIECES + 1])
def test_pieces_are_apart_unless_they_are_too_many(count: int) -> None:
    pieces = [solid(CORNERS + (9.0 * k, 0.0, 0.0)) for k in range(count)]
    files = convert_mesh(trimesh.util.concatenate(pieces).export(file_type="stl"), ".stl")
    assert len(files) == (count if count <= MOST_PIECES else 1)
    assert sum(len(points_of(file)) for file in files) == 4 * count


def test_a_cone_is_around_the_round_one() -> None:
    shape = ElementTree.fromstring("<cone><radius>0.5</radius><length>2</length></cone>")
    ((vertices, triangles),) = SOLIDS["cone"](shape)
    assert (vertices[:, 2].min(), vertices[:, 2].max()) == (-1.0, 1.0)
    assert np.hypot(*vertices[:-1, :2].T).min() >= 0.5
    assert ConvexHull(vertices).volume == pytest.approx(np.pi * 0.25 * 2.0 / 3.0, rel=2e-3)
    assert is_closed_outwards(vertices, triangles)


@pytest.mark.parametrize("clockwise", [False, True])
def test_an_outline_is_extruded_in_convex_parts(clockwise: bool) -> None:
    outline = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)][:: -1 if clockwise else 1]
    points = "".join(f"<point>{x} {y}</point>" for x, y in outline)
    meshes = SOLIDS["polyline"](ElementTree.fromstring(f"<polyline>{points}<height>0.5</height></polyline>"))
    assert sum(ConvexHull(vertices).volume for vertices, _ in meshes) == pytest.approx(3.0 * 0.5)
    assert all(is_closed_outwards(*mesh) for mesh in meshes)


@pytest.mark.parametrize("normal", ["", "0 0 1", "0 0 -2", "-1 0 0", "0.3 -0.2 0.5"])
def test_a_plane_is_a_slab_below_it(normal: str) -> None:
    element = f"<normal>{normal}</normal>" if normal else ""
    ((vertices, triangles),) = SOLIDS["plane"](ElementTree.fromstring(f"<plane>{element}</plane>"))
    direction = np.array((normal or "0 0 1").split(), float)
    heights = vertices @ direction / np.linalg.norm(direction)
    np.testing.assert_allclose(np.sort(heights), [-1.0] * 4 + [0.0] * 4, atol=1e-9)
    assert is_closed_outwards(vertices, triangles)
