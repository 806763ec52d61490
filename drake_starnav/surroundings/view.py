"""One scan of one lidar, made ready once, and what follows from it: hits, chords, and how far the lidar saw."""

import dataclasses
import math
from functools import cached_property
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.geometry.footprint import Footprint, disc
from drake_starnav.geometry.se2 import compose_poses, find_pose_in_frame, transform_points
from drake_starnav.lidar.deskew import deskew_scan
from drake_starnav.lidar.laser_scan import HIT, Beams, LaserScan, place_ends
from drake_starnav.lidar.mounts import ON_AXIS, Mount, align_with_robot
from drake_starnav.lidar.outlier_filter import HitHistory, ScanFilter, remove_lone_close_hits
from drake_starnav.surroundings.bearing_hits import measure_half_chords
from drake_starnav.surroundings.chords import Chords, make_occluding_chords, make_surface_chords, measure_visible_ranges
from drake_starnav.surroundings.erosion import average_neighbours
from drake_starnav.surroundings.recent_hits import NO_POINTS, Hits
from drake_starnav.utils.snapshot import replace_fields, snapshot

NEAREST = 0.001
"""A hit that is too close to be measured is placed this far along its beam, to give it a direction, m: numerics."""


class RangeSmoothing(NamedTuple):
    """How ranges are smoothed, see `smooth_distances`.

    Attributes:
        beams: half width of the moving average; 0: ranges stay as measured.
        slack: additional change that smoothing may make, m.
    """

    beams: int = 0
    slack: float = 0.0


UNSMOOTHED = RangeSmoothing()


class ViewParams(NamedTuple):
    """What `make_view` needs to know about robot and lidars.

    Attributes:
        footprint: of the robot.
        smoothing: of the ranges from which hits are made.
        thinnest: width of the thinnest obstacle that the certificate must not miss, m; infinite: nobody relies on it.
        filter_scan: what discards doubted hits.
        range_error: subtracted from visible ranges, m: among many views the one with the largest error decides.
    """

    footprint: Footprint
    smoothing: RangeSmoothing = RangeSmoothing()
    thinnest: float = math.inf
    filter_scan: ScanFilter = remove_lone_close_hits
    range_error: float = 0.0


@snapshot
class View:
    """What one lidar saw at one time. Immutable; m and rad.

    Attributes:
        scan: de-skewed, without doubted hits, in a frame at the lidar whose axes are parallel to the robot's frame B.
        confirmed_scan: for the roadmap: the scan with confirmed hits alone, see `ScanFilter`, whose lost beams may hide
            thin obstacles; the same object where no beam is lost.
        mount: of the lidar; its x and y place the scan's frame in B, its yaw is already in the scan.
        robot_pose: (x, y, yaw) of B in W.
        hit_history: of the last scans of this lidar, which confirm or refute new hits.
        params: with which it was made.
        own_hits: hits that `observe` found near the robot, shape (n, 2), W.
        further_hits: near hits of the other lidars and of the scans before, shape (k, 2), W.
        reach: how far from the lidar the view certifies free space, m; 0 until `observe` has given it its hits.
    """

    scan: LaserScan
    confirmed_scan: LaserScan
    mount: Mount
    robot_pose: np.ndarray
    hit_history: HitHistory
    params: ViewParams
    own_hits: np.ndarray = dataclasses.field(default_factory=lambda: NO_POINTS)
    further_hits: np.ndarray = dataclasses.field(default_factory=lambda: NO_POINTS)
    reach: float = 0.0

    @staticmethod
    def none() -> "View":
        """Return a view that saw nothing."""
        scan = LaserScan.nothing()
        return View(scan, scan, ON_AXIS, np.zeros(3), HitHistory(), ViewParams(disc(0.0)))

    @property
    def time(self) -> float:
        """When its scan was taken, s."""
        return self.scan.time

    @property
    def beams(self) -> Beams:
        """The beams of its scan."""
        return self.scan.beams

    @cached_property
    def pose(self) -> tuple[float, float, float]:
        """Pose (x, y, yaw) of the scan's frame in W."""
        x, y, yaw = self.mount.find_lidar_pose(self.robot_pose).tolist()
        return x, y, yaw

    @cached_property
    def chords(self) -> Chords:
        """Surfaces through its own and further hits, and what else hides space from the lidar."""
        surfaces, occludes = make_surface_chords(self.own_hits, self.further_hits, self.pose, self.beams.cover_radius)
        hiding = make_occluding_chords(self.beams, self.pose)
        is_surface = np.arange(len(surfaces) + len(hiding)) < len(surfaces)
        occludes = np.concatenate((occludes, np.ones(len(hiding), np.bool_)))
        return Chords(np.vstack((surfaces, hiding)), is_surface, occludes, np.array(self.pose[:2]))

    @cached_property
    def visible_ranges(self) -> np.ndarray:
        """Visible range in each bearing bin, shape (BINS,), m; bin 0 begins at the yaw of `pose`."""
        return measure_visible_ranges(self.chords.ends, self.pose, self.reach) - self.params.range_error

    def transformed(self, frame: np.ndarray) -> "View":
        """Return the view in another frame, in which the origin of this one is at the pose `frame` (x, y, yaw)."""
        return replace_fields(
            self,
            robot_pose=compose_poses(frame, self.robot_pose),
            own_hits=transform_points(frame, self.own_hits),
            further_hits=transform_points(frame, self.further_hits),
        )


def make_view(scan: LaserScan, mount: Mount, robot_pose: np.ndarray, previous: View | None, params: ViewParams) -> View:
    """Make a view of a new scan: align it with the robot, de-skew it, and discard doubted hits.

    Args:
        scan: in the sensor frame S.
        mount: of the lidar.
        robot_pose: (x, y, yaw) of the robot in W when the scan was taken, m and rad.
        previous: view of the scan before; None: there is none.
        params: of robot and lidars.
    """
    cover_radius = params.footprint.cover_radius
    own_reach = cover_radius - mount.offset
    if (scan.cover_radius, scan.thinnest) != (cover_radius, params.thinnest):
        scan = dataclasses.replace(scan, cover_radius=cover_radius, thinnest=params.thinnest)
    scan, pose = align_with_robot(scan, mount), mount.find_lidar_pose(robot_pose)
    if previous is not None and scan.time_increment:
        scan = deskew_scan(scan, mount.find_lidar_pose(previous.robot_pose), previous.time, pose, own_reach)
    history = HitHistory() if previous is None else previous.hit_history
    scan, confirmed_scan, history = params.filter_scan(scan, pose, history, own_reach)
    if confirmed_scan is not scan or not scan.beams.complete:
        confirmed_scan = confirmed_scan.again(confirmed_scan.ranges, thinnest=math.inf)
    return View(scan, confirmed_scan, mount, robot_pose, history, params)


def carry_view(view: View, robot_pose: np.ndarray, time: float) -> View:
    """Return a view as if it was taken at a later time, s, and pose of the robot, as the surroundings stand still."""
    if view.time == time:
        return view
    mount = Mount(*find_pose_in_frame(robot_pose, np.array(view.pose)), upside_down=False)
    scan = align_with_robot(dataclasses.replace(view.scan, time=time), mount)
    confirmed_scan = scan
    if view.confirmed_scan is not view.scan:
        confirmed_scan = align_with_robot(dataclasses.replace(view.confirmed_scan, time=time), mount)
    return View(scan, confirmed_scan, mount, robot_pose, view.hit_history, view.params)


@kernel
def make_hits(beams, smoothing, x, y):
    """Return smoothed static and possibly moving hits of beams that start at (x, y), and their half chords."""
    smoothed_ranges, hits = average_neighbours(beams, smoothing.beams, smoothing.slack), beams.kinds & HIT != 0
    points = place_ends(beams.directions, np.maximum(smoothed_ranges, NEAREST), hits, x, y, 1.0, 0.0)
    return points, measure_half_chords(smoothed_ranges, beams)[hits]


def find_near_hits(view: View, farthest_distance: float) -> Hits:
    """Return the smoothed hits of a view nearer to the robot's axis than `farthest_distance`, m, in W."""
    x, y, yaw = view.robot_pose.tolist()
    mount, smoothing = view.mount, view.params.smoothing
    return Hits(*_find_near_hits(view.beams, smoothing, (mount.x, mount.y), farthest_distance, (x, y), yaw))


@kernel
def _find_near_hits(beams, smoothing, place, farthest_distance, position, yaw):
    """Return points and half chords of `find_near_hits`, of a lidar at a place in B."""
    points, gaps = make_hits(beams, smoothing, place[0], place[1])
    is_near = np.hypot(points[:, 0], points[:, 1]) < farthest_distance
    cosine, sine = math.cos(yaw), math.sin(yaw)
    return place_ends(points, np.ones(len(points)), is_near, position[0], position[1], cosine, sine), gaps[is_near]
