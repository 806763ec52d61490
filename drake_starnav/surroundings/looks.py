"""What lidars saw, and when: the surfaces that they hit, what these hid, and which places are known to be free.

In a static world a place is free if any look saw it. Else an obstacle stood there, and the beams of that look had ended
on it. What no look has seen is unknown.
"""

import dataclasses
import math
from collections.abc import Sequence
from functools import cached_property
from itertools import compress
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.geometry.footprint import Body, Footprint, disc
from drake_starnav.geometry.se2 import Place, composed, placed
from drake_starnav.lidar.field_of_view import TURN
from drake_starnav.lidar.laser_scan import Beams, LaserScan
from drake_starnav.surroundings.chords import BINS, ROUNDING, Chords, hides, profile, surfaces
from drake_starnav.surroundings.start import Start
from drake_starnav.utils.snapshot import snapshot

KEPT_EVERY, KEPT_TURN, MOST_LOOKS = 0.125, 0.1, 32
"""Kept looks are this many radii of the robot apart, or turned by this, rad; at most this many of each lidar."""
AROUND = 1.5
"""A polygon that spans a wider angle, rad, may lie around the lidar of a look."""
NOWHERE = (math.nan,) * 3


@snapshot
class Look:
    """What one lidar saw at one time. Immutable; W, m.

    Attributes:
        hits: shape (n, 2), of the last scans of all lidars, those of each scan together.
        own: first and end of the hits that are of this lidar and this scan.
        beams: of this lidar.
        place: (x, y, yaw) of the frame of the beams.
        reach: farther places count as not seen.
        robot: (x, y, yaw) of the robot in that frame: nothing else stood where it did.
        footprint: of the robot; None: unknown.
        short: its ranges count as shorter by this, m, since of many looks the one that errs most decides.
    """

    hits: np.ndarray
    own: tuple[int, int]
    beams: Beams
    place: tuple[float, float, float]
    reach: float
    robot: tuple[float, float, float] = (0.0, 0.0, 0.0)
    footprint: Footprint | None = None
    short: float = 0.0

    @staticmethod
    def none() -> "Look":
        """One that saw nothing."""
        return Look(np.zeros((0, 2)), (0, 0), LaserScan.nothing().beams, (0.0, 0.0, 0.0), 0.0)

    @cached_property
    def chords(self) -> Chords:
        """The hits as surfaces; and what hides without being one: lost beams, what moves, where it does not look."""
        ends, shades = surfaces(self.hits, self.own, self.place, self.beams.body)
        hiding = hides(self.beams, self.place)
        solid = np.arange(len(ends) + len(hiding)) < len(ends)
        shades = np.concatenate((shades, np.ones(len(hiding), np.bool_)))
        return Chords(np.vstack((ends, hiding)), solid, shades, np.array(self.place[:2]))

    @cached_property
    def free(self) -> np.ndarray:
        """How far it saw on all bearings of each bin, from its yaw on, shape (BINS,)."""
        return profile(self.chords.ends, self.place, self.reach) - self.short

    def moved(self, frame: np.ndarray) -> "Look":
        """The same look in another frame, in which this one's origin is at the pose `frame` (x, y, yaw)."""
        x, y, _ = composed(frame, self.place).tolist()
        place = x, y, self.place[2] + float(frame[2])  # its yaw may leave [-pi, pi]
        return dataclasses.replace(self, hits=placed(frame, self.hits), place=place)


class Known(NamedTuple):
    """Looks with their poses in the current frame, the newest first.

    Attributes:
        looks: in the frames in which they were made.
        rows: of each (x, y, yaw) of the lidar, with the bearing of the first bin, W; the time, s; and how far the robot
            had come by then, m, and turned, rad; shape (n, 6).
    """

    looks: tuple[Look | Start, ...] = ()
    rows: np.ndarray = np.zeros((0, 6))

    @staticmethod
    def of(
        looks: tuple[Look | Start, ...], places: Sequence[Place], time: float, driven: tuple[float, float] = (0.0, 0.0)
    ) -> "Known":
        """Looks of one time."""
        return Known(looks, np.array([(*place, time, *driven) for place in places]))

    def and_then(self, older: "Known") -> "Known":
        """These, and older ones."""
        return Known(self.looks + older.looks, np.concatenate((self.rows, older.rows)))

    def chosen(self, which: np.ndarray) -> "Known":
        """Those of some indices."""
        return Known(tuple([self.looks[k] for k in which.tolist()]), self.rows[which])

    def moved(self, frame: np.ndarray) -> "Known":
        """The same in another frame, in which this one's origin is at the pose `frame` (x, y, yaw)."""
        places = np.column_stack((placed(frame, self.rows[:, :2]), self.rows[:, 2] + frame[2]))
        return self._replace(rows=np.hstack((places, self.rows[:, 3:])))


class Looks(NamedTuple):
    """`Known` for compiled functions, the newest first.

    Attributes:
        places: (x, y, yaw) of each, shape (n, 3), W.
        free: as of `Look`, shape (n, BINS), m.
        body: of the robot at the newest look.
        stood: x, y, and cosine and sine of its yaw at each look with this body, else NaN, shape (n, 4), W.
    """

    places: np.ndarray
    free: np.ndarray
    body: Body
    stood: np.ndarray

    @staticmethod
    def of(known: Known) -> "Looks":
        """The looks of a `Known`."""
        seen = [look for look in known.looks if isinstance(look, Look)]
        own = next((look.footprint for look in seen if look.footprint is not None), disc(0.0))
        robots = [look.robot if isinstance(look, Look) and look.footprint is own else NOWHERE for look in known.looks]
        free = np.array([look.free for look in known.looks]).reshape(-1, BINS)
        places = known.rows[:, :3].copy()
        return Looks(places, free, own.body, _stood(places, np.array(robots).reshape(-1, 3)))


@kernel
def _stood(places, robots):
    """`Looks.stood` by the poses of looks and, in their frames, of the robot, shape (n, 3)."""
    stood = np.empty((len(places), 4))
    for k in range(len(places)):
        (x, y, yaw), (dx, dy, turn) = places[k], robots[k]
        cosine, sine = math.cos(yaw), math.sin(yaw)
        stood[k, 0], stood[k, 1] = x + dx * cosine - dy * sine, y + dx * sine + dy * cosine
        turned = yaw + turn
        turned -= TURN * round(turned / TURN)
        stood[k, 2], stood[k, 3] = math.cos(turned), math.sin(turned)
    return stood


class Kept(NamedTuple):
    """Which looks count: a pose whose error grows with the way, the turn or the time makes old ones void.

    Attributes:
        reach: largest distance of a look from the robot, m.
        apart: least distance between two of them, m, unless they are turned by KEPT_TURN.
        way, turn: how far the robot may have driven since, m, and turned, rad.
        time: largest age, s.
        short: as of `Look`, m.
    """

    reach: float = math.inf
    apart: float = 0.0
    way: float = math.inf
    turn: float = math.inf
    time: float = math.inf
    short: float = 0.0


def remembered(before: Known, new: Known, driven: tuple[float, float], now: tuple[Place, float], kept: Kept) -> Known:
    """The looks that still count after a scan.

    Args:
        before: those that counted at the scan before.
        new: those of that scan, one of each lidar.
        driven: how far the robot has come, m, and turned, rad, since it began.
        now: (x, y, yaw) of the robot, W, and the time, s.
        kept: which count.
    """
    looks, (x, y, _), time = new.looks + before.looks, *now
    limits = x, y, time - kept.time, driven[0] - kept.way, driven[1] - kept.turn
    begun, every = bool(looks) and isinstance(looks[-1], Start), any(not look.beams.complete for look in new.looks)
    lasting, rows = _lasting(new.rows, before.rows, begun, every, limits, (kept.reach, kept.apart))
    return Known(tuple(compress(looks, lasting.tolist())), rows)


@kernel
def _lasting(new, before, begun, every, limits, kept):
    """Which looks are `remembered`, and their rows, of all that are `Known`.

    Args:
        new, before: rows of the looks of that scan, and of what was known.
        begun: whether the last one is a `Start`.
        every: whether those from one place count, too: each saw what others lost.
        limits: (x, y) of the robot, and the least time, way and turn that count.
        kept: reach and distance apart as of `Kept`, m.
    """
    (reach, apart), count, rows = kept, len(new), np.concatenate((new, before))
    lasting, older, end = np.ones(len(rows), np.bool_), 2 * count, len(rows) - begun
    if len(rows) > older > 0:
        if older == end or every or _are_apart(rows[count], rows[older], apart):
            for k in range(older, end):
                lasting[k] = every or _are_apart(rows[count], rows[k], apart)
        else:  # it is none of those that are kept
            lasting[count:older] = False
    left = 0
    for k in range(len(rows)):
        x, y, _, time, way, turned = rows[k]
        lasts = time >= limits[2] and way >= limits[3] and turned >= limits[4]
        lasting[k] &= lasts and math.hypot(x - limits[0], y - limits[1]) < reach
        left += lasting[k] and k < end
    while left > MOST_LOOKS * max(count, 1):  # the older of the two goes that differ least
        least, superfluous = np.inf, end
        for i in range(count, end):
            for j in range(i + 1, end):
                if lasting[i] and lasting[j]:
                    away, turned = _difference(rows[i], rows[j])
                    if away / apart + turned < least:  # a radian counts as much as the distance
                        least, superfluous = away / apart + turned, j
        lasting[superfluous] = False
        left -= 1
    return lasting, rows[lasting]


@kernel
def _are_apart(one, other, apart):
    away, turned = _difference(one, other)
    return away > apart or turned > KEPT_TURN


@kernel
def _difference(one, other):
    """How far apart two looks are, m, and how much they are turned, rad."""
    turned = one[2] - other[2]
    return math.hypot(one[0] - other[0], one[1] - other[1]), abs(turned - TURN * round(turned / TURN))


@kernel
def saw(look, looks, part, n):
    """Whether a look saw all of a convex polygon, the first `n` of `part`: nothing was nearer on any bearing of it.

    Nothing was, either, where the robot stood then.
    """
    if stands_on(looks.stood[look], looks.body, part, n, looks.body.radius + ROUNDING)[0]:
        return True
    x, y, yaw = looks.places[look]
    far, mx, my = 0.0, 0.0, 0.0
    for i in range(n):
        dx, dy = part[i, 0] - x, part[i, 1] - y
        far, mx, my = max(far, dx * dx + dy * dy), mx + dx, my + dy
    far, left, right = math.sqrt(far), 0.0, 0.0
    for i in range(n):
        dx, dy = part[i, 0] - x, part[i, 1] - y
        off = math.atan2(mx * dy - my * dx, mx * dx + my * dy)
        left, right = max(left, off), min(right, off)
    free, step = looks.free[look], TURN / BINS
    first, last = 0, BINS - 1
    if left - right < AROUND:  # else it may lie around the lidar
        bearing = math.atan2(my, mx) - yaw
        first = int(math.floor((bearing + right) / step + ROUNDING))  # not the bin that it only touches
        last = max(int(math.floor((bearing + left) / step - ROUNDING)), first)
    for b in range(first, last + 1):  # noqa: SIM110 - Numba takes no generator
        if free[b % BINS] < far:
            return False
    return True


@kernel
def stands_on(frame, body, part, n, within):
    """Whether a body covers a polygon by one of its parts; else an edge of one that parts what this covers of it.

    The edge is its normal and offset, W; zeros: none. A polygon whose first corner is farther than `within` from the
    body's place (m) is not looked at.
    """
    (x, y, cosine, sine), (nx, ny, offset) = frame, (0.0, 0.0, 0.0)
    if not math.hypot(part[0, 0] - x, part[0, 1] - y) <= within:
        return False, nx, ny, offset
    start, stops, inside = 0, body.polygons.ends, len(body.polygons.ends) == 0
    for i in range(n):
        inside = inside and math.hypot(part[i, 0] - x, part[i, 1] - y) <= body.radius + ROUNDING
    for end in stops:
        inside, cut = True, (0.0, 0.0, 0.0)
        for e in range(start, end):
            a, b = body.polygons.normals[e]
            a, b = cosine * a - sine * b, sine * a + cosine * b
            most, low, high = body.polygons.offsets[e] + a * x + b * y, np.inf, -np.inf
            for i in range(n):
                along = a * part[i, 0] + b * part[i, 1] - most
                low, high = min(low, along), max(high, along)
            inside = inside and high <= ROUNDING
            if low > -ROUNDING and high > ROUNDING:  # it is beside this part
                cut = 0.0, 0.0, 0.0
                break
            if high > ROUNDING:
                cut = a, b, most
        if inside:
            break
        nx, ny, offset = (nx, ny, offset) if nx != 0.0 or ny != 0.0 else cut
        start = end
    return inside, nx, ny, offset
