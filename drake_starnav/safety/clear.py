"""The certificate against what stands still: the robot touches nothing, and stays in space that was seen free.

Guarantee. If a command is accepted, and the robot keeps its last twist for a declared delay, follows the command for
one control period and then brakes as hard as its limits allow in both speed and turning rate, then at no point of that
motion its footprint touches a static obstacle, provided that
 (1) the world is static, and nothing stands within the disc in which the robot begins,
 (2) the sensing and localisation error, plus half the distance between two samples of the motion (at most half of
     the footprint's `sampling`), is at most the safety margin,
 (3) the robot keeps the simulated accelerations, and starts from the twist that was last commanded,
 (4) a command takes effect after the declared delay, which is at most one control period.
To keep (3), a motion in which the wheels would slide is not accepted; see `Motion.grips`.

At each sample the footprint keeps the margin to every surface that the last scans have hit. All of it, with the margin
around it, was seen by the last scan or by some look before, or the robot stood there: an obstacle in it would have been
hit by that look. What is neither is unknown. Where there is less room at the first sample, that much is enough: to each
surface, and to each place that is unknown. That the discs that cover the footprint stay inside the certified region is
enough, too, and decided faster.

If nothing can be certified, the command is to brake: the robot then follows the remainder of the last certified motion,
so by induction it never touches anything. Turning in place is always allowed to a disc at a speed from which it stops
within STOPPED_DISTANCE, since it covers no new ground.
"""

import math
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.geometry.footprint import Footprint
from drake_starnav.robot.motion import Motion
from drake_starnav.surroundings.region_union import covers
from drake_starnav.surroundings.safe_region import CertifiedRegion
from drake_starnav.surroundings.separation import keeps_clear

STOPPED_DISTANCE = 0.001
"""A robot that stops within this distance counts as standing, m: numerics."""


class Clear(NamedTuple):
    """Accepts motions on which the robot keeps a margin to all surfaces, within what was seen.

    Attributes:
        star: what the last scans certify, with what they and earlier ones saw.
        margin: m.
        footprint: of the robot.
    """

    star: CertifiedRegion
    margin: float
    footprint: Footprint

    @property
    def inside(self) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
        """Center, bearing and values of a star: that discs which cover the footprint stay inside it is enough."""
        return self.star.enough if self.footprint.is_disc or self.star.sees_around else None

    def accepts(self, motion: Motion) -> bool:
        """Whether the motion keeps clear of all surfaces and of what was not seen; without a scan none does."""
        inside, look = self.inside, self.star.look
        if inside is not None and covered(inside, motion.samples, self.footprint.cover):
            return True
        sizes = self.margin, float(look.reach - self.footprint.radius)
        return bool(keeps_clear(motion.samples, look.chords, self.star.looks, self.footprint.body, sizes))


@kernel
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
            if not covers(center, bearing_0, values, np.int64(0), px, py, 0.0):
                return False
    return True
