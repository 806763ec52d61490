import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_starnav.baselines import dsm_velocity
from drake_starnav.errors import StarnavError
from tests.helpers.reference_vectors import COUNT, RESULTS, TOLERANCE, reference_case

ANGLE = st.floats(-math.pi, math.pi)
SEED = st.integers(0, 2**32 - 1)


def rotation(angle):
    return np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])


def scene(seed):
    rng = np.random.default_rng(seed)
    circles = np.column_stack((rng.uniform(-3.0, 3.0, (6, 2)), rng.uniform(0.1, 0.5, 6)))
    return rng.uniform(-3.0, 3.0, 2), rng.normal(size=2), circles, rng.normal(size=(6, 2))


@pytest.mark.parametrize("tail_effect", [True, False])
def test_far_from_circles_the_nominal_velocity_returns(tail_effect):
    circles = np.array([(1e6, 0.0, 0.3), (0.0, -1e6, 0.3)])
    found = dsm_velocity([0.0, 0.0], [0.6, 0.3], circles, robot_radius=0.2, tail_effect=tail_effect)
    np.testing.assert_allclose(found, [0.6, 0.3], atol=1e-5)
    found = dsm_velocity([0.0, 0.0], [0.6, 0.3], np.zeros((0, 3)), robot_radius=0.2, tail_effect=tail_effect)
    np.testing.assert_array_equal(found, [0.6, 0.3])


@given(SEED, ANGLE, st.booleans())
def test_turns_with_the_scene(seed, angle, tail_effect):
    position, velocity, circles, velocities = scene(seed)
    turn = rotation(angle)
    turned = np.column_stack((circles[:, :2] @ turn.T, circles[:, 2]))
    found = dsm_velocity(
        position, velocity, circles, robot_radius=0.2, tail_effect=tail_effect, circle_velocities=velocities
    )
    found_turned = dsm_velocity(
        turn @ position,
        turn @ velocity,
        turned,
        robot_radius=0.2,
        tail_effect=tail_effect,
        circle_velocities=velocities @ turn.T,
    )
    np.testing.assert_allclose(found_turned, turn @ found, atol=1e-6)


@given(ANGLE, ANGLE, st.floats(0.0, 0.1), st.booleans())
def test_no_motion_into_a_circle_at_its_surface(where, heading, depth, tail_effect):
    # Just inside the inflated circle too: there the part into it vanishes as well.
    circles = np.array([(0.4, -0.2, 0.3), (3.0, 3.0, 0.5)])
    outward = np.array((math.cos(where), math.sin(where)))
    position = circles[0, :2] + (0.5 - 1e-12 - depth) * outward
    velocity = np.array((math.cos(heading), math.sin(heading)))
    found = dsm_velocity(position, velocity, circles, robot_radius=0.2, tail_effect=tail_effect)
    assert found @ outward >= -1e-9


def test_the_tail_effect_holds_back_only_what_leads_away():
    circle = np.array([(0.0, 0.0, 0.3)])
    keyword = {"robot_radius": 0.2}
    away = dsm_velocity([1.0, 0.0], [1.0, 0.5], circle, tail_effect=False, **keyword)
    held = dsm_velocity([1.0, 0.0], [1.0, 0.5], circle, tail_effect=True, **keyword)
    assert away[0] == pytest.approx(1.0) and held[0] == pytest.approx(1.0 / 3.0)  # 1 - 1/Gamma, Gamma = 1.5
    towards = [dsm_velocity([1.0, 0.0], [-1.0, 0.5], circle, tail_effect=effect, **keyword) for effect in (True, False)]
    np.testing.assert_array_equal(*towards)


def test_gives_way_to_a_circle_that_comes_nearer_and_ignores_one_that_leaves():
    circle = np.array([(0.0, 0.0, 0.3)])

    def x_velocity(circle_speed):
        return dsm_velocity(
            [0.5 + 1e-9, 0.0],
            [-0.2, 0.0],
            circle,
            robot_radius=0.2,
            tail_effect=True,
            circle_velocities=[[circle_speed, 0.0]],
        )[0]

    assert x_velocity(0.5) >= 0.5
    assert x_velocity(-0.5) == pytest.approx(x_velocity(0.0))


@pytest.mark.parametrize("position", [(0.0, 0.0), (0.1, 0.0), (0.5, 0.0)])
@pytest.mark.parametrize("velocity", [(0.0, 0.0), (-1.0, 0.0), (1.0, 0.0)])
def test_finite_in_the_singular_places(position, velocity):
    circles = np.array([(0.0, 0.0, 0.3), (0.0, 0.0, 0.3), (1.0, 0.0, 0.3)])
    for tail_effect in (True, False):
        found = dsm_velocity(position, velocity, circles, robot_radius=0.2, tail_effect=tail_effect)
        assert np.isfinite(found).all()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"position": [0.0, 0.0, 0.0]}, r"position has shape \(3,\); allowed: \(2,\)"),
        ({"position": "here"}, r"position is 'here'; allowed: numbers of shape \(2,\)"),
        ({"nominal_velocity": [math.nan, 0.0]}, r"nominal_velocity\[0\] is nan; allowed: finite"),
        ({"circles": np.zeros((4, 2))}, r"circles has shape \(4, 2\); allowed: \(n, 3\)"),
        ({"circles": [[0.0, 0.0, math.nan]]}, r"circles\[0, 2\] is nan; allowed: finite"),
        ({"circles": [[0.0, 0.0, -1.0]]}, r"circles\[0, 2\] \(radius\) is -1; allowed: at least 0"),
        ({"circle_velocities": np.zeros((2, 2))}, r"circle_velocities has shape \(2, 2\); allowed: \(1, 2\)"),
        ({"robot_radius": -0.1}, r"robot_radius is -0.1; allowed: a finite number, at least 0"),
    ],
)
def test_bad_input_names_the_argument(change, message):
    good = {
        "position": [0.0, 0.0],
        "nominal_velocity": [1.0, 0.0],
        "circles": [[2.0, 0.0, 0.3]],
        "robot_radius": 0.2,
        "tail_effect": True,
    }
    with pytest.raises(StarnavError, match="dsm_velocity: " + message):
        dsm_velocity(**(good | change))


@given(SEED, ANGLE, st.floats(0.0, 0.9), st.booleans())
def test_no_motion_into_a_circle_with_another_reference_point(seed, where, share, tail_effect):
    rng = np.random.default_rng(seed)
    circle = np.array([(*rng.uniform(-1.0, 1.0, 2), 0.3)])
    reference = circle[:, :2] + share * 0.5 * np.array([(math.cos(where), math.sin(where))])
    outward = np.array((math.cos(0.7), math.sin(0.7)))
    found = dsm_velocity(
        circle[0, :2] + (0.5 + 1e-12) * outward,
        rng.normal(size=2),
        circle,
        robot_radius=0.2,
        tail_effect=tail_effect,
        reference_points=reference,
    )
    assert found @ outward >= -1e-9


@given(SEED, st.booleans())
def test_the_centre_is_the_reference_point_by_default(seed, tail_effect):
    position, velocity, circles, _ = scene(seed)
    arguments = {"robot_radius": 0.2, "tail_effect": tail_effect}
    found = dsm_velocity(position, velocity, circles, reference_points=circles[:, :2], **arguments)
    np.testing.assert_array_equal(found, dsm_velocity(position, velocity, circles, **arguments))


@pytest.mark.parametrize("k", range(COUNT))
def test_it_returns_what_the_authors_implementation_returns(k):
    c = reference_case(k)
    for name, tail_effect, velocities in (
        ("dsm_tail_on", True, None),
        ("dsm_tail_off", False, None),
        ("dsm_moving", True, c["circle_velocities"]),
    ):
        found = dsm_velocity(
            *c["start"],
            c["circles"],
            robot_radius=c["radius"],
            tail_effect=tail_effect,
            circle_velocities=velocities,
        )
        np.testing.assert_allclose(found, RESULTS[name][k], rtol=0.0, atol=TOLERANCE, err_msg=name)
