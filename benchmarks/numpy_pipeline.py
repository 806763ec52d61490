"""The pipeline's computations in plain NumPy (and SciPy), vectorised: what the compiled kernels are measured against.

Everything here is for full-circle scans and the default parameters, written from the same formulas as the package.
"""

import math

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from drake_starnav.control import ControllerParameters
from drake_starnav.control.free_heading import FREE_HEADING_RANGE, OPEN_WAY, SAMPLES, STEP
from drake_starnav.control.modulation import CENTER, FARTHEST, SIGMA
from drake_starnav.control.path_following import MODULATION_DISTANCE
from drake_starnav.control.rollout import CREEP, GOAL_SLOWDOWN
from drake_starnav.lidar.laser_scan import USUAL_BODY, LaserScan
from drake_starnav.planning import StarRoadmap
from drake_starnav.planning.cost_field import BLOCKED_SLACK, NEAR_WALL_COST, SOFT_ZONE
from drake_starnav.planning.distance_grid import STRIDE
from drake_starnav.planning.guidance import PASSED_DISTANCE, Guidance
from drake_starnav.robot import RobotParameters
from drake_starnav.robot.limits import HEADING_GAIN
from drake_starnav.robot.motion import LONGEST_STEP
from drake_starnav.surroundings import Margins, RegionUnion
from drake_starnav.surroundings.bearing_hits import CONNECTED_CHORD
from drake_starnav.surroundings.erosion import BEARINGS, SAME_SURFACE, SMOOTHING_BEAMS
from drake_starnav.surroundings.passages import MARGIN_STEPS, PASSAGE_DEPTH, SHUT
from drake_starnav.surroundings.perception import SCAN_MEMORY
from drake_starnav.surroundings.piecewise_cubic import JUMP, LARGEST_SHARE, SMALLEST_SPLIT, TOLERANCE
from drake_starnav.surroundings.safe_region import CertifiedRegion, ScanMemory


def smoothed_distances(scan: LaserScan) -> np.ndarray:
    """As `surroundings.erosion.smoothed_distances`."""
    distance = scan.distances
    hit = distance < scan.range_max
    total, count, growing = distance.copy(), np.ones(len(distance)), hit.copy()
    left = right = distance
    for k in range(1, SMOOTHING_BEAMS + 1):
        a, b = np.roll(distance, k), np.roll(distance, -k)
        growing &= np.roll(hit, k) & np.roll(hit, -k)
        growing &= (np.abs(a - left) <= JUMP * USUAL_BODY) & (np.abs(b - right) <= JUMP * USUAL_BODY)
        total += np.where(growing, a + b, 0.0)
        count += 2.0 * growing
        left, right = a, b
    mean = total / count
    return np.where(hit & (np.abs(mean - distance) < SAME_SURFACE * USUAL_BODY), mean, distance)


def half_gaps(scan: LaserScan, distance: np.ndarray) -> np.ndarray:
    """As `surroundings.bearing_hits.half_gaps`."""
    following = np.roll(distance, -1)
    squared = distance**2 + following**2 - 2.0 * distance * following * math.cos(scan.angle_increment)
    chord = np.sqrt(np.maximum(squared, 0.0))
    connected = (np.maximum(distance, following) < scan.range_max) & (chord < CONNECTED_CHORD * USUAL_BODY)
    half = np.where(connected, 0.5 * chord, 0.0)
    return np.maximum(half, np.roll(half, 1))


def eroded_range(distance: np.ndarray, gap: np.ndarray, offset: np.ndarray, radius: float, limit: float) -> np.ndarray:
    """As `surroundings.erosion.erode`, for a lidar that looks as far at all bearings; infinite: no hit."""
    samples = len(distance)
    out = np.full(samples, max(limit, 0.0))
    inflated = radius + np.where(np.isfinite(distance), distance, 0.0) * offset
    chosen = np.flatnonzero(distance - inflated - gap < limit)
    d, squared = distance[chosen], inflated[chosen] ** 2 + gap[chosen] ** 2
    touching = d * d <= squared
    for j in chosen[touching]:
        out[(j + np.arange(-(samples // 4), samples // 4 + 1)) % samples] = 0.0
    d, squared, chosen = d[~touching], squared[~touching], chosen[~touching]
    if not len(d):
        return out
    width = (np.arcsin(np.sqrt(squared) / d) * samples / (2.0 * math.pi)).astype(int)
    steps = np.arange(-width.max(), width.max() + 1)
    angle = 2.0 * math.pi / samples * steps
    root = np.sqrt(np.maximum(squared[:, None] - (d * d)[:, None] * np.sin(angle) ** 2, 0.0))
    inside = np.abs(steps) <= width[:, None]
    np.minimum.at(out, ((chosen[:, None] + steps) % samples)[inside], (d[:, None] * np.cos(angle) - root)[inside])
    return out


def free_range(scan: LaserScan, distance: np.ndarray, radius: float, margins: Margins) -> np.ndarray:
    """As the first result of `surroundings.erosion.free_range`."""
    beams = len(distance)
    every = math.ceil(BEARINGS / beams)
    hits, gap = np.full(beams * every, np.inf), np.zeros(beams * every)
    hits[::every] = np.where(distance < scan.range_max, distance, np.inf)
    gap[::every] = half_gaps(scan, distance)
    limit, offset = scan.range_max - radius - margins.preferred, np.zeros(len(hits))
    free = eroded_range(hits, gap, offset, radius + margins.preferred, limit)
    for share in np.arange(1, MARGIN_STEPS + 1) / MARGIN_STEPS:
        margin = margins.preferred + (margins.least - margins.preferred) * share
        free = with_passages(free, eroded_range(hits, gap, offset, radius + margin, limit), radius)
    return free


def with_passages(free: np.ndarray, narrow: np.ndarray, radius: float) -> np.ndarray:
    """As the first result of `surroundings.passages.with_passages`."""
    deeper = narrow > free + PASSAGE_DEPTH * radius
    if deeper.all():
        return narrow
    first = int(np.argmin(deeper))  # no run lies across it
    bounds = np.flatnonzero(np.diff(np.append(np.roll(deeper, -first), False).astype(int))).reshape(-1, 2)
    out = free.copy()
    for before, last in bounds + first:
        run = np.arange(before, last + 2) % len(free)  # with both its neighbours
        if free[run].max() < SHUT * radius:
            out[run[1:-1]] = narrow[run[1:-1]]
    return out


def adaptive_fit(samples: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """As `fit_piecewise_cubic`: starts, values, slopes; all segments of one depth at once."""
    count = len(samples)
    longest = max(count // LARGEST_SHARE, 1)
    jumps = np.flatnonzero(np.abs(np.diff(samples)) > JUMP * radius) + 1
    bounds = np.concatenate(([0], jumps, [count]))
    starts = np.concatenate([np.arange(a, b, longest) for a, b in zip(bounds[:-1], bounds[1:], strict=True)])
    ends = np.append(starts[1:], count)
    values, slopes, all_starts = np.empty(count), np.empty(count), []
    while len(starts):
        n = ends - starts
        first = np.cumsum(n) - n
        of = np.repeat(np.arange(len(n)), n)
        index = np.arange(len(of)) - first[of] + starts[of]
        half = np.where(n > 1, 0.5 * (n - 1), 1.0)
        s = (index - starts[of] - 0.5 * (n - 1)[of]) / half[of]
        y, s2 = samples[index], s * s
        m2, m4, m6, b0, b1, b2, b3 = np.add.reduceat(
            np.array((s2, s2 * s2, s2 * s2 * s2, y, y * s, y * s2, y * s2 * s)), first, axis=1
        )
        with np.errstate(divide="ignore", invalid="ignore"):
            even, odd = n * m4 - m2 * m2, m2 * m6 - m4 * m4
            c0 = np.where(n < 3, b0 / n, (m4 * b0 - m2 * b2) / even)
            c2 = np.where(n < 3, 0.0, (n * b2 - m2 * b0) / even)
            c1 = np.select([n == 1, n <= 3], [0.0, b1 / m2], (m6 * b1 - m4 * b3) / odd)
            c3 = np.where(n <= 3, 0.0, (m2 * b3 - m4 * b1) / odd)
        fitted = c0[of] + s * (c1[of] + s * (c2[of] + s * c3[of]))
        over = np.maximum.reduceat(fitted - y, first)
        under = np.maximum.reduceat(y - fitted, first)
        split = (over + under > TOLERANCE * radius) & (n >= SMALLEST_SPLIT)
        lowered = fitted - np.maximum(over, 0.0)[of]
        keep = ~split[of]
        values[index[keep]] = np.maximum(lowered, 0.0)[keep]
        slope = (c1[of] + s * (2.0 * c2[of] + 3.0 * s * c3[of])) / (half[of] * 2.0 * math.pi / count)
        slopes[index[keep]] = slope[keep]
        all_starts.append(starts[~split])
        middle = (starts[split] + ends[split] + 1) // 2
        starts, ends = (
            np.column_stack((starts[split], middle)).ravel(),
            np.column_stack((middle, ends[split])).ravel(),
        )
    return np.sort(np.concatenate(all_starts)), values, slopes


def safety_values(memory: ScanMemory, scan: LaserScan, pose: np.ndarray, radius: float, reach: float) -> np.ndarray:
    """As the values of `stars.safety.certified_region`; the latest scan is added to the memory here."""
    counts = memory.counts
    old = sum(counts[max(len(counts) + 1 - SCAN_MEMORY, 0) :])
    kept = slice(len(memory.points) - old, None)
    near = scan.hits & (scan.distances < reach + 2.0 * radius)
    latest = scan.points_at(scan.distances, near, pose)
    points = np.vstack((memory.points[kept], latest)) - pose[:2]
    gaps = np.concatenate((memory.half_gaps[kept], half_gaps(scan, scan.distances)[near]))
    samples = len(scan.ranges) * math.ceil(BEARINGS / len(scan.ranges))
    step = 2.0 * math.pi / samples
    distance = np.hypot(points[:, 0], points[:, 1])
    within = distance <= reach + radius + CONNECTED_CHORD * USUAL_BODY
    position = (np.arctan2(points[within, 1], points[within, 0]) - pose[2] - scan.angle_min) / step
    nearest = np.floor(position + 0.5)
    k = nearest.astype(int) % samples
    hits, gap, offset = np.full(samples, np.inf), np.zeros(samples), np.zeros(samples)
    np.minimum.at(hits, k, distance[within])
    np.maximum.at(gap, k, gaps[within])
    np.maximum.at(offset, k, np.abs(position - nearest) * step)
    return eroded_range(hits, gap, offset, radius, min(scan.range_max, reach + radius) - radius)


def command(
    pose: np.ndarray,
    twist: np.ndarray,
    guidance: Guidance,
    star: CertifiedRegion,
    parameters: ControllerParameters,
    robot: RobotParameters,
) -> np.ndarray:
    """As the command of `kinematic_drive`, or NaN where the star alone does not decide; the path must not be empty."""
    path = guidance.path
    offset = path - pose[:2]
    away = np.hypot(offset[:, 0], offset[:, 1])
    passed = PASSED_DISTANCE * robot.radius
    ahead = int(np.argmax(away > passed)) if (away > passed).any() else len(path) - 1
    distance = away[ahead]
    direction = offset[ahead] / distance
    if distance > MODULATION_DISTANCE * robot.radius:
        direction = _modulated(pose[:2], direction, guidance.regions, robot.radius)
    direction = _free_heading(pose[:2], direction, star, OPEN_WAY * robot.radius)
    heading = (math.atan2(direction[1], direction[0]) - pose[2] + math.pi) % (2.0 * math.pi) - math.pi
    stop_at = distance if guidance.arrives and len(path) == 1 else math.inf
    v = min(robot.max_speed * max(math.cos(heading), 0.0) ** 3, GOAL_SLOWDOWN * stop_at + robot.max_speed / CREEP)
    omega = min(max(HEADING_GAIN * heading, -robot.max_yaw_rate), robot.max_yaw_rate)
    v, omega = _certified_twist(pose, twist, v, omega, 1.0 / parameters.rate + parameters.delay, star, robot)
    limits = np.array((robot.max_speed, robot.max_yaw_rate))
    change = np.array((robot.max_acceleration, robot.max_yaw_acceleration)) / parameters.rate
    return twist + np.clip(np.clip((v, omega), -limits, limits) - twist, -change, change)


def _modulated(position: np.ndarray, direction: np.ndarray, regions: RegionUnion, radius: float) -> np.ndarray:
    offset = position - regions.center
    distance = np.hypot(offset[:, 0], offset[:, 1])
    if (distance < CENTER * radius).any():
        return direction
    samples = regions.values.shape[1]
    place = (np.arctan2(offset[:, 1], offset[:, 0]) - regions.bearing_0) * samples / (2.0 * math.pi)
    base = np.floor(place)
    share, left, row = place - base, base.astype(int) % samples, np.arange(len(place))
    right = (left + 1) % samples
    phi = (1.0 - share) * regions.values[row, left] + share * regions.values[row, right]
    slope = (1.0 - share) * regions.slopes[row, left] + share * regions.slopes[row, right]
    gamma = (phi / distance) ** SIGMA
    inside = (gamma > 1.0) & (distance <= FARTHEST * radius)
    normal, phi, slope, gamma = (offset / distance[:, None])[inside], phi[inside], slope[inside], gamma[inside]
    cosine, sine = normal.T
    tangent = np.column_stack((slope * cosine - phi * sine, slope * sine + phi * cosine))
    tangent /= np.hypot(tangent[:, 0], tangent[:, 1])[:, None]
    det = cosine * tangent[:, 1] - sine * tangent[:, 0]
    radial = (direction[0] * tangent[:, 1] - direction[1] * tangent[:, 0]) / det
    along = (cosine * direction[1] - sine * direction[0]) / det * (1.0 + 1.0 / gamma)
    radial = np.where(radial > 0.0, radial * (1.0 - 1.0 / gamma), radial)
    bent = radial[:, None] * normal + along[:, None] * tangent
    weight = gamma - 1.0
    total = (weight / np.hypot(bent[:, 0], bent[:, 1])) @ bent
    length, most = np.hypot(*total), weight.sum()
    return direction if most <= 0.0 or length < 1e-3 * most else total / length


def _free_heading(position: np.ndarray, direction: np.ndarray, star: CertifiedRegion, most: float) -> np.ndarray:
    way = most * np.arange(1, SAMPLES + 1) / SAMPLES
    steps = STEP * np.arange(1, int(FREE_HEADING_RANGE / STEP) + 1)
    bearing = math.atan2(direction[1], direction[0])

    def is_open(angle: float) -> bool:
        return _covered(position + np.outer(way, (math.cos(angle), math.sin(angle))) - star.center, star)

    if is_open(bearing):
        return direction
    for turn in np.column_stack((steps, -steps)).ravel():
        if is_open(bearing + turn) and is_open(bearing + turn + math.copysign(STEP, turn)):
            return np.array((math.cos(bearing + turn), math.sin(bearing + turn)))
    return direction


def _certified_twist(
    pose: np.ndarray,
    twist: np.ndarray,
    v: float,
    omega: float,
    hold: float,
    star: CertifiedRegion,
    robot: RobotParameters,
) -> tuple[float, float]:
    """The twist itself where the star accepts it; NaN where surfaces must decide, of which this knows nothing."""
    accepted = _covered(_motion(pose, twist, v, omega, hold, robot) - star.center, star)
    return (v, omega) if accepted else (math.nan, math.nan)


def _motion(
    pose: np.ndarray, twist: np.ndarray, want_v: float, want_omega: float, hold: float, robot: RobotParameters
) -> np.ndarray:
    """Positions until the robot stands, shape (n, 2): each step depends on the one before, so nothing is vectorised."""
    x, y, yaw = (float(value) for value in pose)
    v, omega = (float(value) for value in twist)
    points: list[tuple[float, float]] = []
    left = hold
    while left > 0.0 or abs(v) >= 1e-9 or not points:
        fastest = max(abs(v), abs(want_v)) if left > 0.0 else abs(v)
        h = min(LONGEST_STEP, robot.shape.sampling / max(fastest, 1e-9))
        if left > 0.0:
            h = min(h, left)
            left = left - h if left - h >= 1e-9 else 0.0
        else:
            want_v = want_omega = 0.0
            h = min(h, abs(v) / robot.max_acceleration) if abs(v) >= 1e-9 else h
        v, mean_v = _ramped(v, want_v, robot.max_acceleration, h)
        omega, mean_omega = _ramped(omega, want_omega, robot.max_yaw_acceleration, h)
        middle = yaw + 0.5 * mean_omega * h
        x, y, yaw = x + mean_v * h * math.cos(middle), y + mean_v * h * math.sin(middle), yaw + mean_omega * h
        points.append((x, y))
    return np.array(points)


def _ramped(value: float, target: float, rate: float, time: float) -> tuple[float, float]:
    """A value after approaching a target for a time, and its mean meanwhile."""
    ramp = min(abs(target - value) / rate, time)
    after = value + math.copysign(rate * ramp, target - value)
    return after, (0.5 * (value + after) * ramp + after * (time - ramp)) / time


def _covered(offset: np.ndarray, star: CertifiedRegion) -> bool:
    squared = (offset * offset).sum(axis=1)
    samples = len(star.values)
    place = (np.arctan2(offset[:, 1], offset[:, 0]) - star.bearing_0) * samples / (2.0 * math.pi)
    left = np.floor(place).astype(int) % samples
    phi = np.minimum(star.values[left], star.values[(left + 1) % samples])
    return bool(((squared < 1e-12) | (squared <= phi * phi)).all())


def cost_to_go(
    roadmap: StarRoadmap, goal: np.ndarray, low: np.ndarray, high: np.ndarray, robot_radius: float
) -> np.ndarray:
    """As `planning.cost_field.cost_to_go` for all cells, shape (nx, ny), m, by SciPy's Dijkstra over the whole box."""
    first, count = roadmap.hits.box(low, high)
    cell = roadmap.hits.resolution * STRIDE
    origin = (first + 0.5 * (STRIDE - 1)) * roadmap.hits.resolution
    middles = origin + cell * np.moveaxis(np.indices(count), 0, -1).reshape(-1, 2)
    distance = roadmap.hits.coarse(middles)[1].max(axis=1).reshape(count)
    blocked, soft = robot_radius - BLOCKED_SLACK * robot_radius, robot_radius + SOFT_ZONE * robot_radius
    d = np.pad(distance.astype(float), 1, constant_values=0.0)
    dearer = 1.0 + NEAR_WALL_COST * np.maximum(soft - d, 0.0) / (soft - blocked)
    weight = np.where(d >= blocked, (10.0 * dearer).astype(int), 0)
    nx, ny = weight.shape
    number = np.arange(nx * ny).reshape(nx, ny)
    sources, targets, costs = [], [], []
    for a, b in ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)):
        inner, shifted = number[1:-1, 1:-1], np.roll(number, (-a, -b), (0, 1))[1:-1, 1:-1]
        entered = weight.ravel()[shifted]
        open_ = entered > 0
        sources.append(inner[open_])
        targets.append(shifted[open_])
        costs.append(entered[open_] * (14 if a and b else 10))
    edges = (np.concatenate(costs).astype(float), (np.concatenate(sources), np.concatenate(targets)))
    i, j = np.clip(np.rint((goal - origin) / cell).astype(int), 0, np.array(distance.shape) - 1) + 1
    field = dijkstra(csr_matrix(edges, shape=(nx * ny, nx * ny)), indices=int(number[i, j])).reshape(nx, ny)
    return field * (cell / 100.0)
