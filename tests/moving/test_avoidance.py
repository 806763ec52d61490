"""Predicted conflicts lead to a manoeuvre that both certificates accept."""

import math

import numpy as np

from drake_starnav.control import ControllerInputs, ControllerParameters
from drake_starnav.moving.avoidance import Scene, avoid_collision, find_velocity_around, list_manoeuvres, thin_places
from drake_starnav.moving.certificate import STANDING_SPEED, MovingCertificate, make_certificates
from drake_starnav.moving.kalman_tracks import Tracks
from drake_starnav.moving.parameters import DynamicObstacleParameters
from drake_starnav.moving.prediction import add_radius, predict_trajectories
from drake_starnav.moving.tracker import TrackedObstacles
from drake_starnav.planning.guidance import Guidance
from drake_starnav.robot import RobotParameters
from drake_starnav.robot.motion import roll_out
from drake_starnav.safety.certificates import all_accept
from drake_starnav.surroundings.region_union import RegionUnion
from drake_starnav.surroundings.star_region import make_scan_region, unite_regions
from drake_starnav.surroundings.surroundings import Surroundings
from tests.helpers.motions import actuation
from tests.helpers.scans import MARGINS, cast, observe_scan
from tests.helpers.scenes import hall

ROBOT, CONTROLLER = RobotParameters(), ControllerParameters()
OBSTACLES = DynamicObstacleParameters(max_speed=0.8, caution=1.0)
PATH = np.array([(3.0, 0.0)])
RADIUS = 0.3
COMMANDS = actuation(ROBOT)


def obstacle(position: tuple[float, float], velocity: tuple[float, float]) -> Tracks:
    """A settled track whose whole rim is seen."""
    place, moving = np.array([position]), np.array([velocity])
    angle = np.linspace(0.0, 2.0 * math.pi, 40, endpoint=False)
    return Tracks(
        time=0.0,
        position=place,
        velocity=moving,
        radius=np.array([RADIUS]),
        scan_count=np.array([30]),
        last_seen=np.zeros(1),
        moving_share=np.ones(1),
        recent_top_speed=np.hypot(*moving.T),
        first_seen=np.zeros(1),
        mean_velocity=moving,
        aspect_rate=np.zeros(1),
        hits=add_radius(place + RADIUS * np.column_stack((np.cos(angle), np.sin(angle))), 0.0),
        hit_track=np.zeros(40, np.int64),
        predicted_trajectories=predict_trajectories(place, moving, np.array([RADIUS]), np.zeros((0, 2))),
    )


def known() -> tuple[RegionUnion, Surroundings]:
    """What the robot knows of an empty hall."""
    scan, pose = cast(hall()), np.zeros(3)
    regions = unite_regions((make_scan_region(scan, pose, ROBOT.radius, MARGINS),))
    return regions, observe_scan(scan, pose, ROBOT.radius + 0.01, 1.2)


def avoided(
    tracks: Tracks, twist: tuple[float, float] = (0.5, 0.0), path: np.ndarray = PATH, star: Surroundings | None = None
) -> np.ndarray | None:
    regions, seen = known()
    inputs = ControllerInputs(np.zeros(3), np.array(twist), Guidance(path, True, regions), star or seen)
    tracked = TrackedObstacles(tracks, 0.0, OBSTACLES)
    asked = make_certificates(inputs.surroundings, MARGINS.safety, COMMANDS, np.zeros(2), tracked)
    return avoid_collision(inputs, tracked, asked, COMMANDS, ROBOT)


def test_what_comes_near_nobody_is_no_avoidance() -> None:
    for tracks in (Tracks(), obstacle((1.5, 1.5), (0.0, 0.5)), obstacle((-2.0, -2.0), (-0.3, 0.0))):
        assert avoided(tracks) is None


def test_one_that_comes_head_on_is_foreseen_and_evaded() -> None:
    tracks = obstacle((2.2, 0.0), (-0.6, 0.0))
    found = avoided(tracks)
    assert found is not None
    near_by = MovingCertificate.near(TrackedObstacles(tracks, 0.0, OBSTACLES), np.zeros(2), COMMANDS)
    assert all_accept(roll_out(np.zeros(3), np.array((0.5, 0.0)), found, COMMANDS), (near_by,))


def test_a_robot_that_stands_in_the_way_moves_before_it_is_too_late() -> None:
    for y in (1.4, 1.2, 1.0, 0.8):
        found = avoided(obstacle((0.0, y), (0.0, -0.5)), twist=(0.0, 0.0), path=np.zeros((0, 2)))
        assert found is not None and np.abs(found).max() > STANDING_SPEED


def test_without_a_certified_manoeuvre_there_is_none() -> None:
    assert avoided(obstacle((0.8, 0.0), (-0.6, 0.0)), twist=(0.8, 0.0), star=Surroundings.unknown()) is None


def test_the_way_round_is_one_of_the_manoeuvres_if_it_is_wanted() -> None:
    """Round one who comes from ahead on the left, it leads to the right."""
    tracks, limits, still = obstacle((1.5, 0.3), (-0.6, 0.0)), ROBOT.limits, np.zeros(2)
    obstacles = TrackedObstacles(tracks, 0.0, OBSTACLES)
    regions, star = known()
    among = Scene.of(ControllerInputs(np.zeros(3), still, Guidance(PATH, True, regions), star), obstacles, ROBOT)
    aside = find_velocity_around(np.zeros(3), PATH, among, ROBOT)
    assert aside is not None
    assert aside[1] < 0.0
    row = list_manoeuvres(still, limits, aside)[-1]
    assert row["heading"] == math.atan2(aside[1], aside[0])
    assert 0.0 < row["speed"] <= ROBOT.max_speed
    assert find_velocity_around(np.zeros(3), np.zeros((0, 2)), among, ROBOT) is None
    assert len(list_manoeuvres(still, limits)) == len(list_manoeuvres(still, limits, aside)) - 1


def standing(x: float, y: float, radius: float = 0.2) -> Tracks:
    """A column that might start."""
    angle = np.linspace(0.0, 2.0 * math.pi, 60, endpoint=False)
    return Tracks(
        time=0.0,
        possible_starters=add_radius(np.array((x, y)) + radius * np.column_stack((np.cos(angle), np.sin(angle))), 0.0),
    )


def test_where_the_path_leads_too_near_by_what_might_start_another_way_is_found() -> None:
    assert avoided(standing(1.5, 1.6)) is None, "far from the path"
    found = avoided(standing(1.2, 0.55))  # 10 cm from where the robot would pass
    assert found is not None
    assert found[1] < 0.0, "away from it"


def test_what_stands_is_foreseen_as_few_places() -> None:
    places = standing(1.0, 0.0).possible_starters[:, :2]
    kept = thin_places(places, np.zeros(2), 1.1, 0.1)
    assert 3 < len(kept) < 20
    apart = np.hypot(*(kept[:, None] - kept).transpose(2, 0, 1)) + np.eye(len(kept))
    assert apart.min() >= 0.1
    near = places[np.hypot(*places.T) < 1.1]
    assert np.hypot(*(near[:, None] - kept).transpose(2, 0, 1)).min(axis=1).max() < 0.1
