"""Beams that err for good are told from things that are as thin."""

import math
from dataclasses import replace

import numpy as np
import pytest

from drake_starnav import LaserScan, LidarParameters, World
from drake_starnav.geometry.se2 import compose_poses
from drake_starnav.lidar.faulty_beams import FEWEST_SCANS, FaultyBeams
from drake_starnav.lidar.mounts import ON_AXIS, Mount
from drake_starnav.worlds.view import scan_from, visible_shapes

LIDAR = LidarParameters(noise=0.005)
ASIDE = Mount(0.2, -0.1, 0.7, True)
POLES = World(
    "poles", (0, 0, 0), (0, 0), cylinders=[(1.0, 0.0, 0.004), (-1.1, 0.7, 0.003)], bounds=(-3.0, -3.0, 3.0, 3.0)
)


def turning(scans: int, rate: float = 0.05) -> list[np.ndarray]:
    return [np.array((0.0, 0.0, rate * k)) for k in range(scans)]


def circling(scans: int) -> list[np.ndarray]:
    """Poses around the first pole, which stays at one bearing."""
    turns = [0.04 * k for k in range(scans)]
    return [np.array((1.0 - 0.6 * math.cos(a), -0.6 * math.sin(a), a)) for a in turns]


def found(poses, mount: Mount = ON_AXIS, spoilt=lambda scan: scan) -> tuple[FaultyBeams, LaserScan]:
    state, shapes = FaultyBeams.none(), visible_shapes(POLES)
    for k, pose in enumerate(poses):
        scan = scan_from(shapes, compose_poses(pose, mount[:3]), LIDAR, 0, k)
        if mount.upside_down:
            scan = replace(scan, ranges=np.roll(scan.ranges[::-1], 1))
        state, scan = state.after(spoilt(scan), pose, mount)
    return state, scan


def with_range(scan: LaserScan, beam: int, value: float) -> LaserScan:
    ranges = scan.ranges.copy()
    ranges[beam] = value
    return replace(scan, ranges=ranges, lost_beams=True)


@pytest.mark.parametrize("mount", [ON_AXIS, ASIDE])
@pytest.mark.parametrize("beam", [0, 17, 359])
@pytest.mark.parametrize("value", [0.27, 0.6, 1.5])
def test_a_beam_that_alone_hits_something_wherever_it_turns_errs_and_its_hits_are_lost(mount, beam, value) -> None:
    state, scan = found(turning(2 * FEWEST_SCANS), mount, lambda scan: with_range(scan, beam, value))
    assert np.flatnonzero(state.faulty).tolist() == [beam]
    assert math.isnan(scan.ranges[beam])


@pytest.mark.parametrize("mount", [ON_AXIS, ASIDE])
@pytest.mark.parametrize("poses", [turning(60), turning(60, 0.0), circling(60)])
def test_thin_poles_are_no_faults_even_where_they_stay_in_one_beam(mount, poses) -> None:
    state, scan = found(poses, mount)
    assert not state.faulty.any() and not np.isnan(scan.ranges).any()


def test_a_faulty_beam_that_sees_what_those_beside_it_see_counts() -> None:
    state, _ = found(turning(2 * FEWEST_SCANS), spoilt=lambda scan: with_range(scan, 17, 0.6))
    scan = scan_from(visible_shapes(POLES), np.array((0.3, 0.0, 0.0)), LIDAR, 0, 99)
    state, after = state.after(scan, np.zeros(3), ON_AXIS)
    assert state.faulty[17] and np.array_equal(after.ranges, scan.ranges)


def test_lost_beams_do_not_begin_the_count_anew_and_other_scans_do() -> None:
    poses = turning(3 * FEWEST_SCANS)
    odd = iter(range(len(poses)))
    state, _ = found(poses, spoilt=lambda scan: with_range(scan, 17, math.nan if next(odd) % 2 else 0.6))
    assert state.faulty[17]
    full = scan_from(visible_shapes(POLES), np.zeros(3), LIDAR, 0, 0)
    half = replace(full, ranges=full.ranges[::2], angle_increment=2.0 * full.angle_increment)
    state, _ = state.after(half, np.zeros(3), ON_AXIS)
    assert len(state.faulty) == 180 and not state.faulty.any()
