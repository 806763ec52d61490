"""From scans to what is known of the surroundings, and to the planner's star-shaped region."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.footprint import Footprint
from drake_starnav.geometry.se2 import transform_points
from drake_starnav.lidar.field_of_view import ROUNDING, TURN
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.mounts import ON_AXIS, Mount, find_newest
from drake_starnav.surroundings.margins import SCAN_PATIENCE, Margins
from drake_starnav.surroundings.observation import Observation
from drake_starnav.surroundings.polar_image import covers_full_circle, find_remembered_hits, make_polar_image
from drake_starnav.surroundings.recent_hits import NO_POINTS
from drake_starnav.surroundings.star_region import clear_region, make_scan_region
from drake_starnav.surroundings.surroundings import Surroundings, is_on_axis, observe
from drake_starnav.surroundings.view import RangeSmoothing, View, ViewParams, carry_view, make_view
from drake_starnav.utils.snapshot import replace_fields, snapshot
from drake_starnav.utils.timing import EARLY

FRONT_VIEW, WIDE_VIEW = math.pi, math.radians(260.0)
"""Smallest views of all lidars with the certificate, rad; the wide one among moving obstacles, where the robot may
reverse."""
FEWEST_BEAMS = 36
"""Beams that a lidar needs per turn: with fewer, hits on one wall are not recognised as connected."""


def check_views(scans: Sequence[LaserScan], mounts: Sequence[Mount], footprint: Footprint, *, backwards: bool) -> None:
    """Raise a `StarnavError` if lidars observe too little for a certificate.

    Args:
        scans: of each lidar, any.
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
    wanted_view = 0.5 * (WIDE_VIEW if backwards else FRONT_VIEW) - ROUNDING
    for bearing in np.linspace(-wanted_view, wanted_view, FEWEST_BEAMS):
        if not any(each.full_circle or (bearing - each.angle_min) % TURN <= each.span for each in views):
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
        latest_views: of each lidar, None before its first; empty before that of all.
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
        outlier_noise: standard deviation of the ranges at which outliers are removed, see `without_outliers`, m; None:
            they are not.
        mounts: of the lidars.
        has_planner: whether somebody plans: without, no region is made, only what is certified.
    """

    margins: Margins
    footprint: Footprint
    outlier_noise: float | None = None
    mounts: tuple[Mount, ...] = (ON_AXIS,)
    has_planner: bool = True

    @property
    def view_params(self) -> ViewParams:
        """What `make_view` needs of it."""
        margins = self.margins
        smoothing = RangeSmoothing(margins.smoothed_beams, margins.smoothing_slack)
        return ViewParams(
            self.footprint, smoothing, margins.thinnest, self.outlier_noise, margins.retention.range_error
        )


Perceive = Callable[[PerceptionState, Sequence[LaserScan], np.ndarray, PerceptionSettings], PerceptionState]
"""Perception as a pure function: `perceive`, or the paper's."""


def perceive(
    state: PerceptionState, scans: Sequence[LaserScan], robot_pose: np.ndarray, settings: PerceptionSettings
) -> PerceptionState:
    """Process new scans: make a view of each, add the views to the surroundings, and fit the planner's region.

    Args:
        state: before the scans.
        scans: the last of each lidar in its sensor frame S; new are the `find_newest`.
        robot_pose: (x, y, yaw) of the robot in the world frame W at the time of the newest, m and rad.
        settings: of robot and sensors.
    """
    latest_views = update_views(state.latest_views, scans, robot_pose, settings)
    views = carry_fresh_views(latest_views, robot_pose, find_newest(scans))
    if len(views) < len(settings.mounts):  # some lidar has not looked yet, or not for long
        return replace_fields(state, latest_views=latest_views)
    surroundings = observe(state.surroundings, views, robot_pose, settings.footprint, settings.margins)
    observation = make_observation(state, surroundings, views, settings)
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
    """Return of which lidars the scans are the newest, and not in their latest views yet."""
    time, rows = find_newest(scans), zip(latest_views or (None,) * len(scans), scans, strict=True)
    return [scan.measured_at == time and (view is None or view.time != time) for view, scan in rows]


def carry_fresh_views(latest_views: tuple[View | None, ...], robot_pose: np.ndarray, time: float) -> list[View]:
    """Return the views no older than SCAN_PATIENCE of their scan periods, carried to a time, s, and robot pose."""
    return [
        carry_view(view, robot_pose, time)
        for view in latest_views
        if view is not None and time - view.time <= SCAN_PATIENCE * view.scan.scan_time + EARLY
    ]


def make_observation(
    previous_observation: PerceptionState,
    surroundings: Surroundings,
    views: Sequence[View],
    settings: PerceptionSettings,
) -> Observation:
    """Return what the planner gets of the views: their polar image, and the star-shaped region in it.

    Args:
        previous_observation: state before the scans.
        surroundings: with the views.
        views: of all lidars.
        settings: of robot and sensors.
    """
    margins, footprint, robot_pose = settings.margins, settings.footprint, surroundings.robot_pose
    image, earlier = surroundings.image, []
    if not covers_full_circle(views, footprint):
        earlier = previous_observation.surroundings.coarse_views(robot_pose)
    if any(view.confirmed_scan is not view.scan for view in views):
        image = make_polar_image(views, footprint, earlier, confirmed=True)
    if not settings.has_planner:
        return Observation(None, image, robot_pose)
    first = previous_observation.observation.region
    samples = 0 if first is None else len(first.free_range)  # though the number of beams may vary
    region = make_scan_region(image, robot_pose, footprint.cover_radius, margins, samples)
    remembered_hits = NO_POINTS
    if earlier and is_on_axis(views):
        points = find_remembered_hits(views, earlier).points
        hit_range = margins.safety_range + 2.0 * (footprint.cover_radius + margins.safety)
        remembered_hits = transform_points(robot_pose, points[np.hypot(*points.T) < hit_range])
    return Observation(
        clear_region(region, remembered_hits, footprint.cover_radius), image, robot_pose, remembered_hits
    )
