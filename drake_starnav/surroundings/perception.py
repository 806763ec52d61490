"""From scans to what is known of the surroundings, and to the planner's star-shaped region."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.footprint import Footprint
from drake_starnav.geometry.se2 import transform_points
from drake_starnav.lidar.field_of_view import ROUNDING, TURN, FieldOfView
from drake_starnav.lidar.laser_scan import HIT, MAPPABLE, LaserScan, place_ends
from drake_starnav.lidar.mounts import ON_AXIS, Mount, find_newest
from drake_starnav.lidar.outlier_filter import ScanFilter, remove_lone_close_hits
from drake_starnav.surroundings.margins import SCAN_PATIENCE, Margins
from drake_starnav.surroundings.observation import Observation
from drake_starnav.surroundings.polar_image import PlacedBeams, make_polar_image
from drake_starnav.surroundings.star_region import StarRegion, make_scan_region
from drake_starnav.surroundings.surroundings import Surroundings, find_past_beams, has_lone_axis_lidar, observe
from drake_starnav.surroundings.view import RangeSmoothing, View, ViewParams, carry_view, make_view
from drake_starnav.utils.snapshot import replace_fields, snapshot
from drake_starnav.utils.timing import EARLY

FRONT_SPAN, WIDE_SPAN = math.pi, math.radians(260.0)
"""Smallest views of all lidars with the certificate, rad; the wide one among moving obstacles, where the robot may
reverse."""
FEWEST_BEAMS = 36
"""Beams that a lidar needs per turn: with fewer, hits on one wall are not recognised as connected."""


def check_fields_of_view(
    scans: Sequence[LaserScan], mounts: Sequence[Mount], footprint: Footprint, *, backwards: bool
) -> None:
    """Raise a `StarnavError` if lidars observe too little for a certificate.

    Args:
        scans: one of each lidar, for its field of view.
        mounts: of the lidars.
        footprint: of the robot.
        backwards: whether the robot may reverse.
    """
    views = [mount.view(scan.field_of_view) for scan, mount in zip(scans, mounts, strict=True)]
    for each, mount in zip(views, mounts, strict=True):
        if each.angle_increment > TURN / FEWEST_BEAMS + 1e-9:
            raise StarnavError(
                f"lidar.beams is {each.beams}, one every {math.degrees(each.angle_increment):.3g} degrees, with "
                f"a certificate; allowed: at least {FEWEST_BEAMS} a turn"
            )
        if mount.offset > footprint.radius:
            raise StarnavError(
                f"a lidar is mounted {mount.offset:g} m from the robot's axis; allowed: up to {footprint.radius:g} m, "
                "the farthest point of the robot: a robot.radius or robot.footprint that reaches the lidar"
            )
    wanted_view = 0.5 * (WIDE_SPAN if backwards else FRONT_SPAN) - ROUNDING
    bearings = np.linspace(-wanted_view, wanted_view, FEWEST_BEAMS)
    if not np.any([each.looks_at(bearings) for each in views], axis=0).all():
        views_text = ", ".join(
            f"{math.degrees(each.angle_min):.0f} to {math.degrees(each.angle_max):.0f}" for each in views
        )
        raise StarnavError(
            f"a lidar sees from {views_text} degrees, counted from straight ahead, with a certificate; "
            f"allowed: views that reach {math.degrees(wanted_view):.0f} degrees to each side of straight ahead, as "
            "space that no beam has observed is not certified"
        )


@snapshot
class PerceptionState:
    """Perception's state after a scan. Immutable.

    Attributes:
        observation: the scan with its pose and region, for the planner.
        surroundings: what is known of the space around the robot.
        latest_views: of each lidar; None of one without a scan yet; empty before the first scan of any.
    """

    observation: Observation
    surroundings: Surroundings
    latest_views: tuple[View | None, ...]

    @staticmethod
    def initial() -> "PerceptionState":
        """Return the state before the first scan."""
        return PerceptionState(Observation.none(), Surroundings.unknown(), ())

    def misses_any(self, scans: Sequence[LaserScan]) -> bool:
        """Return whether some of the `find_newest` scans were not processed."""
        return any(find_new_scans(self.latest_views, scans))


class PerceptionSettings(NamedTuple):
    """What perception needs to know about robot and sensor.

    Attributes:
        margins: of the planner's region and of the certified star.
        footprint: of the robot.
        mounts: of the lidars.
        filter_scan: what discards doubted hits.
    """

    margins: Margins
    footprint: Footprint
    mounts: tuple[Mount, ...] = (ON_AXIS,)
    filter_scan: ScanFilter = remove_lone_close_hits

    @property
    def view_params(self) -> ViewParams:
        """What `make_view` needs of it."""
        margins = self.margins
        smoothing = RangeSmoothing(margins.smoothed_beams, margins.smoothing_slack)
        return ViewParams(self.footprint, smoothing, margins.thinnest, self.filter_scan, margins.retention.range_error)


Perceive = Callable[[PerceptionState, Sequence[LaserScan], np.ndarray, PerceptionSettings], PerceptionState]
"""Perception as a pure function: `perceive`, or the paper's."""


def perceive(
    state: PerceptionState, scans: Sequence[LaserScan], robot_pose: np.ndarray, settings: PerceptionSettings
) -> PerceptionState:
    """Process new scans: make a view of each, add the views to the surroundings, and fit the planner's region.

    Until every lidar has a view no older than SCAN_PATIENCE scan periods, only the latest views change.

    Args:
        state: before the scans.
        scans: the latest of each lidar, in its sensor frame S; those with the newest time stamp are processed.
        robot_pose: (x, y, yaw) of the robot in the world frame W at the time of the newest, m and rad.
        settings: of robot and sensors.
    """
    latest_views = update_views(state.latest_views, scans, robot_pose, settings)
    views = carry_fresh_views(latest_views, robot_pose, find_newest(scans))
    if len(views) < len(settings.mounts):  # a lidar has sent no scan yet, or none for a while
        return replace_fields(state, latest_views=latest_views)
    past_beams = find_past_beams(state.surroundings, views, robot_pose, settings.footprint)
    surroundings = observe(state.surroundings, views, past_beams, settings.footprint, settings.margins)
    observation = make_observation(surroundings, views, past_beams or (), state.observation.region, settings)
    return PerceptionState(observation, surroundings, latest_views)


def update_views(
    latest_views: tuple[View | None, ...],
    scans: Sequence[LaserScan],
    robot_pose: np.ndarray,
    settings: PerceptionSettings,
) -> tuple[View | None, ...]:
    """Return the latest view of each lidar; arguments as for `perceive`."""
    params, views = settings.view_params, list(latest_views or (None,) * len(scans))
    for k, is_new in enumerate(find_new_scans(latest_views, scans)):
        if is_new:
            views[k] = make_view(scans[k], settings.mounts[k], robot_pose, views[k], params)
    return tuple(views)


def find_new_scans(latest_views: tuple[View | None, ...], scans: Sequence[LaserScan]) -> list[bool]:
    """Return of each lidar whether its scan has the newest time stamp, and no view was made of it yet."""
    time, rows = find_newest(scans), zip(latest_views or (None,) * len(scans), scans, strict=True)
    return [scan.measured_at == time and (view is None or view.time != time) for view, scan in rows]


def carry_fresh_views(latest_views: tuple[View | None, ...], robot_pose: np.ndarray, time: float) -> list[View]:
    """Return the views no older than SCAN_PATIENCE scan periods, as if taken at a time, s, and at a robot's pose."""
    return [
        carry_view(view, robot_pose, time)
        for view in latest_views
        if view is not None and time - view.time <= SCAN_PATIENCE * view.scan.scan_time + EARLY
    ]


def make_observation(
    surroundings: Surroundings,
    views: Sequence[View],
    past_beams: Sequence[PlacedBeams],
    previous_region: StarRegion | None,
    settings: PerceptionSettings,
) -> Observation:
    """Return what the planner gets of the views: their polar image, and the star-shaped region in it.

    Args:
        surroundings: with the views.
        views: of all lidars.
        past_beams: beams of views before, see `find_past_beams`; none where lidars see all around.
        previous_region: of the observation before; the new one has as many samples, though beams may vary.
        settings: of robot and sensors.
    """
    margins, footprint, robot_pose = settings.margins, settings.footprint, surroundings.robot_pose
    radius, image = footprint.cover_radius, surroundings.image
    if any(view.confirmed_scan is not view.scan for view in views):
        image = make_polar_image(views, footprint, past_beams, confirmed=True)
    samples = 0 if previous_region is None else len(previous_region.free_range)
    region = make_scan_region(image, robot_pose, radius, margins, samples)
    observation = Observation(region, image, robot_pose)
    if not past_beams or not has_lone_axis_lidar(views):
        return observation
    hits = find_past_hits(views[0].scan.field_of_view, past_beams)
    near_hits = hits[np.hypot(*hits.T) < margins.hit_range(radius)]
    return observation.cut_back_to_hits(transform_points(robot_pose, near_hits), radius)


def find_past_hits(field_of_view: FieldOfView, past_beams: Sequence[PlacedBeams]) -> np.ndarray:
    """Return hits of past beams, not on what moves, in B, shape (n, 2), where a lidar on the axis does not look."""
    hits = []
    for beams, (x, y, yaw) in past_beams:
        is_kept = beams.kinds & (HIT | MAPPABLE) == HIT | MAPPABLE
        hits.append(place_ends(beams.directions, beams.distances, is_kept, x, y, math.cos(yaw), math.sin(yaw)))
    points = np.vstack(hits)
    return points[~field_of_view.looks_at(np.arctan2(points[:, 1], points[:, 0]))]
