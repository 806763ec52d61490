"""The certified region: positions of the robot's centre that are free according to the last few scans.

The hits are used as measured. If the declared noise makes the nearest hit too unreliable, they are smoothed or averaged
first.
"""

import dataclasses
import math
from dataclasses import field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.geometry.footprint import Footprint
from drake_starnav.geometry.se2 import now_in, placed
from drake_starnav.lidar.field_of_view import TURN
from drake_starnav.lidar.laser_scan import HIT, LOST, Beams, LaserScan, placed_ends
from drake_starnav.surroundings.bearing_hits import CONNECTED_CHORD, points_to_bearings
from drake_starnav.surroundings.erosion import Disc, erode, field_of_view, within_sight
from drake_starnav.surroundings.looks import Known, Look, Looks
from drake_starnav.surroundings.region_union import RegionUnion
from drake_starnav.surroundings.views import NEAREST, seen_hits
from drake_starnav.utils.snapshot import replaced, snapshot

SCAN_PATIENCE = 3.0
"""Scan periods that a certified region lasts beyond the lidar's delay; without a new scan the robot then brakes."""
NEAR_HITS = 4.0
"""Hits nearer than this count as near, in radii with the margin: among movers the robot keeps off walls."""
COARSE = 4
"""Regions of a robot that does not see all around are made of every n-th of its earlier looks."""
QUARTER = 0.25 * TURN
"""A disc that drives straight on, at least this far inside its view, rad, covers nothing unseen but where it stood."""
NO_HITS, GIVEN, NOTHING_SEEN = (np.zeros((0, 2)), np.zeros(0)), (-1, 0.0), Known()


@snapshot
class CertifiedRegion:
    """A star-shaped set of positions of the robot's centre that the last scans certify, and what they saw. Immutable.

    At every point inside, and along the straight segment from the centre to it, the distance to all hits exceeds the
    robot's radius plus the safety margin. In W; m.

    Attributes:
        center: where the last scan was taken, shape (2,).
        bearing_0: bearing of sample 0, rad.
        values: shape (M,), boundary distance at the samples; between two samples the smaller one counts.
        near_hits: shape (k, 2), the planner's smoothed hits close to the robot.
        hits: shape (n, 2), all hits of the remembered scans, as used by the certificate.
        half_gaps: shape (n,), half the chord from each hit to its neighbour on the same surface, m.
        seen: whether `hits` come from scans; if not, they certify no motion.
        time: when the last scan was taken, s.
        previous: when the scan before the last was taken, s; its pose also serves to de-skew a rolling scan.
        radius: distance that is kept from the hits, the robot's narrow radius with the safety margin, m.
        sight: bearings, from `bearing_0` on, between which the last scan looked, rad.
        newest: what each lidar saw at the last scan.
        earlier: what was seen before.
    """

    center: np.ndarray
    bearing_0: float
    values: np.ndarray
    near_hits: np.ndarray
    hits: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    half_gaps: np.ndarray = field(default_factory=lambda: np.zeros(0))
    seen: bool = False
    time: float = -math.inf
    previous: float = -math.inf
    radius: float = 0.0
    sight: tuple[float, float] = (0.0, TURN)
    newest: Known = field(default_factory=lambda: Known.of((Look.none(),), ((0.0, 0.0, 0.0),), -math.inf))
    earlier: Known = NOTHING_SEEN

    @cached_property
    def alone(self) -> RegionUnion:
        """Center and boundary as a union of one region."""
        return RegionUnion.alone(self.center, self.bearing_0, self.values, np.zeros(0))

    @property
    def sees_around(self) -> bool:
        """Whether the last scan looked all around."""
        first, last = self.sight
        return last - first >= TURN

    @cached_property
    def enough(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Center, bearings of the first samples and values of the star in which a disc needs no other look."""
        (first, last), values = self.sight, self.values
        if not self.sees_around:
            bearing = TURN / len(values) * np.arange(len(values))
            values = np.where((first + QUARTER <= bearing) & (bearing <= last - QUARTER), values, 0.0)
        return RegionUnion.alone(self.center, self.bearing_0, values, np.zeros(0))[:3]

    @property
    def look(self) -> Look:
        """What the first lidar saw at the last scan."""
        look = self.newest.looks[0]
        assert isinstance(look, Look)
        return look

    @property
    def driven(self) -> tuple[float, float]:
        """How far the robot has come, m, and turned, rad."""
        *_, way, turned = self.newest.rows[0].tolist()
        return way, turned

    @cached_property
    def looks(self) -> Looks:
        """All but `look`, for compiled functions."""
        return Looks.of(Known(self.newest.looks[1:], self.newest.rows[1:]).and_then(self.earlier))

    def seen_from(self, pose: np.ndarray) -> list[tuple[Beams, np.ndarray]]:
        """The beams of some of what was seen, each with its pose in the frame of the robot at a pose (x, y, yaw), W."""
        every = np.arange(len(self.earlier.looks))
        some = self.earlier.chosen(np.concatenate((every[:-1:COARSE], every[-1:])))
        known = self.newest.and_then(some) if self.seen else Known()
        return [(look.beams, np.array(now_in(pose, row))) for look, row in zip(*known, strict=True)]

    def since(self, time: float) -> "CertifiedRegion":
        """The same without what was seen before a time, s."""
        lasting = np.flatnonzero(self.earlier.rows[:, 3] >= time)
        if len(lasting) == len(self.earlier.looks):
            return self
        return dataclasses.replace(self, earlier=self.earlier.chosen(lasting))

    def moved(self, frame: np.ndarray) -> "CertifiedRegion":
        """The same region in another frame, in which this one's origin is at the pose `frame` (x, y, yaw)."""
        newest = self.newest.moved(frame)
        return dataclasses.replace(
            self,
            center=placed(frame, self.center[None])[0],
            bearing_0=self.bearing_0 + float(frame[2]),
            near_hits=placed(frame, self.near_hits),
            hits=placed(frame, self.hits),
            newest=newest._replace(looks=(self.look.moved(frame), *newest.looks[1:])),
            earlier=self.earlier.moved(frame),
        )

    @staticmethod
    def none() -> "CertifiedRegion":
        """Before any scan: no motion can be certified."""
        return CertifiedRegion(np.zeros(2), 0.0, np.zeros(4), np.zeros((0, 2)))


@snapshot
class ScanMemory:
    """The hits of the last scans near the robot, oldest first. Immutable.

    Attributes:
        points: of all scans, shape (n, 2), W, m.
        half_gaps: shape (n,), half the chord from each to the neighbouring hit on the same surface, m.
        counts: number of hits of each scan.
        time: of the last scan, s.
    """

    points: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    half_gaps: np.ndarray = field(default_factory=lambda: np.zeros(0))
    counts: tuple[int, ...] = ()
    time: float = -math.inf

    def latest(self, count: int) -> "ScanMemory":
        """It without all but this many of the last scans."""
        forgotten = len(self.counts) - count
        if forgotten <= 0:
            return self
        first = sum(self.counts[:forgotten])
        points, gaps = self.points[first:], self.half_gaps[first:]
        return replaced(self, points=points, half_gaps=gaps, counts=self.counts[forgotten:])

    def and_then(self, scan: LaserScan, found: tuple) -> "ScanMemory":
        """It with the latest scan, by what `star` found."""
        hits, gaps, remembered, *_ = found
        counts = (*self.counts, remembered - len(self.points))
        return ScanMemory(hits[:remembered], gaps[:remembered], counts, scan.time)


def certified_region(
    memory: ScanMemory,
    scan: LaserScan,
    distance: np.ndarray,
    pose: np.ndarray,
    radius: float,
    reach: float,
    remembered: tuple[float, int],
    hits: tuple[np.ndarray, np.ndarray] | None = None,
) -> tuple[CertifiedRegion, ScanMemory]:
    """The certified region about the latest scan, and the memory with this scan; most arguments as of `Asked.of`.

    Args:
        memory: the last scans, without the latest.
        distance: shape (n,), the scan's `smoothed_distances`, used for the near hits, m.
        remembered: farther hits are dropped, m; and the number of scans to keep.
    """
    memory = memory.latest(remembered[1] - 1)
    asked = Asked.of(memory, scan, pose, (radius, reach, remembered[0]), hits)
    found = star(distance, *asked)
    look = asked.look(scan, found)
    newest = Known.of((look,), (look.place,), scan.time)
    return certified_by(memory, scan, asked, found, newest), memory.and_then(scan, found)


class Asked(NamedTuple):
    """What `star` takes beside the distances.

    Attributes:
        disc: a `Disc` without margin, as a plain tuple. Of a merged scan, the ends of all rays are hits, too.
        known: points and half gaps of the memory.
        latest: hits and half gaps of the scan. Without any, those of the beams count, smoothed as of `hits_seen`; else
            the third is GIVEN.
        pose: (x, y, yaw) of the robot, W, m and rad.
        bearing_0: of sample 0 in W, rad.
        reach: maximum extent of the star, m.
        far: farther hits are not remembered, m.
    """

    disc: tuple
    known: tuple[np.ndarray, np.ndarray]
    latest: tuple[np.ndarray, np.ndarray, tuple[int, float]]
    pose: tuple[float, float, float]
    bearing_0: float
    reach: float
    far: float

    @staticmethod
    def of(
        memory: ScanMemory,
        scan: LaserScan,
        pose: np.ndarray,
        sizes: tuple[float, float, float],
        hits: tuple[np.ndarray, np.ndarray] | None = None,
        smoothing: tuple[int, float] = (0, 0.0),
    ) -> "Asked":
        """What is asked about the latest scan, about the robot's axis.

        Args:
            memory: the scans before it.
            scan: the latest.
            pose: (x, y, yaw) of the robot in W when it was taken.
            sizes: radius of the robot with the safety margin, reach and far, m.
            hits: as of `hits_seen`; None: those of the scan, with this smoothing.
        """
        (x, y, yaw), (radius, reach, far) = pose.tolist(), sizes
        latest = *(hits or NO_HITS), smoothing if hits is None else GIVEN
        disc, known = tuple(Disc.of(scan, radius, reach=reach)), (memory.points, memory.half_gaps)
        return Asked(disc, known, latest, (x, y, yaw), yaw + scan.angle_min, reach, min(far, scan.range_max))

    def look(self, scan: LaserScan, found: tuple, footprint: Footprint | None = None, short: float = 0.0) -> Look:
        """What the latest scan saw, by what `star` found; footprint and `short` as of `Look`."""
        hits, _, remembered, *_ = found
        own = len(self.known[0]), remembered
        reach = min(self.far, scan.beams.sight)
        return Look(hits[:remembered], own, scan.beams, self.pose, reach, footprint=footprint, short=short)


def certified_by(
    memory: ScanMemory, scan: LaserScan, asked: Asked, found: tuple, newest: Known, earlier: Known = NOTHING_SEEN
) -> CertifiedRegion:
    """The certified region by what `star` found for what it was asked, and by what was seen."""
    hits, gaps, _, values, near = found
    return CertifiedRegion(
        np.array(asked.pose[:2]), asked.bearing_0, values, near, hits, gaps, seen=True, time=scan.time,
        previous=memory.time, radius=Disc(*asked.disc).radius, sight=field_of_view(scan),
        newest=newest, earlier=earlier,
    )  # fmt: skip


@kernel
def star(distance, disc, known, latest, pose, bearing_0, reach, far):
    """The star's hits and half gaps, how many of them the memory keeps, the first; its values, and the near hits.

    `distance` (n,) are the smoothed distances of the beams, m; the others are as of `Asked`.
    """
    plain, limit, radius, _, (cosines, squares), is_merged = disc
    (x, y, yaw), beams, (points, point_gaps, smoothing) = pose, Beams(*plain), latest
    if smoothing[0] >= 0:
        points, point_gaps = seen_hits(plain, smoothing, 0.0, 0.0)
    measured, range_max, directions = beams.distances, beams.range_max, beams.directions
    cosine, sine = math.cos(yaw), math.sin(yaw)
    away = np.hypot(points[:, 0], points[:, 1])
    ends = placed_ends(points, np.ones(len(points)), away < far, x, y, cosine, sine)
    hits = np.concatenate((known[0], ends))
    gaps = np.concatenate((known[1], point_gaps[away < far]))
    remembered = len(hits)
    if is_merged or not beams.complete:  # space behind lost beams of the latest scan is not certified
        bounded = (beams.kinds & (LOST | HIT * is_merged) != 0) & (measured < range_max)
        edge = placed_ends(directions, np.maximum(measured, NEAREST), bounded, x, y, cosine, sine)
        hits, gaps = np.concatenate((hits, edge)), np.concatenate((gaps, np.zeros(len(edge))))
    within = reach + radius + CONNECTED_CHORD * beams.body  # farther hits restrict nothing
    nearest, gap, offset = points_to_bearings(hits, gaps, x, y, bearing_0, within, len(cosines))
    sight = within_sight(limit, beams, radius)
    near = (distance < min(NEAR_HITS * radius, range_max)) & (beams.kinds & HIT != 0)
    near_hits = placed_ends(directions, distance, near, x, y, cosine, sine)
    values = erode(nearest, gap, offset, radius, sight, cosines, squares)
    return hits, gaps, remembered, values, near_hits
