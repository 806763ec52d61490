"""What the authors' public implementations of DSM and FOA return in 100 random cases."""

from pathlib import Path
from typing import Any

import numpy as np

RESULTS = np.load(Path(__file__).parents[1] / "data" / "reference_vectors_000_099.npz")
COUNT = 100
TOLERANCE = 1e-9


def reference_case(k: int) -> dict[str, Any]:
    """Position and velocity at the start, circles, hit points, and the robot's radius."""
    circles = int(RESULTS["n_circles"][k])
    return {
        "start": (RESULTS["position"][k], RESULTS["v0"][k]),
        "circles": RESULTS["circles"][k, :circles],
        "points": RESULTS["points"][k, : int(RESULTS["n_points"][k])],
        "radius": float(RESULTS["robot_radius"][k]),
    }
