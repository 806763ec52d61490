"""A disc at constant velocity is tracked to its place, speed and size."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_starnav.moving.kalman_tracks import Tracks
from drake_starnav.moving.parameters import DynamicObstacleParameters
from drake_starnav.moving.tracker import TrackerState, track
from tests.helpers.scans import seeds
from tests.helpers.scenes import PERIOD, Scene, hall, moved, straight

OBSTACLES = DynamicObstacleParameters(max_speed=1.0)


def tracked(
    scene: Scene, duration: float, *, twist: tuple[float, float] = (0.0, 0.0), seed: int | None = 0, start: float = 0.0
) -> tuple[TrackerState, float]:
    """What is known after watching a scene for a time, by a robot with a constant twist, and the time then."""
    rng = None if seed is None else np.random.default_rng(seed)
    known, pose = TrackerState(), np.zeros(3)
    for k in range(round(duration / PERIOD) + 1):
        time = start + k * PERIOD
        known = track(known, scene.scan(time, pose, rng), pose, OBSTACLES)
        pose = moved(pose, np.array(twist), PERIOD)
    return known, time


def only_one(tracks: Tracks, place: np.ndarray) -> int:
    """The counted track at a place, and there is no other counted track."""
    (confirmed,) = np.flatnonzero(tracks.is_confirmed)
    assert math.dist(tracks.position[confirmed], place) < 0.1
    return int(confirmed)


@settings(max_examples=12, deadline=None)
@given(
    seed=seeds,
    speed=st.floats(0.3, 1.0),
    heading=st.floats(-math.pi, math.pi),
    radius=st.floats(0.15, 0.5),
    turning=st.floats(-1.0, 1.0),
)
def test_a_steady_disc_is_tracked(seed: int, speed: float, heading: float, radius: float, turning: float) -> None:
    velocity = speed * np.array((math.cos(heading), math.sin(heading)))
    middle = 1.7 * np.array((-math.sin(heading), math.cos(heading)))  # it passes by, 1.7 m away
    scene = Scene(hall(half=4.5), (radius,), straight(tuple(middle - 0.8 * velocity), tuple(velocity)))
    known, time = tracked(scene, 1.5, twist=(0.1, turning), seed=seed)
    k = only_one(known.tracks, scene.at(time)[0])
    assert math.dist(known.tracks.velocity[k], velocity) < 0.12
    assert abs(known.tracks.radius[k] - radius) < 0.07
    assert abs(known.tracks.recent_top_speed[k] - speed) < 0.12
    assert known.tracks.is_settled[k]


@settings(max_examples=10, deadline=None)
@given(seed=seeds)
def test_columns_are_not_tracked_as_moving_obstacles(seed: int) -> None:
    rng = np.random.default_rng(seed)
    columns = [(*(rng.uniform(1.2, 3.0) * np.array((math.cos(a), math.sin(a)))), 0.2) for a in (0.3, 1.7, 3.9, 5.0)]
    scene = Scene(hall(*columns), (), lambda t: np.zeros((0, 2)))
    known, _ = tracked(scene, 3.0, twist=(0.15, 0.4), seed=seed)
    assert not known.tracks.is_confirmed.any() and not known.tracks.is_predicted.any()  # nor do they creep


def test_a_half_hidden_disc_does_not_seem_to_slow_down() -> None:
    scene = Scene(hall((1.2, 0.0, 0.3)), (0.3,), straight((2.6, -1.6), (0.0, 0.5)))
    for duration in np.arange(1.0, 2.01, 0.1):  # it disappears behind the column
        known, _ = tracked(scene, float(duration))
        assert np.abs(known.tracks.velocity[known.tracks.is_confirmed] - (0.0, 0.5)).max() < 0.15


def test_a_disc_that_comes_into_range_is_not_taken_to_be_small_and_fast() -> None:
    """At first only the tip of its rim is within range; as more of it is, it seems to grow."""
    scene = Scene(hall(half=8.0), (0.5,), straight((5.7, 0.0), (-1.0, 0.0)))
    for duration in np.arange(0.5, 1.2, 0.1):
        known, time = tracked(scene, float(duration))
        for k in np.flatnonzero(known.tracks.is_settled & (known.tracks.moving_share > 0.3)):
            assert abs(known.tracks.radius[k] - 0.5) < 0.12
            assert math.dist(known.tracks.velocity[k], (-1.0, 0.0)) < 0.35
            assert math.dist(known.tracks.position[k], scene.at(time)[0]) < 0.15


def test_a_disc_that_was_hidden_for_a_moment_keeps_its_track() -> None:
    """It turned while it was behind the column, so that it is not quite where it was predicted."""

    def at(t: float) -> np.ndarray:
        return np.array(((2.4 + 0.8 * min(max(t - 1.0, 0.0), 0.6), 0.9 * t - 1.2),))

    scene = Scene(hall((1.2, 0.0, 0.22)), (0.2,), at)
    known, time = tracked(scene, 1.9)
    nearest = np.argmin(np.hypot(*(known.tracks.position - at(time)[0]).T))
    assert known.tracks.scan_count[nearest] > 20
    assert known.tracks.last_seen[nearest] == time


def test_a_disc_that_goes_round_is_followed() -> None:
    rate = 0.6

    def circle(t: float) -> np.ndarray:
        return np.array(((1.5 * math.cos(rate * t), 1.5 * math.sin(rate * t)),))

    known, time = tracked(Scene(hall(), (0.25,), circle), 2.5)
    k = only_one(known.tracks, circle(time)[0])
    moves = rate * np.array((-circle(time)[0, 1], circle(time)[0, 0]))
    np.testing.assert_allclose(known.tracks.position[k], circle(time)[0], atol=0.05)
    np.testing.assert_allclose(known.tracks.velocity[k], moves, atol=0.2)


def test_a_disc_that_turns_back_is_not_taken_to_be_slow() -> None:
    def back(t: float) -> np.ndarray:
        return np.array(((2.0, 0.6 * abs(t - 1.5) - 0.9),))

    for time in np.arange(1.5, 2.0, PERIOD):
        known, _ = tracked(Scene(hall(), (0.25,), back), float(time))
        assert known.tracks.recent_top_speed[only_one(known.tracks, back(time)[0])] > 0.45


def test_no_track_is_faster_than_declared_even_if_it_has_taken_one_disc_for_another() -> None:
    scene = Scene(hall(), (0.25,), lambda t: np.array(((1.8, 0.0 if t < 1.0 else 0.24),)))
    for time in np.arange(0.8, 1.5, PERIOD):
        known, _ = tracked(scene, float(time))
        assert np.hypot(*known.tracks.velocity.T).max() <= OBSTACLES.max_speed + 1e-9


def test_a_disc_out_of_sight_is_forgotten_and_one_that_is_gone_sooner() -> None:
    gone = Scene(hall(), (0.25,), lambda t: np.array(((1.5, 0.5 * t - 0.5 if t < 1.0 else 100.0),)))
    assert tracked(gone, 0.95)[0].tracks.is_confirmed.sum() == 1
    assert tracked(gone, 1.3)[0].tracks.is_confirmed.sum() == 0
    behind = Scene(hall((1.0, 0.5, 0.4)), (0.2,), lambda t: np.array(((2.6, min(0.9 * t - 0.9, 1.0)),)))
    assert tracked(behind, 1.8)[0].tracks.is_confirmed.sum() == 1  # out of sight
    assert tracked(behind, 4.0)[0].tracks.is_confirmed.sum() == 0


@pytest.mark.slow
@settings(max_examples=12, deadline=None)
@given(
    seed=seeds,
    speed=st.floats(0.03, 0.2),
    heading=st.floats(-math.pi, math.pi),
    radius=st.floats(0.15, 0.5),
    towards=st.sampled_from([0.0, 0.5]),
)
def test_what_creeps_is_foreseen_before_the_robot_is_there(seed, speed, heading, radius, towards) -> None:
    """Also where single hits cannot be told from those of what stands, for a robot that drives up to it."""
    velocity = speed * np.array((math.cos(heading), math.sin(heading)))
    scene = Scene(hall(half=4.5), (radius,), straight((2.8, 0.0), tuple(velocity)))
    for duration in (2.5, 3.0, 3.5):
        known, time = tracked(scene, duration, twist=(towards, 0.0), seed=seed)
        (k,) = np.flatnonzero(known.tracks.is_predicted)
        assert math.dist(known.tracks.position[k], scene.at(time)[0]) < 0.1
        assert known.tracks.is_confirmed[k] or math.dist(known.tracks.expected_velocity[k], velocity) < 0.012
        points = known.scan.points_at(known.scan.distances, np.ones(360, bool), np.array((towards * time, 0.0, 0.0)))
        own = np.hypot(*(points - scene.at(time)[0]).T) < radius + 0.04
        assert known.tracks.is_confirmed[k] or not known.scan.mappable[own].any()  # it leaves no trace in the map


def test_what_came_and_stands_is_foreseen_no_longer() -> None:
    scene = Scene(hall(), (0.3,), lambda t: np.array(((1.5, max(1.0 - 0.5 * t, 0.0)),)))
    assert tracked(scene, 1.5)[0].tracks.is_predicted.sum() == 1
    assert tracked(scene, 12.0)[0].tracks.is_predicted.sum() == 0
