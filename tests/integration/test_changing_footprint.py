"""A robot whose footprint changes while it drives, with rigid bodies."""

import numpy as np
import pytest
from pydrake.systems.analysis import SimulatorStatus
from pydrake.systems.framework import DiagramBuilder

from drake_starnav.geometry.footprint import Footprint, disc
from drake_starnav.navigation import Parts, add_navigation, make_diagram
from drake_starnav.scenario.scenario_file import parse_scenario
from drake_starnav.scenario.schema import Scenario
from drake_starnav.simulation.monitors import add_collision_monitor
from drake_starnav.simulation.run import run_trial
from drake_starnav.station.plant import make_simulator
from drake_starnav.worlds.clearance import body_clearance
from drake_starnav.worlds.world import World
from tests.helpers.footprints import LONG, ROUND, WIDE, ToldFootprint

BASES = ("differential", "omnidirectional", "car")
GAP = World(
    "gap",
    (0.0, 0.0, 0.0),
    (7.0, 0.0),
    polygons=[[(3.5, y), (3.7, y), (3.7, 0.32 * y / abs(y)), (3.5, 0.32 * y / abs(y))] for y in (-2.0, 2.0)],
    bounds=(-1.0, -2.0, 8.0, 2.0),
)
"""A room that a wall with a gap of 0.64 m divides."""


def scenario(base: str = "differential", text: str = "world: !Obstacles {}\n") -> Scenario:
    return parse_scenario(f"{text}robot: {{base: {base}}}\n", name="changing")


class Driven:
    """A scenario with a footprint that changes, driven in a world."""

    def __init__(self, made: Scenario, world: World, *steps: tuple[float, Footprint]) -> None:
        self.world = world
        self.diagram = make_diagram(made, Parts(world=world, footprint=ToldFootprint(*steps)))
        self.simulator = make_simulator(self.diagram)
        self.context = self.simulator.get_context()
        self.least = np.inf

    def until(self, time: float) -> float:
        """The robot's x then, m; the least clearance of what is in force is kept on the way."""
        for now in np.arange(self.context.get_time() + 0.05, time + 1e-9, 0.05):
            self.simulator.AdvanceTo(now)
            pose = self.diagram.GetOutputPort("localization.state").Eval(self.context)[None, :3]
            self.least = min(self.least, float(body_clearance(self.world, pose, self.in_force)[0]))
        return float(pose[0, 0])

    @property
    def in_force(self) -> Footprint:
        hold = self.diagram.navigation.footprint
        return hold.get_output_port().Eval(hold.GetMyContextFromRoot(self.context)).robot.shape


@pytest.mark.slow
@pytest.mark.parametrize("shape", [WIDE, disc(0.45)], ids=["arms", "disc"])
def test_a_gap_is_refused_while_it_is_too_wide_and_passed_when_it_has_shrunk(shape: Footprint) -> None:
    run = Driven(scenario(), GAP, (0.0, ROUND), (2.0, shape), (14.0, ROUND))
    assert 0.8 < run.until(2.0) < 2.0
    assert run.until(14.0) < 3.5 and run.in_force.radius == pytest.approx(shape.radius)
    assert run.until(40.0) > 6.5 and run.in_force.is_disc
    assert run.least > 0.0


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:robot model .* joints held still")  # those of its wheels, on other bases
@pytest.mark.parametrize("base", BASES)
def test_it_grows_and_shrinks_among_posts_without_a_contact(base: str) -> None:
    world = World(
        "posts",
        (0.0, 0.0, 0.0),
        (8.0, 0.0),
        cylinders=[(2.0, 0.2, 0.3), (3.6, -0.9, 0.3), (3.8, 1.0, 0.2), (5.2, 0.3, 0.3), (6.4, -1.0, 0.3)],
        bounds=(-1.5, -2.5, 9.5, 2.5),
    )
    steps = (0.0, ROUND), (1.0, LONG), (4.0, ROUND), (5.0, LONG), (6.0, ROUND)
    trial = run_trial(scenario(base), Parts(world=world, footprint=ToldFootprint(*steps)))
    assert trial.outcome == "reached"
    assert trial.min_clearance_m > 0.005


@pytest.mark.slow
def test_a_trial_s_clearance_is_of_what_was_in_force() -> None:
    """Both arms are stretched out where it starts, between two posts."""
    world = World("posts", (0.0, 0.0, 0.0), (4.0, 0.0), cylinders=[(0.0, 0.7, 0.1), (0.0, -0.7, 0.1)])
    steps = (0.0, WIDE), (0.5, ROUND)
    trial = run_trial(scenario(), Parts(world=world, footprint=ToldFootprint(*steps)))
    assert trial.outcome == "reached"
    assert 0.01 < trial.min_clearance_m < 0.15 + 1e-6
    assert run_trial(scenario(), Parts(world=world)).min_clearance_m > 0.3


def test_the_monitor_ends_a_run_in_which_what_is_in_force_touches() -> None:
    world = World("posts", (0.0, 0.0, 0.0), (4.0, 0.0), cylinders=[(0.0, 0.5, 0.1)])
    builder = DiagramBuilder()
    told = ToldFootprint((0.0, ROUND), (0.1, WIDE))
    navigation = add_navigation(builder, scenario(), Parts(world=world, footprint=told))
    add_collision_monitor(builder, navigation)
    status = make_simulator(builder.Build()).AdvanceTo(1.0)
    assert status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition
    assert status.message() == "collision of base_link with cylinders[0] at 0.100 s"
