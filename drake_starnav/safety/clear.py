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
around it, is covered by the view of the last scan or by a past view, or the robot stood there: an obstacle in it would
have been hit in that view. What is neither is unknown. Where there is less room at the first sample, that much is
enough: to each surface, and to each place that is unknown. That the discs that cover the footprint stay inside the
certified star is enough, too, and decided faster.

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
from drake_starnav.surroundings.certified_star import StarArrays
from drake_starnav.surroundings.region_union import covers
from drake_starnav.surroundings.surroundings import Surroundings

STOPPED_DISTANCE = 0.001
"""A robot that stops within this distance counts as standing, m: numerics."""


class ClearanceCertificate(NamedTuple):
    """Accepts motions on which the robot keeps a margin to all surfaces, within what was seen.

    Attributes:
        surroundings: what is known of the space around the robot.
        margin: m.
        footprint: of the robot.
    """

    surroundings: Surroundings
    margin: float
    footprint: Footprint

    @property
    def sufficient_star(self) -> StarArrays | None:
        """The star of the fast test: a motion is accepted if the covering discs stay inside; None: there is none."""
        star = self.surroundings.certified_star
        return star.seen_part if self.footprint.is_disc or star.is_full_circle else None

    def accepts(self, motion: Motion) -> bool:
        """Return whether the motion keeps clear of all surfaces and of unknown space; before any scan none does."""
        star = self.sufficient_star
        if star is not None and star_covers(star, motion.samples, self.footprint.cover):
            return True
        return self.surroundings.keeps_clear(motion.samples, self.footprint, self.margin)


@kernel
def star_covers(star, samples, places):
    """Return whether `StarArrays` contain places (m, 2) on a robot at all samples of a `Motion` but the first."""
    center, bearing_0, values = star.center, star.bearing_0, star.values
    for k in range(1, len(samples)):
        x, y, cosine, sine = samples[k, 0], samples[k, 1], math.cos(samples[k, 2]), math.sin(samples[k, 2])
        for j in range(len(places)):
            px, py = places[j]
            px, py = x + cosine * px - sine * py, y + sine * px + cosine * py
            if not covers(center, bearing_0, values, np.int64(0), px, py, 0.0):
                return False
    return True
