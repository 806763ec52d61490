"""Slices of solids with a known result."""

import math

import numpy as np
import pytest

from drake_starnav.lidar.plane_slices import SLAB, Slab, Solids, find_scan_planes, slice_solids


def level(height: float) -> np.ndarray:
    """The plane z = height."""
    return np.array(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, height)))


def box(half: float) -> Solids:
    corners = np.array([(x, y, z) for x in (-half, half) for y in (-half, half) for z in (-half, half)])
    faces = [(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]
    return Solids(np.zeros((0, 15)), corners, np.arange(0, 25, 4), np.array(faces).ravel())


def test_a_face_within_the_plane_is_cut_when_the_solid_is_below_it() -> None:
    assert len(slice_solids(box(0.5), level(0.5))) == 4
    assert len(slice_solids(box(0.5), level(-0.5))) == 0


def test_a_scan_plane_keeps_its_key_while_the_frame_slides_in_it() -> None:
    X_WS = np.column_stack((np.eye(3), (0.0, 0.0, 0.2)))
    X_WF = np.array([np.column_stack((np.eye(3), (1.0, 2.0, 0.0)))])
    X_WS_begin = np.column_stack((np.eye(3)[[1, 0, 2]], (0.3, 0.1, 0.2)))  # its x axis is W's y axis
    keys, planes, (begin, end), changed = find_scan_planes(X_WF, X_WS_begin, X_WS, np.full((1, 4), np.nan))
    assert list(changed) == [0]
    np.testing.assert_allclose(planes[0], level(0.2), atol=1e-9)
    np.testing.assert_allclose(end[0], (-1.0, -2.0, 0.0), atol=1e-9)
    np.testing.assert_allclose(begin[0], (-0.7, -1.9, 0.5 * math.pi), atol=1e-9)
    X_WF[0, :2, 3] += 0.5
    _, _, (begin, end), changed = find_scan_planes(X_WF, X_WS, X_WS, keys)
    assert len(changed) == 0
    np.testing.assert_allclose(end[0], (-1.5, -2.5, 0.0), atol=1e-9)
    np.testing.assert_array_equal(begin, end)


@pytest.mark.parametrize("seed", range(20))
def test_faces_near_a_plane_are_all_that_planes_near_it_cut(seed: int) -> None:
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-2.0, 2.0, (400, 1, 3)) + rng.uniform(-0.1, 0.1, (400, 3, 3))
    corners[0, :, :2] *= 1e4  # as the ground
    solids = Solids(np.zeros((0, 15)), corners.reshape(-1, 3), np.arange(0, 1201, 3), np.arange(1200))
    slab = Slab.of(solids, tilted(rng, 0.2))
    assert 0 < len(slab.solids.vertices) < 400 and slab.far < 5.0
    held = 0
    for size in SLAB * np.geomspace(1e-3, 2.0, 40):
        plane = np.array(slab.plane) + size * (tilted(rng, 1.0) - level(0.0))
        plane[0] /= np.linalg.norm(plane[0])
        plane[1] -= (plane[1] @ plane[0]) * plane[0]
        plane[1] /= np.linalg.norm(plane[1])
        if slab.contains_cut_of(plane):
            held += 1
            np.testing.assert_array_equal(slice_solids(slab.solids, plane), slice_solids(solids, plane))
    assert 5 < held < 35
    assert not slab.contains_cut_of(level(10.0 * SLAB))


def tilted(rng: np.random.Generator, lean: float) -> np.ndarray:
    """A plane that leans by up to so much in both directions, through a place near the origin."""
    (a, b), height = rng.uniform(-lean, lean, 2), rng.uniform(-0.3, 0.3)
    first = np.array((1.0, 0.0, a)) / math.hypot(1.0, a)
    second = np.cross((-a, -b, 1.0), first) / math.sqrt(1.0 + a * a + b * b)
    return np.array((first, second, (0.0, 0.0, height)))
