import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_starnav.lidar.raycast import (
    CIRCLE,
    COLUMNS,
    CONIC,
    SEGMENT,
    Fan,
    Place,
    Shapes,
    cast_groups,
    cast_rolling,
    cast_rows,
    make_circle_rows,
    make_segment_rows,
)

BEAMS = 180
FAN = Fan.regular(-np.pi, 2.0 * np.pi / BEAMS, BEAMS)


def ellipse_rows(ellipses: np.ndarray) -> np.ndarray:
    """Whole ellipses, shape (n, 5): x, y, semi-axes p and q, m, bearing of the first semi-axis, rad, as rows."""
    ellipses = np.asarray(ellipses, dtype=float).reshape(-1, 5)
    x, y, p, q, angle = ellipses.T
    u, v = np.cos(angle), np.sin(angle)
    rows = np.zeros((len(ellipses), COLUMNS))
    rows[:, :3] = np.column_stack((x, y, np.maximum(p, q)))
    rows[:, 3] = CONIC
    rows[:, 4] = (u / p) ** 2 + (v / q) ** 2
    rows[:, 5] = u * v * (p**-2 - q**-2)
    rows[:, 6] = (v / p) ** 2 + (u / q) ** 2
    rows[:, 9] = -1.0
    rows[:, 12], rows[:, 13] = -1.0, 1.0
    return rows


def cast(rows, pose=(0.0, 0.0, 0.0), fan=FAN, reach=5.0):
    ranges = np.full(len(fan.directions), np.inf)
    cast_groups(Shapes.of([rows]), np.array([pose]), fan, ranges, reach)
    return np.where(ranges < reach, ranges, np.inf)


def brute(pose, fan, reach, circles=(), segments=(), ellipses=()):
    """Reference result by the textbook: every beam against every shape."""
    x, y, yaw = pose
    angles = np.arctan2(fan.directions[:, 1], fan.directions[:, 0]) + yaw
    best = np.full(len(angles), np.inf)
    for k, (u, v) in enumerate(np.column_stack((np.cos(angles), np.sin(angles)))):
        found = []
        for cx, cy, p, q, angle in [*((c[0], c[1], c[2], c[2], 0.0) for c in circles), *ellipses]:
            c, s = np.cos(angle), np.sin(angle)
            turned = np.array([[c, s], [-s, c]])
            o = turned @ (x - cx, y - cy) / (p, q)
            d = turned @ (u, v) / (p, q)
            roots = np.roots([d @ d, 2.0 * o @ d, o @ o - 1.0])
            found += [r.real for r in roots if abs(r.imag) < 1e-12 and r.real >= 0.0]
        for x1, y1, x2, y2 in segments:
            matrix = np.array([[u, x1 - x2], [v, y1 - y2]])
            if abs(np.linalg.det(matrix)) > 1e-12:
                t, share = np.linalg.solve(matrix, (x1 - x, y1 - y))
                if t >= 0.0 and 0.0 <= share <= 1.0:
                    found.append(t)
        best[k] = min(found, default=np.inf)
    return np.where(best < reach, best, np.inf)


def test_no_beam_slips_through_a_corner():
    corners = np.array([(1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)])
    square = make_segment_rows(np.hstack((corners, np.roll(corners, -1, axis=0))))
    for yaw in (0.0, np.pi / 4, 0.1, 1e-15):
        assert np.isfinite(cast(square, (0.0, 0.0, yaw), Fan.regular(0.0, np.pi / 4, 8))).all()


@settings(max_examples=25)
@given(seed=st.integers(0, 10**6), part=st.booleans())
def test_ranges_agree_with_brute_force(seed, part):
    rng = np.random.default_rng(seed)
    circles = np.column_stack((rng.uniform(-4, 4, (6, 2)), rng.uniform(0.05, 1.0, 6)))
    segments = rng.uniform(-5, 5, (6, 4))
    ellipses = np.column_stack((rng.uniform(-4, 4, (4, 2)), rng.uniform(0.1, 1.5, (4, 2)), rng.uniform(-4, 4, 4)))
    pose = (*rng.uniform(-3, 3, 2), rng.uniform(-10, 10))
    fan = Fan.regular(rng.uniform(-4, 4), rng.uniform(0.01, 0.05), 100) if part else FAN
    rows = np.vstack((make_circle_rows(circles), make_segment_rows(segments), ellipse_rows(ellipses)))
    truth = brute(pose, fan, 5.0, circles, segments, ellipses)
    assert np.allclose(cast(rows, pose, fan), truth, rtol=0.0, atol=1e-8)
    groups = Shapes.of([rows[:7], rows[7:]])
    ranges = np.full(len(fan.directions), np.inf)
    cast_groups(groups, np.array([pose, pose]), fan, ranges, 5.0)
    assert np.array_equal(np.where(ranges < 5.0, ranges, np.inf), cast(rows, pose, fan))


@settings(max_examples=20)
@given(seed=st.integers(0, 10**6), most=st.sampled_from((0.3, 3.0)), clockwise=st.booleans())
def test_a_rolling_scan_is_each_beam_cast_from_its_own_pose(seed, most, clockwise):
    rng = np.random.default_rng(seed)
    rows = np.vstack((make_circle_rows(rng.uniform(0.1, 4.0, (8, 3))), make_segment_rows(rng.uniform(-5, 5, (8, 4)))))
    begin, turn = rng.uniform(-3, 3, 3), rng.uniform(-most, most)
    end = begin + (*rng.uniform(-0.2, 0.2, 2), turn + 2.0 * np.pi * rng.integers(-1, 2))  # yaw wraps
    swept = np.full(BEAMS, np.inf)
    cast_rolling(Shapes.of([rows]), begin[None], end[None], FAN._replace(clockwise=clockwise), swept, 5.0)
    for i in range(0, BEAMS, 7):
        pose = begin + (1 - i / BEAMS if clockwise else (i + 1) / BEAMS) * np.array((*(end - begin)[:2], turn))
        alone = cast(rows, pose)
        assert min(swept[i], 5.0) == pytest.approx(min(alone[i], 5.0), abs=1e-9)


def tangent_to(kind: str, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A random shape as rows, a point of it, and the direction of the shape there; of a segment, an end."""
    centre, size, angle = rng.uniform(-3.0, 3.0, 2), 10.0 ** rng.uniform(-2.0, 1.0), rng.uniform(-4.0, 4.0)
    turned = np.array([(np.cos(angle), -np.sin(angle)), (np.sin(angle), np.cos(angle))])
    if kind == "segment":
        return make_segment_rows(np.hstack((centre, centre + size * turned[0]))), centre, turned[0]
    axes = size * np.array((1.0, 1.0 if kind == "circle" else rng.uniform(0.01, 1.0)))
    place, way = turned @ (axes * (0.0, 1.0)), turned @ (axes * (1.0, 0.0))
    rows = make_circle_rows((*centre, size)) if kind == "circle" else ellipse_rows((*centre, *axes, angle))
    return rows, centre + place, way / np.hypot(*way)


def distance_from(row: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Distance of points (n, 2) from the curve of a shape, m; from an ellipse to first order."""
    away = points - row[:2]
    if row[3] == CIRCLE:
        return np.abs(np.hypot(*away.T) - row[2])
    if row[3] == SEGMENT:
        return shapely.distance(shapely.LineString(row[4:8].reshape(2, 2)), shapely.points(points))
    slope = away @ row[[4, 5, 5, 6]].reshape(2, 2)
    return np.abs((slope * away).sum(axis=1) + row[9]) / (2.0 * np.hypot(*slope.T))


@settings(max_examples=150)
@given(
    seed=st.integers(0, 10**6),
    kind=st.sampled_from(("segment", "circle", "ellipse")),
    rolling=st.sampled_from((None, "counterclockwise", "clockwise")),
    away=st.one_of(st.just(0.0), st.floats(1e-9, 5.0)),
)
def test_a_beam_in_line_with_a_shape_ends_on_it(seed, kind, rolling, away):
    """Or passes it by; so do all others of the fan, at its ends, beside it and where the sensor touches it."""
    rng = np.random.default_rng(seed)
    row, point, way = tangent_to(kind, rng)
    beams, beam = 720, int(rng.integers(0, 720))
    fan = Fan.regular(-np.pi, 2.0 * np.pi / beams, beams, rolling == "clockwise")
    bearings = fan.angle_min + fan.increment * np.arange(beams)
    steps = np.arange(beams) if fan.clockwise else beams - 1 - np.arange(beams)
    left = np.zeros(beams) if rolling is None else steps / beams  # of the sweep, at each beam
    moved, turned = rng.uniform(-0.3, 0.3) * way, rng.uniform(-0.5, 0.5)
    pose = np.array((*(point - away * way), np.arctan2(way[1], way[0]) - bearings[beam]))
    end = pose + left[beam] * np.array((*moved, turned))
    ranges = np.full(beams, np.inf)
    if rolling is None:
        cast_groups(Shapes.of([row]), end[None], fan, ranges, 20.0)
    else:
        cast_rolling(Shapes.of([row]), end[None] - (*moved, turned), end[None], fan, ranges, 20.0)
    if kind == "segment" and away > 1e-6:
        assert ranges[beam] == np.inf or ranges[beam] == pytest.approx(away, abs=2e-8)
    angles, hit = end[2] - left * turned + bearings, np.isfinite(ranges)
    places = end[:2] - left[:, None] * moved + ranges[:, None] * np.column_stack((np.cos(angles), np.sin(angles)))
    assert (distance_from(row[0], places[hit]) <= 2e-8).all()


def test_a_clip_opens_a_conic_and_nearer_ranges_stay() -> None:
    rows = np.zeros((1, COLUMNS))
    rows[0, :14] = 3.0, 0.0, 1.0, CONIC, 1.0, 0.0, 1.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0, 2.0  # the half beyond x = 3
    assert cast(rows)[BEAMS // 2] == pytest.approx(4.0)
    ranges = np.full(BEAMS, 1.0)
    cast_rows(rows, Place(0.0, 0.0, 1.0, 0.0), FAN, ranges, 10.0)
    assert (ranges == 1.0).all()
