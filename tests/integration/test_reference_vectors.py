"""DSM and FOA return what the authors' public implementations return, in 100 random cases."""

from pathlib import Path

import numpy as np
import pytest

from drake_starnav.baselines import dsm_velocity, foa_cluster_velocity, foa_velocity

CASES = np.load(Path(__file__).parents[1] / "data" / "reference_vectors_000_099.npz")
TOLERANCE = 1e-9


def case(k):
    circles = int(CASES["n_circles"][k])
    return {
        "start": (CASES["position"][k], CASES["v0"][k]),
        "circles": CASES["circles"][k, :circles],
        "circle_velocities": CASES["circle_velocities"][k, :circles],
        "points": CASES["points"][k, : int(CASES["n_points"][k])],
        "radius": float(CASES["robot_radius"][k]),
    }


@pytest.mark.parametrize("k", range(100))
def test_dsm(k):
    c = case(k)
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
        np.testing.assert_allclose(found, CASES[name][k], rtol=0.0, atol=TOLERANCE, err_msg=name)


@pytest.mark.parametrize("k", range(100))
def test_foa(k):
    c = case(k)
    found = foa_velocity(*c["start"], c["points"], control_radius=c["radius"])
    np.testing.assert_allclose(found, CASES["foa_sampled"][k], rtol=0.0, atol=TOLERANCE)
    found = foa_cluster_velocity(*c["start"], c["points"], control_radius=c["radius"])
    np.testing.assert_allclose(found, CASES["foa_cluster"][k], rtol=0.0, atol=TOLERANCE)
