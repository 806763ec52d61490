"""What ends a run: a robot that touches anything but the ground, or does not drive as it is told."""

import math
import re
from collections.abc import Collection
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from pydrake.common.value import Value
from pydrake.geometry import FrameId, GeometryId, QueryObject, SceneGraphInspector
from pydrake.systems.framework import Context, DiagramBuilder, DiscreteValues, EventStatus, LeafSystem

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.footprint import Footprint, disc, find_top_speed
from drake_starnav.geometry.trajectory import STANDING
from drake_starnav.station.planar_localization import read_planar_states
from drake_starnav.station.robot_geometry import RobotModel, compute_wheel_rates, find_drive_geometry
from drake_starnav.station.world_geometry import make_surface_world
from drake_starnav.systems.connecting import connect_inputs
from drake_starnav.utils.timing import check_period
from drake_starnav.worlds.clearance import compute_body_clearance, find_nearest_obstacle
from drake_starnav.worlds.shortest_path import compute_capsule_distance, make_capsules
from drake_starnav.worlds.world import World

if TYPE_CHECKING:
    from drake_starnav.station.navigation_station import StationInterface

COLLISION, STRUCK = "collision", "struck"
"""Names of a contact; `STRUCK` if a moving obstacle hits a robot no point of which moves."""


class Hull(NamedTuple):
    """Obstacles without contact in a robot's plant, by whose distance from its footprint it is checked, and the frame
    of its base."""

    frame: FrameId
    surfaces: World


class CollisionMonitor(LeafSystem):
    """Checks for contacts periodically, and ends the simulation at the first one that is not with the ground.

    ```
                       ┌──────────────────┐
    geometry_query ───>│                  │
                       │ CollisionMonitor │
    state ────────────>│                  │
                       └──────────────────┘
    ```

    Ports:
        geometry_query: abstract, `QueryObject` of the scene; what penetrates is in contact, a mesh as its convex hull.
        state: vector (x, y, yaw, v, omega) of the robot, m, rad and s; needed only if there are moving obstacles.

    The simulator stops with status "reached termination" and a message such as `collision of base_link with crate at
    3.200 s`: the name of the contact, and those of both bodies, see `body_name`. The contact is `STRUCK` if the robot
    touches only moving obstacles and no point of its footprint was faster than STANDING. A contact is missed only if it
    begins and ends within a period: in 0.025 s at 0.8 m/s, that of the hull with the thinnest post if they overlap by
    less than 0.2 mm.
    """

    def __init__(
        self,
        *,
        robot: Collection[GeometryId],
        ground: Collection[GeometryId],
        moving_obstacles: Collection[GeometryId] = (),
        hull: Hull | None = None,
        footprint: Footprint | None = None,
        near: tuple[World, float] | None = None,
        period: float = 0.025,
    ) -> None:
        """
        Args:
            robot: proximity geometries of the robot.
            ground: geometries that the robot may touch.
            moving_obstacles: of the moving obstacles.
            hull: obstacles that are in the plant as surfaces only; None without any.
            footprint: of the robot; None: a disc, and no `hull`.
            near: all that the robot may touch, if none of it moves, and how far the robot reaches from base_link's
                origin, m: contacts are then looked for only where something may be near. `state` is then where it is.
            period: of the checks, s. A robot that is struck is pushed, and no longer stands a few steps later:
                where obstacles move, the period is to be the step of the plant.
        """
        super().__init__()
        # their numbers: an identifier is hashed and compared by a call into Drake
        self._robot, self._ground, self._moving_obstacles = (
            {geometry.get_value() for geometry in group} for group in (robot, ground, moving_obstacles)
        )
        self._hull, self._own = hull, footprint or disc(0.0)
        self._bars = None if near is None else make_capsules(*near)
        self._clear = self.DeclareDiscreteState(3)  # a place, and how far from there it is free
        self._query = self.DeclareAbstractInputPort("geometry_query", Value(QueryObject()))
        self._state = self.DeclareVectorInputPort("state", 5)
        # an update, for publish events see old geometry, see make_simulator
        self.DeclarePeriodicDiscreteUpdateEvent(check_period(self, period=period), 0.0, self._check)

    @staticmethod
    def AddToBuilder(builder: DiagramBuilder, station: "StationInterface") -> "CollisionMonitor":
        """Add a monitor named `collision_monitor` of a robot in the builder, and connect it.

        It looks with each command; where obstacles move, at every step of the plant. `station` is as from
        `add_station`, a `NavigationStation`, or a `RobotInterface` in a plant of your own.
        """
        moving, world, robot = station.moving_obstacle_geometries, station.world, station.robot_interface
        surfaces = None if world is None else make_surface_world(world)
        near_world = None
        if world is not None and surfaces is None and world.model is None and station.scenario.localization.exact:
            near_world = None if moving else (world, robot.reach)
        monitor = CollisionMonitor(
            robot=station.robot_geometries,
            ground=station.floor,
            moving_obstacles=moving,
            hull=None if surfaces is None else Hull(robot.base_frame, surfaces),
            footprint=robot.robot.shape,
            near=near_world,
            period=station.scenario.simulation.time_step if moving else 1.0 / station.scenario.controller.rate,
        )
        builder.AddNamedSystem("collision_monitor", monitor)
        sources = {"geometry_query": station.geometry_query, "state": station.GetOutputPort("localization.state")}
        connect_inputs(builder, monitor, sources, "collision_monitor")
        return monitor

    def contacts(self, context: Context) -> list[tuple[GeometryId, GeometryId]]:
        """Pairs of geometries, the robot's first, that touch and should not."""
        found_contacts = []
        for pair in self._query.Eval(context).ComputePointPairPenetration():
            id_b = pair.id_B.get_value()
            if id_b in self._ground:  # the usual contact: wheels on the floor
                continue
            id_a = pair.id_A.get_value()
            if id_a not in self._ground and (id_a in self._robot) != (id_b in self._robot):
                found_contacts.append((pair.id_A, pair.id_B) if id_a in self._robot else (pair.id_B, pair.id_A))
        return found_contacts

    def describe_contacts(self, context: Context) -> str:
        """As the simulator's, of what the robot touches now; empty without a contact."""
        found_contacts = self.contacts(context)
        if not found_contacts:
            return ""
        struck = all(b.get_value() in self._moving_obstacles for _, b in found_contacts) and self._is_standing(context)
        inspector = self._query.Eval(context).inspector()
        a, b = (name_body(inspector, geometry) for geometry in found_contacts[0])
        contact_text = describe_contact(STRUCK if struck else COLLISION, f"{a.rpartition('::')[2]} with {b}")
        return f"{contact_text} at {context.get_time():.3f} s"

    def _is_standing(self, context: Context) -> bool:
        """Whether no point of the footprint moves."""
        _, _, _, speed, turning = self._state.Eval(context).tolist()
        return bool(find_top_speed(speed, turning, self._own.lever) <= STANDING)

    def _check(self, context: Context, values: DiscreteValues) -> EventStatus:
        if self._bars is not None:
            x, y, *_ = self._state.Eval(context).tolist()
            at_x, at_y, free_distance = context.get_discrete_state(self._clear).value().tolist()
            if math.hypot(x - at_x, y - at_y) < free_distance:
                return EventStatus.DidNothing()
            free_distance = compute_capsule_distance(self._bars, x, y)
            if free_distance > 0.0:
                values.set_value(self._clear, (x, y, free_distance))
                return EventStatus.Succeeded()
        contact_text = self.describe_contacts(context)
        return EventStatus.ReachedTermination(self, contact_text) if contact_text else self._check_surfaces(context)

    def _check_surfaces(self, context: Context) -> EventStatus:
        if self._hull is None:
            return EventStatus.DidNothing()
        X_WB, surfaces = self._query.Eval(context).GetPoseInWorld(self._hull.frame), self._hull.surfaces
        footprint = self._own
        (x, y, _), (forward_x, forward_y, _) = X_WB.translation(), X_WB.rotation().col(0)
        name, distance = find_nearest_obstacle(surfaces, (x, y))
        pose = np.array([(x, y, math.atan2(forward_y, forward_x))])
        if distance >= footprint.radius or compute_body_clearance(surfaces, pose, footprint)[0] >= 0.0:
            return EventStatus.DidNothing()
        contact_text = f"{describe_contact(COLLISION, f'base_link with {name}')} at {context.get_time():.3f} s"
        return EventStatus.ReachedTermination(self, contact_text)


def name_body(inspector: SceneGraphInspector, geometry: GeometryId) -> str:
    """The body of a geometry as a person calls it: `rack::shelf`, but `crate` for the body crate of a model crate.

    A geometry of the world body goes by its own name.
    """
    frame = inspector.GetFrameId(geometry)
    if frame == inspector.world_frame_id():
        return inspector.GetName(geometry).rpartition("::")[2]
    scope, _, body = inspector.GetName(frame).rpartition("::")
    return scope if scope.rpartition("::")[2] == body else f"{scope}::{body}".removeprefix("::")


def describe_contact(name: str, bodies: str) -> str:
    """A contact in words, from its name and its bodies `a with b`: `collision of a with b` or `struck on a by b`."""
    return f"{name} on {bodies.replace(' with ', ' by ', 1)}" if name == STRUCK else f"{name} of {bodies}"


def find_contact(message: str) -> str | None:
    """The bodies of a message of `CollisionMonitor`, `base_link with crate`; None of any other message."""
    match = re.match(rf"(?:{COLLISION} of|{STRUCK} on) (.+) (?:with|by) (.+) at ", message)
    return f"{match[1]} with {match[2]}" if match else None


SPAN = 2.0
"""Motion is compared with its command over two spans of this length, one after the other, s."""
EVERY = 10
"""Every tenth moment is looked at, 0.1 to 0.2 s apart: means over a span need no more."""
LEAST_JUDGED = np.array((0.005, 0.01))
"""Slower commands are not judged, m/s and rad/s."""


def check_drive(station: "StationInterface", times: np.ndarray, states: np.ndarray, commands: np.ndarray) -> None:
    """Raise a `StarnavError` with the likely cause if the robot has not driven as it was told lately.

    Nothing is known before two spans have passed. Commands start from the speed that the robot has, so it is not
    reported for slowness, only for standing still.

    Times are of shape (n,), s; states (n, m) of the robot's model; commands twists, shape (n, k).
    """
    plant, model, base = station.plant, station.robot_model, station.robot_interface.robot.drive
    if times[-1] - times[0] < 2.0 * SPAN or base.holonomic:  # an ideal one does
        return
    first_index = np.searchsorted(times, times[-1] - 2.0 * SPAN - 1e-9, side="right")
    times, states, commands = (each[first_index::EVERY] for each in (times, states, commands))
    rates = np.array((*base.body_rates(commands.T), *read_planar_states(states, plant.num_positions(model))[:, 3:].T))
    is_later = times > times[-1] - SPAN - 1e-9
    span_means = np.array([rates[:, span].mean(axis=1) for span in (~is_later, is_later)])
    told_velocity, done_velocity = span_means[:, :2], span_means[:, 2:]
    is_judged = np.abs(told_velocity) > LEAST_JUDGED
    # a robot that neither drives nor turns by this much of what it was told, in both spans, does not follow
    least_share = 0.3 * (1.0 - station.scenario.drive.slip)
    follows = is_judged & (done_velocity * np.sign(told_velocity) >= least_share * np.abs(told_velocity))
    if follows.any() or not is_judged.any(axis=1).all():
        return
    (v, omega), (real_v, real_omega) = told_velocity.mean(axis=0), done_velocity.mean(axis=0)
    raise StarnavError(
        f"the robot does not follow its commands: over {2 * SPAN:g} s it was told to drive at {v:.3f} m/s and "
        f"{omega:.3f} rad/s and did so at {real_v:.3f} m/s and {real_omega:.3f} rad/s; "
        f"{_guess_cause(RobotModel(plant, station.scene_graph, model), states, rates[:2])}"
    )


def _guess_cause(robot: RobotModel, states: np.ndarray, commands: np.ndarray) -> str:
    """Why a robot in states (n, m) does not follow what it was told, (2, n), m/s and rad/s, and what is allowed."""
    asked_rate = np.abs(find_drive_geometry(robot).rates(*commands)).mean()
    rolled_rate = np.abs(states @ compute_wheel_rates(robot).T).mean()
    if rolled_rate > 0.5 * asked_rate:
        return (
            "its wheels turn, but do not move it; allowed: wheels that stand on the floor with their weight and grip it"
        )
    return (
        "its wheels do not turn; allowed: motors strong enough (limit effort of the joints), and nothing but "
        "wheels and casters on the floor"
    )
