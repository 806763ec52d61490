"""The plant that robots drive in, and the simulator that steps it."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any, TypeVar

from pydrake.common.yaml import yaml_dump, yaml_dump_typed, yaml_load, yaml_load_typed
from pydrake.geometry import GeometryId, SceneGraph
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlant, MultibodyPlantConfig
from pydrake.multibody.tree import ModelInstanceIndex
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig, SimulatorStatus
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, EventStatus, OutputPort, System
from pydrake.systems.primitives import ZeroOrderHold

from drake_starnav.errors import StarnavError, said_by, shown
from drake_starnav.parameters import is_number, unknown_name
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.schema import SimulationParameters
from drake_starnav.station.model_world import drop_floors
from drake_starnav.station.moving_bodies import add_moving_obstacles
from drake_starnav.station.robot_geometry import LONGEST_STEP
from drake_starnav.station.robot_interface import RobotInterface
from drake_starnav.station.robot_model import add_robot
from drake_starnav.station.wheel_drive import StepsCheck
from drake_starnav.station.world_geometry import add_ground, add_still_obstacles
from drake_starnav.worlds.world import World

Part = TypeVar("Part", bound=System)

DISCRETE_ONLY = frozenset(("discrete_contact_approximation", "sap_near_rigid_threshold", "use_sampled_output_ports"))
"""Settings of a plant that a continuous one ignores."""
LEAST = {"max_step_size": 1e-5, "accuracy": 1e-9, "penetration_allowance": 1e-9, "stiction_tolerance": 1e-9}
"""Least values of Drake's settings that may not be zero; a run with shorter steps, s, would never end."""


def plant_config(time_step: float = SimulationParameters.time_step) -> MultibodyPlantConfig:
    """Settings of a plant with which the robots drive as commanded.

    Args:
        time_step: of a discrete plant, s, which any simulator steps, at any depth of a diagram; 0 for a continuous one,
            which takes half of the time under `make_simulator`, and a thousand times as long under a plain `Simulator`.
    """
    return MultibodyPlantConfig(
        time_step=time_step,
        contact_model="point",
        discrete_contact_approximation="lagged",
        use_sampled_output_ports=False,  # sampling makes each step an unrestricted update, which copies all state
    )


def make_simulator(
    diagram: Diagram, context: Context | None = None, settings: Mapping[str, Any] | None = None
) -> Simulator:
    """A simulator that steps a continuous plant by Drake's CENIC integrator, and a discrete one as any does.

    Steps end at events and are no longer than the robots bear, see `RobotModel.longest_step`; their size is not adapted
    to the error, so that a run follows from its context alone: a clone of it goes the same way. A plant's
    state that is not finite ends it with a `StarnavError`. Updates see the geometry where it is; publish events see it
    where the last step began, for CENIC in Drake 1.51 leaves the poses of then in the cache.

    Args:
        diagram: the integrator finds a continuous plant under the name "plant" directly in it.
        context: to begin from, instead of the diagram's default.
        settings: laid over ours: keys of `SimulatorConfig`; None for those of the scenario of a `make_diagram`.
    """
    simulator = Simulator(diagram, context)
    settings = getattr(diagram, "simulator_config", {}) if settings is None else settings
    if diagram.HasSubsystemNamed("plant") and diagram.GetSubsystemByName("plant").num_continuous_states() > 0:
        longest_steps = (robot.longest_step for robot in _find_systems(diagram, RobotInterface))
        ours = SimulatorConfig(
            integration_scheme="cenic",
            max_step_size=min(longest_steps, default=LONGEST_STEP),
            use_error_control=False,
            start_time=simulator.get_context().get_time(),
        )
        ApplySimulatorConfig(make_simulator_config(settings, ours), simulator)
        for check in _find_systems(diagram, StepsCheck):
            check.chosen = True
    elif settings:
        ApplySimulatorConfig(make_simulator_config(settings), simulator)
    simulator.set_monitor(_make_monitor(list(_find_systems(diagram, MultibodyPlant))))
    return simulator


def advance(simulator: Simulator, time: float) -> SimulatorStatus:
    """Simulate up to a time, s, as `Simulator.AdvanceTo` does.

    Raises:
        StarnavError: Drake finds only while it simulates that it cannot, e.g. with a link without inertia, or a
            command that is not a number. Errors of systems in Python come as they are.
    """
    try:
        return simulator.AdvanceTo(time)
    except RuntimeError as error:
        _check_finite(_find_systems(simulator.get_system(), MultibodyPlant), simulator.get_context())
        if error.__traceback__ is not None and error.__traceback__.tb_next is not None:
            raise  # from a system in Python
        current_time = simulator.get_context().get_time()
        raise StarnavError(
            f"simulation failed at {current_time:.3f} s: {said_by(error)}; allowed: robots and worlds that "
            "Drake can simulate"
        ) from None


def evaluate_port(port: OutputPort, root: Context) -> Any:
    """The value of an output port, in the context of the whole diagram."""
    return port.Eval(port.get_system().GetMyContextFromRoot(root))


def _find_systems(system: System, kind: type[Part]) -> Iterator[Part]:
    """The systems of a kind in a system, at any depth."""
    if isinstance(system, kind):
        yield system
    elif isinstance(system, Diagram):
        for part in system.GetSystems():
            yield from _find_systems(part, kind)


def _check_finite(plants: Iterable[MultibodyPlant], context: Context) -> None:
    """Raise a `StarnavError` where the state of a plant is not finite."""
    for plant in plants:
        state = plant.GetPositionsAndVelocities(plant.GetMyContextFromRoot(context))
        if math.isfinite(state.sum()):
            continue
        names = (*plant.GetPositionNames(), *plant.GetVelocityNames())
        fault_text = next(f"{name} is {x:g}" for name, x in zip(names, state, strict=True) if not math.isfinite(x))
        raise StarnavError(
            f"simulation failed at {context.get_time():.3f} s: in the plant {fault_text}; allowed: robots and worlds "
            "that Drake can simulate"
        )


def _make_monitor(plants: Sequence[MultibodyPlant]) -> Callable[[Context], EventStatus]:
    """What the simulator calls after each step, between publish events and updates."""
    has_continuous = any(plant.time_step() == 0.0 for plant in plants)
    discrete_plants = [plant for plant in plants if plant.time_step() > 0.0]

    def monitor(context: Context) -> EventStatus:
        is_finite = True
        if has_continuous:  # that it may be changed lets the poses of geometries be computed anew
            state = context.get_mutable_continuous_state_vector().CopyToVector()
            is_finite = math.isfinite(sum(state.tolist()))
        _check_finite(discrete_plants if is_finite else plants, context)
        return EventStatus.DidNothing()

    return monitor


def add_plant(
    builder: DiagramBuilder,
    world: World,
    robot: RobotParameters,
    time_step: float,
    settings: Mapping[str, Any] = MappingProxyType({}),
) -> tuple[MultibodyPlant, SceneGraph, ModelInstanceIndex, GeometryId]:
    """Add a plant and scene graph with the robot, the ground and the obstacles of a world; the plant is finalized.

    The time step is as for `plant_config`, and settings are keys of `MultibodyPlantConfig` that are laid over it.
    Returns plant, scene graph, the robot's model instance, and the ground's geometry.
    """
    plant, scene_graph = AddMultibodyPlant(make_plant_config(settings, plant_config(time_step)), builder)
    model = add_robot(plant, scene_graph, robot, world.start)
    ground = add_ground(plant, world.extent)
    add_still_obstacles(plant, world)
    add_moving_obstacles(plant, scene_graph, world.moving_obstacles, model)
    plant.Finalize()
    if world.model is not None:
        drop_floors(plant, scene_graph, ground)
    return plant, scene_graph, model, ground


def make_plant_config(settings: Mapping[str, Any], defaults: MultibodyPlantConfig) -> MultibodyPlantConfig:
    """Defaults, and over them the scenario's `plant_config`; a `StarnavError` for what Drake does not allow."""
    if "time_step" in settings:
        raise StarnavError(
            f"plant_config.time_step is {shown(settings['time_step'])}; allowed: simulation.time_step, "
            "as the schedule of the loop follows from it"
        )
    if settings.get("discrete_contact_approximation") == "tamsi":
        raise StarnavError(
            "plant_config.discrete_contact_approximation is 'tamsi', which does not drive motors by their gains; "
            "allowed: sap, similar, lagged"
        )
    return _set_values(settings, defaults, "plant_config", lambda config: AddMultibodyPlant(config, DiagramBuilder()))


def make_simulator_config(settings: Mapping[str, Any], defaults: SimulatorConfig | None = None) -> SimulatorConfig:
    """Defaults, and over them the scenario's `simulator_config`; errors as in `make_plant_config`."""
    if settings.get("start_time", 0) != 0:
        raise StarnavError(
            f"simulator_config.start_time is {shown(settings['start_time'])}; allowed: 0, when the first scan is taken"
        )

    def tried(config: SimulatorConfig) -> None:
        ApplySimulatorConfig(config, Simulator(ZeroOrderHold(1.0, 1)))

    return _set_values(settings, defaults or SimulatorConfig(), "simulator_config", tried)


def _set_values(mapping: Mapping[str, Any], defaults: Any, place: str, trial_target: Callable[[Any], Any]) -> Any:
    """A struct of Drake's with some values over its defaults; each is tried where nothing comes to harm."""
    if not mapping:
        return defaults
    default_values = yaml_load(data=yaml_dump_typed(defaults))
    for key, value in mapping.items():
        if key not in default_values:
            raise unknown_name(f"key {place}.{key}", key, default_values)
        if is_number(default_values[key]) and not (is_number(value) and LEAST.get(key, 0.0) <= value < math.inf):
            raise StarnavError(f"{place}.{key} is {shown(value)}; allowed: {LEAST.get(key, 0.0):g} <= x")
        try:
            trial_target(yaml_load_typed(data=yaml_dump({key: value}), defaults=type(defaults)()))
        except (RuntimeError, ValueError, TypeError, SystemExit) as error:  # the last is a failed assertion of Drake's
            raise StarnavError(
                f"{place}.{key} is {shown(value)}; allowed: what Drake takes, which says: "
                f"{said_by(error).removeprefix('Failure at ')}"
            ) from None
    return yaml_load_typed(data=yaml_dump(dict(mapping)), defaults=defaults)
