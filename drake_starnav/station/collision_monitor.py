"""Ends a run when the robot touches anything but the ground."""

from collections.abc import Collection

from pydrake.common.value import Value
from pydrake.geometry import GeometryId
from pydrake.multibody.plant import ContactResults
from pydrake.systems.framework import Context, EventStatus, LeafSystem

from drake_starnav.geometry.trajectory_metrics import STANDING
from drake_starnav.utils.timing import checked_period

COLLISION, STRUCK = "collision", "struck"
"""Names of a contact; `STRUCK` if a moving obstacle hits a robot that is standing."""


class CollisionMonitor(LeafSystem):
    """Watches the plant's contacts and terminates the simulation at the first one that is not with the ground.

    ```
                        ┌──────────────────┐
    contact_results ───>│                  │
                        │ CollisionMonitor │
    state ─────────────>│                  │
                        └──────────────────┘
    ```

    Ports:
        contact_results: abstract, `ContactResults` of the plant; point contacts and hydroelastic ones count.
        state: vector (x, y, yaw, v, omega) of the robot, m, rad and s; needed only if there are moving obstacles.

    The simulator stops with status "reached termination" and a message that begins with the name of the contact and
    gives the identifiers of both geometries. The contact is `STRUCK` if the robot stood and touches only moving
    obstacles.
    """

    def __init__(
        self,
        *,
        robot: Collection[GeometryId],
        ground: Collection[GeometryId],
        moving_obstacles: Collection[GeometryId] = (),
        period: float,
        offset: float = 0.0,
    ) -> None:
        """
        Args:
            robot: proximity geometries of the robot.
            ground: geometries that the robot may touch.
            moving_obstacles: of the moving obstacles.
            period, offset: of the checks, s. Contact lasts while the wheels push, so that rare checks suffice; to
                determine whether the robot stood at the first contact, check at each step of the plant.
        """
        super().__init__()
        self._robot, self._ground, self._moving_obstacles = set(robot), set(ground), set(moving_obstacles)
        self._contact_results = self.DeclareAbstractInputPort("contact_results", Value(ContactResults()))
        self._state = self.DeclareVectorInputPort("state", 5)
        self.DeclarePeriodicPublishEvent(checked_period(self, period=period, offset=offset), offset, self._check)

    def contacts(self, context: Context) -> list[tuple[GeometryId, GeometryId]]:
        """Pairs of geometries, the robot's first, that touch and should not."""
        results = self._contact_results.Eval(context)
        points = (results.point_pair_contact_info(i).point_pair() for i in range(results.num_point_pair_contacts()))
        surfaces = (
            results.hydroelastic_contact_info(i).contact_surface() for i in range(results.num_hydroelastic_contacts())
        )
        found = []
        for a, b in [(pair.id_A, pair.id_B) for pair in points] + [(s.id_M(), s.id_N()) for s in surfaces]:
            if b in self._robot:
                a, b = b, a
            if a in self._robot and b not in self._robot and b not in self._ground:
                found.append((a, b))
        return found

    def _check(self, context: Context) -> EventStatus:
        found = self.contacts(context)
        if not found:
            return EventStatus.Succeeded()
        struck = all(b in self._moving_obstacles for _, b in found) and abs(self._state.Eval(context)[3]) <= STANDING
        a, b = found[0]
        message = f"{STRUCK if struck else COLLISION} of {a} with {b} at {context.get_time():.3f} s"
        return EventStatus.ReachedTermination(self, message)
