"""The braking certificate of a polygon: it keeps a margin to every surface that was hit, and to all that it hides.

Let P be a union of convex polygons, and let each chord between two neighbouring hits of the last scan hide all points
behind it, on the rays from the lidar. If at every sample of a motion each part of P is at least the margin away from
every chord with what it hides, the robot touches nothing that the scan has hit, and stays in space that it has seen:
P begins in seen space, and cannot enter the hidden one without crossing its boundary. Between two samples no point of P
moves farther than SAMPLE_SPACING, half of which the margin allows for.

Chords of earlier scans hide nothing; with them the nearest hit of several scans counts, as for the certified region.
Where the last scan did not look, the robot's axis stays where it looked or an earlier scan did, and the hits that were
seen there before count: that whatever gets beside or behind the axis of a robot with a limited view was in its view
before is an assumption, see SAFETY.md.
"""

from typing import NamedTuple

from drake_starnav.control.motion import Motion
from drake_starnav.geometry.footprint import Footprint
from drake_starnav.regions.safe_region import CertifiedRegion
from drake_starnav.regions.separation import keeps_clear


class FootprintCertificate(NamedTuple):
    """Accepts motions on which the footprint keeps a margin to what was hit and to what that hides.

    A robot that is nearer to a surface than the margin must not come nearer to it than it is now.

    Attributes:
        star: what the last scans certify, with their hits.
        margin: m.
        footprint: of the robot, made of polygons.
    """

    star: CertifiedRegion
    margin: float
    footprint: Footprint

    def accepts(self, motion: Motion) -> bool:
        """Whether the motion keeps clear of all surfaces and of what was not looked at; without a scan none does."""
        if not (self.star.seen and self.star.looked_at(motion.position)):
            return False
        room = float(self.star.reach - self.footprint.radius)
        return bool(
            keeps_clear(
                motion.pose,
                self.star.chords,
                self.footprint.polygons,
                (self.margin, self.footprint.radius, room),
            )
        )
