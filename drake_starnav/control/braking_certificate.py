"""The braking certificate: a twist is sent only if the robot can still stop within observed free space.

Guarantee. If a command is accepted, and the robot keeps its last twist for a declared delay, follows the command for
one control period and then brakes as hard as its limits allow in both speed and turning rate, then no point of that
motion brings a static obstacle that the scans have hit nearer to the robot's centre than its radius, provided that
 (1) the world is static,
 (2) the sensing and localisation error, plus half the distance between two samples of the motion (at most
     SAMPLE_SPACING / 2), is at most the safety margin,
 (3) the robot keeps the simulated accelerations, and starts from the twist that was last commanded,
 (4) a command takes effect after the declared delay, which is at most one control period.
To keep (3), a motion in which the wheels would slide is not accepted; see `Motion.grips`.
If nothing can be certified, the command is to brake: the robot then follows the remainder of the last certified motion,
so by induction it never touches anything. Turning in place is always allowed at a speed from which the robot stops
within STOPPED_DISTANCE, since a disc that turns about its centre covers no new ground.
"""

import math
from typing import NamedTuple

from numba import njit

from drake_starnav.control.motion import Motion
from drake_starnav.regions.region_union import covers
from drake_starnav.regions.safe_region import CertifiedRegion

STOPPED_DISTANCE = 0.001
"""A robot that stops within this distance counts as standing, m."""


class StarCertificate(NamedTuple):
    """Accepts motions on which the centres of all discs that cover the footprint stay inside the certified region.

    Attributes:
        star: what the last scans certify.
    """

    star: CertifiedRegion

    def accepts(self, motion: Motion) -> bool:
        """Whether the star contains every sample after the first."""
        return covered(self.star.alone[:3], motion.samples, motion.footprint.cover)


@njit(cache=True)
def covered(star, samples, places):
    """Whether a region contains places (m, 2) of a robot at all samples of a `Motion` but the first.

    `star` is what comes first in a union of one region: center, bearing_0, values.
    """
    center, bearing_0, values = star
    for k in range(1, len(samples)):
        x, y, cosine, sine = samples[k, 0], samples[k, 1], math.cos(samples[k, 2]), math.sin(samples[k, 2])
        for j in range(len(places)):
            px, py = places[j]
            px, py = x + cosine * px - sine * py, y + sine * px + cosine * py
            if not covers(center, bearing_0, values, 0, px, py, 0.0):
                return False
    return True
