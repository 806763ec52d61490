"""Margins, smoothing and averaging that the declared faults require."""

import math

import numpy as np
import pytest

from drake_starnav import ControllerParameters, LidarParameters, Scenario, StarnavError, World
from drake_starnav.lidar.mounts import Mount
from drake_starnav.scenario.error_budget import evaluate_error_budget
from drake_starnav.scenario.margins import LARGEST_MARGIN, derive_margins
from drake_starnav.scenario.scenario_file import load_scenario
from drake_starnav.surroundings.erosion import smooth_distances
from tests.helpers.scans import MARGINS, RADIUS, cast

KNOWN = 1.0 / LidarParameters().rate + 1.0 / ControllerParameters().rate
"""For so long the robot drives by one scan, s."""


def declaring(*overrides: str) -> Scenario:
    return load_scenario("room", overrides=overrides)


def test_of_the_default_scenario() -> None:
    margins = vars(derive_margins(declaring()))
    assert margins.pop("retention") == MARGINS.retention._replace(range_error=0.0075)
    assert margins == pytest.approx(
        {name: margin for name, margin in vars(MARGINS).items() if name != "retention"} | {"smoothed_beams": 1}
    )


def test_views_count_for_as_long_as_the_budget_allows_for_errors_of_the_pose() -> None:
    lasts = 1.0 - 0.8  # M - T
    drifting, jumping = (derive_margins(declaring(f"localization.{name}=0.01")).retention for name in ("drift", "jump"))
    assert drifting[2:] == pytest.approx((0.8 * lasts, 2.0 * lasts, math.inf, 0.0075))
    assert jumping[2:] == pytest.approx((math.inf, math.inf, lasts, 0.0075))


def test_margins_follow_from_what_is_declared_narrower_as_well_as_wider() -> None:
    margins = [
        derive_margins(declaring(*changes)).safety
        for changes in (
            ("lidar.noise=0", "lidar.beams=1440"),
            ("lidar.noise=0.001", "lidar.beams=720"),
            (),
            ("lidar.noise=0.03",),
            ("lidar.noise=0.03", "lidar.beams=90", "drive.error=0.05"),
        )
    ]
    assert margins[0] == pytest.approx(0.007)
    assert margins == sorted(set(margins))


def test_where_there_is_room_the_preferred_clearance_is_kept_too() -> None:
    margins = derive_margins(declaring("planner.preferred_clearance=0.3"))
    assert margins.preferred == pytest.approx(margins.safety + 0.3)
    assert margins.least < margins.safety


@pytest.mark.parametrize(
    ("changes", "reach"),
    [
        ((), 1.2),
        (("lidar.beams=1440", "robot.max_speed=2", "robot.max_acceleration=2"), 1.25 * (1.0 + 2.0 * KNOWN)),
        (("lidar.beams=1440", "robot.max_speed=3"), 0.01 * 1440 / (0.87 * 2.0 * math.pi) - 0.25),  # else corners count
        (("robot.max_speed=3",), 1.2),
    ],
)
def test_the_certified_region_reaches_farther_than_the_robot_needs_to_stop(
    changes: tuple[str, ...], reach: float
) -> None:
    assert derive_margins(declaring(*changes)).safety_range == pytest.approx(reach)


@pytest.mark.parametrize(
    ("changes", "drops"), [((), False), (("localization.drift=0.01",), True), (("localization.jump=0.1",), True)]
)
def test_without_an_exact_localization_nodes_are_dropped_whose_hits_are_seen_through(changes, drops):
    assert derive_margins(declaring(*changes)).drop_seen_through == drops


def test_a_margin_of_half_a_metre_is_the_largest_that_is_allowed():
    error = LARGEST_MARGIN - derive_margins(declaring()).safety
    while derive_margins(declaring(f"drive.error={error!r}")).safety < LARGEST_MARGIN:
        error = math.nextafter(error, 1.0)  # for rounding
    assert derive_margins(declaring(f"drive.error={error!r}")).safety == LARGEST_MARGIN
    with pytest.raises(StarnavError, match="gives a safety margin of 0.5 m; allowed: at most 0.5 m"):
        derive_margins(declaring(f"drive.error={error + 1e-9!r}"))


@pytest.mark.parametrize(
    ("noise", "slack", "beams"),
    [(0.0, 0.0, 0), (0.007, 0.0, 0), (0.01, 0.0, 1), (0.02, 0.03, 2), (0.03, 0.06, 2), (0.05, 0.12, 4)],
)
def test_noise_is_smoothed_with_slack_beyond_the_nominal_and_much_is_averaged(noise, slack, beams):
    margins = derive_margins(declaring(f"lidar.noise={noise}"))
    assert margins.smoothing_slack == pytest.approx(slack) and margins.smoothed_beams == beams
    assert margins.average_scans == (noise == 0.05)


def wedge_scans(angle, distance, lidar):
    """Scans of a wedge of an angle (degrees) that points at the robot from a distance (m), turned in many ways."""
    tip = np.array((distance, 0.0))
    for axis in np.linspace(-0.6, 0.6, 9):
        sides = axis + np.radians(0.5 * angle) * np.array((-1.0, 1.0))
        back = tip + 0.5 * np.column_stack((np.cos(sides), np.sin(sides)))
        wedge = World("wedge", (0, 0, 0), (0, 0), polygons=(np.vstack((tip, back)),), bounds=(-3.0, -3.0, 3.0, 3.0))
        for yaw in np.linspace(0.0, max(np.radians(1.0), lidar.angle_increment), 5):
            yield cast(wedge, np.array((0.0, 0.0, yaw)), beams=lidar.beams)


@pytest.mark.parametrize("noise", [0.01, 0.02, 0.05])
@pytest.mark.parametrize("angle", [60.0, 90.0])
@pytest.mark.parametrize("beams", [36, 90, 180, 360, 720])
def test_the_margin_covers_what_smoothing_takes_off_a_corner(noise, angle, beams):
    scenario = declaring(f"lidar.noise={noise}", f"lidar.beams={beams}")
    lidar, margins = scenario.lidar, derive_margins(scenario)
    if not margins.smoothed_beams:
        assert math.radians(noise / 0.015) < 0.5 * lidar.angle_increment  # nothing is taken off
        return
    smoothing = margins.smoothing_slack, margins.smoothed_beams
    for scan in wedge_scans(angle, RADIUS + margins.safety, lidar):
        lost = smooth_distances(scan, *smoothing).min() - scan.distances.min()
        assert lost < margins.safety


@pytest.mark.parametrize("noise", [0.0, 0.001, 0.01])
@pytest.mark.parametrize("beams", [36, 90, 360])
def test_the_margin_covers_what_sticks_out_between_two_beams(beams, noise):
    scenario = declaring(f"lidar.beams={beams}", f"lidar.noise={noise}")
    margin = derive_margins(scenario).safety
    for scan in wedge_scans(90.0, RADIUS + margin, scenario.lidar):
        assert scan.distances.min() - RADIUS - margin < margin


@pytest.mark.parametrize("noise", [0.0, 0.001, 0.01, 0.03])
@pytest.mark.parametrize("beams", [90, 360])
def test_the_margin_covers_a_corner_seen_from_where_the_robot_must_begin_to_stop(beams, noise):
    """A scan from there sees a corner of 60 degrees, pointing at the robot, too far away by the margin at most.

    By first order in the angle between two beams, that is.
    """
    scenario = declaring(
        "robot.max_speed=2", "robot.max_acceleration=1.5", f"lidar.beams={beams}", f"lidar.noise={noise}"
    )
    lidar, distance = scenario.lidar, evaluate_error_budget(scenario).symbols["D"]
    assert distance >= 0.25 + 1.2
    for scan in wedge_scans(60.0, distance, lidar):
        too_far = scan.distances.min() - distance
        assert too_far < derive_margins(scenario).safety * (1.0 + 2.0 * lidar.angle_increment)


def test_corners_stick_out_farther_between_beams_of_a_lidar_that_is_off_the_axis() -> None:
    scenario, mount = declaring("lidar.beams=120"), Mount(0.1, 0.2, 0.0, False)
    farther = evaluate_error_budget(scenario, mount).symbols["D"] - evaluate_error_budget(scenario).symbols["D"]
    assert farther == pytest.approx(mount.offset)
    gap = 0.87 * scenario.lidar.widest_gap * mount.offset
    assert derive_margins(scenario, (mount,)).safety == pytest.approx(derive_margins(scenario).safety + gap)


def test_the_worst_of_several_lidars_counts() -> None:
    two = declaring("lidars=[{beams: 120}, {noise: 0.03}]")
    alone = [derive_margins(declaring(f"lidar.{each}")) for each in ("beams=120", "noise=0.03")]
    margins = derive_margins(two)
    assert margins.safety == max(each.safety for each in alone)
    assert margins.smoothed_beams == max(each.smoothed_beams for each in alone)
    assert margins.safety_range == min(each.safety_range for each in alone)
