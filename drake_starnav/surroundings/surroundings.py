"""What is known of the space around the robot: the one object that certificate, planner and messages ask.

In a static world a place is free if any view covers it: else an obstacle stood there, and the beams of that view had
ended on it. What no view covers is unknown.
"""

import dataclasses
import math
from collections.abc import Sequence
from functools import cached_property, lru_cache

import numpy as np

from drake_starnav.geometry.footprint import Footprint
from drake_starnav.geometry.se2 import compose_poses, find_pose_in_frame
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.mounts import Mount
from drake_starnav.surroundings.certified_star import CertifiedStar, certify_star
from drake_starnav.surroundings.erosion import find_field_of_view, smooth_distances
from drake_starnav.surroundings.margins import Margins
from drake_starnav.surroundings.polar_image import PlacedBeams, find_view_range, make_polar_image
from drake_starnav.surroundings.recent_hits import NO_POINTS, Hits, RecentHits
from drake_starnav.surroundings.scan_averaging import AVERAGED_WITHIN, average_scan
from drake_starnav.surroundings.separation import ClearanceLimits, is_collision_free
from drake_starnav.surroundings.unseen import find_initial_disc_radius
from drake_starnav.surroundings.view import RangeSmoothing, View, find_near_hits
from drake_starnav.surroundings.view_arrays import ViewArrays
from drake_starnav.surroundings.view_history import (
    VIEW_SPACING,
    InitialFreeDisc,
    Odometer,
    ViewHistory,
    forget_stale_views,
)
from drake_starnav.utils.snapshot import replace_fields, snapshot

NEAR_HIT_RANGE = 4.0
"""Hits nearer than this count as near, in radii with the margin: among movers the robot keeps off walls."""
NO_FIELD_OF_VIEW = (0.0, 0.0)
"""Field of view of a star whose image holds past beams: at no bearing was all space seen by the last scan alone."""
PAST_VIEW_STEP = 4
"""The image of a robot that does not see all around has beams of every n-th past view, the last one, and the current
ones before."""


@snapshot
class Surroundings:
    """What the last scans, and views before them, tell of the space around the robot. Immutable; W, m and rad.

    Attributes:
        robot_pose: (x, y, yaw) of the robot when the last scan was taken.
        image: polar image of the last scans, in the robot's frame; see `make_polar_image`.
        recent_hits: near the robot, of the last RECENT_SCANS scans, not averaged over these.
        current_views: what each lidar saw at the last scan; none before the first.
        past_views: what was seen before.
        certified_star: positions that the recent hits certify.
        time: when the last scan was taken, s.
        previous_time: when the scan before it was taken, s.
        odometer: how far the robot has come.
    """

    robot_pose: np.ndarray
    image: LaserScan
    recent_hits: RecentHits
    current_views: ViewHistory
    past_views: ViewHistory
    certified_star: CertifiedStar
    time: float
    previous_time: float
    odometer: Odometer

    @staticmethod
    def unknown() -> "Surroundings":
        """Return what is known before the first scan: nothing."""
        none, never = ViewHistory(), -math.inf
        image, star = LaserScan.nothing(), CertifiedStar.none()
        return Surroundings(np.zeros(3), image, RecentHits(), none, none, star, never, never, Odometer())

    @property
    def has_views(self) -> bool:
        """Whether anything was seen."""
        return len(self.current_views.views) > 0

    def keeps_clear(self, poses: np.ndarray, footprint: Footprint, margin: float) -> bool:
        """Return whether a footprint keeps a margin to all surfaces and to unknown space at poses (n, k) of a motion.

        The first three columns are x, y, yaw. See `is_collision_free`.
        """
        if not self.has_views:
            return False
        limits = ClearanceLimits(margin, self.view.reach - footprint.radius)
        return bool(is_collision_free(poses, self.view.chords, self.further_views, footprint.body, limits))

    @cached_property
    def near_hits(self) -> np.ndarray:
        """Smoothed hits of the last scan close to the robot, shape (k, 2)."""
        if not self.has_views:
            return NO_POINTS
        image, distances = self.image, smooth_distances(self.image, self.view.params.smoothing.slack)
        is_near = image.hits & (distances < min(NEAR_HIT_RANGE * self.certified_star.radius, image.range_max))
        return image.points_at(distances, is_near, self.robot_pose)

    @property
    def view(self) -> View:
        """What the first lidar saw at the last scan."""
        view = self.current_views.views[0]
        assert isinstance(view, View)
        return view

    @cached_property
    def further_views(self) -> ViewArrays:
        """All views but `view`."""
        others = self.current_views.select(np.arange(1, len(self.current_views.views)))
        return ViewArrays.of(others.followed_by(self.past_views))

    def sample_past_beams(self, robot_pose: np.ndarray) -> list[PlacedBeams]:
        """Return beams of the current and of some past views, each with its pose in the frame of a robot pose, W."""
        indices = np.arange(len(self.past_views.views))
        sampled_views = self.past_views.select(np.concatenate((indices[:-1:PAST_VIEW_STEP], indices[-1:])))
        views, poses = self.current_views.followed_by(sampled_views)
        return [
            (view.beams, np.array(find_pose_in_frame(robot_pose, pose)))
            for view, pose in zip(views, poses, strict=True)
        ]

    def without_views_before(self, time: float) -> "Surroundings":
        """Return the surroundings without what was seen before a time, s."""
        lasting = np.flatnonzero(self.past_views.times >= time)
        if len(lasting) == len(self.past_views.views):
            return self
        return dataclasses.replace(self, past_views=self.past_views.select(lasting))

    def transformed(self, frame: np.ndarray) -> "Surroundings":
        """Return the surroundings in another frame, in which this one's origin is at the pose `frame` (x, y, yaw)."""
        current = self.current_views.transformed(frame)
        views = tuple([view.transformed(frame) if isinstance(view, View) else view for view in current.views])
        return dataclasses.replace(
            self,
            robot_pose=compose_poses(frame, self.robot_pose),
            recent_hits=self.recent_hits.transformed(frame),
            current_views=current._replace(views=views),
            past_views=self.past_views.transformed(frame),
            certified_star=self.certified_star.transformed(frame),
        )


def find_past_beams(
    previous_surroundings: Surroundings, views: Sequence[View], robot_pose: np.ndarray, footprint: Footprint
) -> list[PlacedBeams] | None:
    """Return beams of past views in the frame of a robot's pose, for what the lidars do not see now.

    None: they see all around, and no past view is needed.
    """
    return None if covers_full_circle(views, footprint) else previous_surroundings.sample_past_beams(robot_pose)


def covers_full_circle(views: Sequence[View], footprint: Footprint) -> bool:
    """Return whether the views, in an empty world, meet all around the robot as far as each sees."""
    if len(views) == 1:
        return views[0].scan.full_circle
    fields = tuple((*view.scan.field_of_view, view.scan.range_max) for view in views)
    return _covers_full_circle(fields, tuple(view.mount for view in views), footprint)


@lru_cache(maxsize=16)
def _covers_full_circle(
    fields: tuple[tuple[float, float, int, float], ...], mounts: tuple[Mount, ...], footprint: Footprint
) -> bool:
    """Return whether blank scans of these first bearings, steps, numbers of beams and ranges see all around."""
    scans = [LaserScan(0.0, first, step, 0.0, most, np.full(beams, math.inf)) for first, step, beams, most in fields]
    views = [replace_fields(View.none(), scan=scan, mount=mount) for scan, mount in zip(scans, mounts, strict=True)]
    return bool(make_polar_image(views, footprint).distances.min() >= min(map(find_view_range, scans, mounts)))


def observe(
    previous_surroundings: Surroundings,
    views: Sequence[View],
    past_beams: Sequence[PlacedBeams] | None,
    footprint: Footprint,
    margins: Margins,
) -> Surroundings:
    """Return the surroundings after one more scan of each lidar.

    Args:
        previous_surroundings: the surroundings before.
        views: of all lidars, taken or carried to the same time and robot pose.
        past_beams: see `find_past_beams`.
        footprint: of the robot.
        margins: that are kept.
    """
    radius, time, robot_pose = footprint.cover_radius + margins.safety, views[0].time, views[0].robot_pose
    image = make_polar_image(views, footprint, past_beams or ())
    reach = min(margins.hit_range(footprint.cover_radius), image.range_max)
    views, recent_hits = add_near_hits(views, previous_surroundings.recent_hits, reach)
    star_image, star_hits = image, recent_hits.hits
    if margins.average_scans and image.motion is None:
        averaged_range = radius + AVERAGED_WITHIN * footprint.cover_radius
        views, star_hits = average_views(views, previous_surroundings.recent_hits, averaged_range, reach)
        star_image = views[0].scan
    odometer = (
        previous_surroundings.odometer.advance(previous_surroundings.robot_pose, robot_pose)
        if previous_surroundings.has_views
        else previous_surroundings.odometer
    )
    past_views = update_past_views(previous_surroundings, views, odometer, footprint, margins)
    star_field_of_view = (
        find_field_of_view(image) if past_beams is None or has_lone_axis_lidar(views) else NO_FIELD_OF_VIEW
    )
    return Surroundings(
        robot_pose=robot_pose,
        image=image,
        recent_hits=recent_hits,
        current_views=ViewHistory.of_one_time(views, [view.pose for view in views], time, odometer),
        past_views=past_views,
        certified_star=certify_star(
            star_image, star_hits, robot_pose, radius, margins.safety_range, star_field_of_view
        ),
        time=time,
        previous_time=previous_surroundings.time,
        odometer=odometer,
    )


def add_near_hits(views: Sequence[View], recent: RecentHits, reach: float) -> tuple[list[View], RecentHits]:
    """Return views with the hits of which their chords are made, and the recent hits with those of these views.

    Each view gets its own hits nearer than `reach`, m, those of the other lidars, and the `recent` hits of the scans
    before. The views are of one time.
    """
    recent, near_hits = recent.forget_oldest(), [find_near_hits(view, reach) for view in views]
    views_with_hits = []
    for k, view in enumerate(views):
        others = [hits.points for hits in (*near_hits[:k], *near_hits[k + 1 :])]
        points = np.concatenate((recent.hits.points, *others)) if others else recent.hits.points
        visible = min(reach - view.mount.offset, view.scan.range_max, view.beams.certain_range)
        views_with_hits.append(replace_fields(view, own_hits=near_hits[k].points, further_hits=points, reach=visible))
    latest = near_hits[0] if len(near_hits) == 1 else Hits(*map(np.concatenate, zip(*near_hits, strict=True)))
    return views_with_hits, recent.add_scan(latest)


def average_views(
    views: Sequence[View], recent: RecentHits, averaged_range: float, reach: float
) -> tuple[list[View], Hits]:
    """Return the view of a lone lidar, with ranges up to `averaged_range` (m) averaged over recent scans; its surfaces.

    The surfaces are hits nearer than `reach`, m, of this view and of the `recent` scans before.
    """
    (view,) = views  # more are refused
    smoothing, scan = view.params.smoothing, view.scan
    smoothed_ranges = smooth_distances(scan, smoothing.slack, smoothing.beams)
    scan = dataclasses.replace(scan, ranges=np.where(scan.hits, smoothed_ranges, scan.ranges))
    recent, scan = average_scan(recent, scan, view.robot_pose, averaged_range)
    params = view.params._replace(smoothing=RangeSmoothing(0, smoothing.slack))
    averaged_views, recent = add_near_hits([replace_fields(view, scan=scan, params=params)], recent, reach)
    return averaged_views, recent.hits


def update_past_views(
    previous_surroundings: Surroundings,
    views: Sequence[View],
    odometer: Odometer,
    footprint: Footprint,
    margins: Margins,
) -> ViewHistory:
    """Return the past views that still count; the last one is the initial free disc, as long as it does."""
    x, y, yaw = views[0].robot_pose.tolist()
    if previous_surroundings.has_views:
        reach = margins.hit_range(footprint.radius)
        retention = margins.retention._replace(reach=reach, spacing=VIEW_SPACING * footprint.radius)
        past = forget_stale_views(
            previous_surroundings.past_views,
            previous_surroundings.current_views,
            odometer,
            (x, y),
            views[0].time,
            retention,
        )
    else:
        past = make_initial_views(views, (x, y, yaw), footprint, margins.safety)
    disc = past.views[-1] if past.views else None
    if isinstance(disc, InitialFreeDisc):
        disc = disc.cut_by(views[0].chords, tuple(past.poses[-1].tolist()))
        past = past._replace(views=(*past.views[:-1], disc))
    return past


def make_initial_views(
    views: Sequence[View], pose: tuple[float, float, float], footprint: Footprint, margin: float
) -> ViewHistory:
    """Return the initial free disc about the first pose (x, y, yaw), unless one lidar on the axis sees all around."""
    lidar_offset = 0.0
    if covers_full_circle(views, footprint):
        if has_lone_axis_lidar(views):
            return ViewHistory()
    else:
        lidar_offset = max(0.0, *(view.mount.x for view in views))
    disc = InitialFreeDisc.of_radius(find_initial_disc_radius(footprint, margin, lidar_offset))
    return ViewHistory.of_one_time((disc,), (pose,), views[0].time, Odometer())


def has_lone_axis_lidar(views: Sequence[View]) -> bool:
    """Return whether there is a single lidar, on the robot's axis."""
    return len(views) == 1 and views[0].mount.offset == 0.0
