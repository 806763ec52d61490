import numpy as np
import pytest

from drake_starnav.baselines import dsm_circles
from tests.helpers.arrays import taking_lists
from tests.helpers.reference_vectors import COUNT, RESULTS, TOLERANCE, reference_case

dsm_velocity = taking_lists(dsm_circles.compute_dsm_velocity)


@pytest.mark.parametrize("position", [(0.0, 0.0), (0.1, 0.0), (0.5, 0.0)])
@pytest.mark.parametrize("velocity", [(0.0, 0.0), (-1.0, 0.0), (1.0, 0.0)])
def test_finite_in_the_singular_places(position, velocity):
    circles = np.array([(0.0, 0.0, 0.3), (0.0, 0.0, 0.3), (1.0, 0.0, 0.3)])
    assert np.isfinite(dsm_velocity(position, velocity, circles, robot_radius=0.2)).all()


@pytest.mark.parametrize("k", range(COUNT))
def test_it_returns_what_the_authors_implementation_returns(k):
    c = reference_case(k)
    found = dsm_velocity(*c["start"], c["circles"], robot_radius=c["radius"])
    np.testing.assert_allclose(found, RESULTS["dsm_tail_off"][k], rtol=0.0, atol=TOLERANCE)
