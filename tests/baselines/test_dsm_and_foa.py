"""DSM and FOA as functions of circles and of hits."""

import numpy as np
import pytest

from drake_starnav.baselines import dsm_circles, foa
from tests.helpers.arrays import taking_lists
from tests.helpers.reference_vectors import COUNT, RESULTS, TOLERANCE, reference_case

dsm_velocity = taking_lists(dsm_circles.compute_dsm_velocity)
foa_velocity = taking_lists(foa.compute_foa_velocity)
foa_cluster_velocity = taking_lists(foa.compute_foa_cluster_velocity)
BOTH = pytest.mark.parametrize("function", [foa_velocity, foa_cluster_velocity])
RADIUS = 0.2


def test_exactly_head_on_the_sampled_form_heads_on():
    found = foa_velocity([0.0, 0.0], [1.0, 0.0], [[0.6, 0.4], [0.6, -0.4]], control_radius=RADIUS)
    np.testing.assert_allclose(found, [1.0, 0.0], atol=1e-12)


@pytest.mark.parametrize("speed", [1.2, 1.3, 3.0])
def test_clustered_form_is_finite_at_any_speed(speed):
    points = np.column_stack((np.full(20, 0.5), np.linspace(-0.3, 0.2, 20)))
    found = foa_cluster_velocity([0.0, 0.0], [speed, 0.0], points, control_radius=RADIUS)
    assert np.isfinite(found).all()
    if speed > 1.3:  # approach speeds beyond 1.25 m/s stop the robot instead of returning NaN
        np.testing.assert_array_equal(found, [0.0, 0.0])


@BOTH
@pytest.mark.parametrize(
    "points",
    [
        [[0.0, 0.0]],
        [[0.0, 0.0], [0.0, 0.0], [0.0, 0.0], [0.5, 0.0]],
        [[0.05, 0.0], [0.0, 0.05], [-0.05, 0.0], [0.0, -0.05]],  # inside the robot, on all sides
        [[0.3, 0.0], [-0.3, 0.0]],  # directions cancel
        [[0.5, 0.0], [2.0, 2.0], [-3.0, 1.0]],  # no cluster at all
    ],
)
@pytest.mark.parametrize("velocity", [(0.0, 0.0), (1.0, 0.0), (-0.3, 0.2)])
def test_finite_in_the_singular_places(function, points, velocity):
    assert np.isfinite(function([0.0, 0.0], velocity, points, control_radius=RADIUS)).all()


def test_hits_in_no_cluster_are_avoided():
    found = foa_cluster_velocity([0.0, 0.0], [1.0, 0.0], [[0.4, -0.05]], control_radius=RADIUS)
    assert found[1] > 0.0


@pytest.mark.parametrize("position", [(0.0, 0.0), (0.1, 0.0), (0.5, 0.0)])
@pytest.mark.parametrize("velocity", [(0.0, 0.0), (-1.0, 0.0), (1.0, 0.0)])
def test_dsm_is_finite_in_the_singular_places(position, velocity):
    circles = np.array([(0.0, 0.0, 0.3), (0.0, 0.0, 0.3), (1.0, 0.0, 0.3)])
    assert np.isfinite(dsm_velocity(position, velocity, circles, robot_radius=0.2)).all()


@pytest.mark.parametrize("k", range(COUNT))
def test_they_return_what_the_authors_implementations_return(k):
    c = reference_case(k)
    found = dsm_velocity(*c["start"], c["circles"], robot_radius=c["radius"])
    np.testing.assert_allclose(found, RESULTS["dsm_tail_off"][k], rtol=0.0, atol=TOLERANCE)
    found = foa_velocity(*c["start"], c["points"], control_radius=c["radius"])
    np.testing.assert_allclose(found, RESULTS["foa_sampled"][k], rtol=0.0, atol=TOLERANCE)
    found = foa_cluster_velocity(*c["start"], c["points"], control_radius=c["radius"])
    np.testing.assert_allclose(found, RESULTS["foa_cluster"][k], rtol=0.0, atol=TOLERANCE)
