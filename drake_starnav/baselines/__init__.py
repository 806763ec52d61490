"""Controllers to compare with: each one pure function of where the robot is and of what is around it."""

from drake_starnav.baselines.dsm_circles import dsm_velocity
from drake_starnav.baselines.dwa import DwaParameters, dwa_twist
from drake_starnav.baselines.foa import foa_cluster_velocity, foa_velocity
from drake_starnav.baselines.potential_field import PotentialFieldParameters, potential_field_velocity

__all__ = [
    "DwaParameters",
    "PotentialFieldParameters",
    "dsm_velocity",
    "dwa_twist",
    "foa_cluster_velocity",
    "foa_velocity",
    "potential_field_velocity",
]
