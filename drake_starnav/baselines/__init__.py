"""Controllers to compare with: each is one pure function of the robot's state and its surroundings."""

import drake_starnav.utils.compilation  # noqa: F401  (shows what is compiled)
from drake_starnav.baselines.baseline_step import Baseline, Situation, baseline_step
from drake_starnav.baselines.dsm_circles import DsmParameters, dsm_velocity
from drake_starnav.baselines.dwa import DwaParameters, dwa_twist
from drake_starnav.baselines.foa import FoaParameters, foa_cluster_velocity, foa_velocity
from drake_starnav.baselines.known_obstacles import KnownObstacles, known_obstacles
from drake_starnav.baselines.potential_field import PotentialFieldParameters, potential_field_velocity

__all__ = [
    "Baseline",
    "DsmParameters",
    "DwaParameters",
    "FoaParameters",
    "KnownObstacles",
    "PotentialFieldParameters",
    "Situation",
    "baseline_step",
    "dsm_velocity",
    "dwa_twist",
    "foa_cluster_velocity",
    "foa_velocity",
    "known_obstacles",
    "potential_field_velocity",
]
