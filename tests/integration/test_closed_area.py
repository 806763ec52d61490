"""Areas that a rule closes: robots drive round them, or give up early and say why."""

import numpy as np
import pytest

from drake_starnav.geometry.polyline import measure_signed_distance
from drake_starnav.loading import parse_scenario
from drake_starnav.navigation import Parts
from drake_starnav.safety import KeepOut
from drake_starnav.scenario.scenario_file import format_scenario, load_scenario
from drake_starnav.simulation.run import run_trial
from drake_starnav.simulation.trial import make_caption_lines

pytestmark = pytest.mark.slow


class Unnamed:
    """A certificate of which the planner knows nothing."""

    def __init__(self, zone: KeepOut) -> None:
        """Closes a zone."""
        self.accepts = zone.accepts


@pytest.mark.parametrize("rule", [lambda zone: zone, Unnamed], ids=["known", "unknown"])
def test_a_robot_that_the_shield_keeps_out_of_an_area_drives_round_it(rule) -> None:
    scenario = load_scenario("forest", overrides=["simulation.timeout=90"])
    world = scenario.world.make(np.random.default_rng(1), scenario.robot.shape)
    start, goal = np.array(world.start[:2]), np.array(world.goal)
    ahead = (goal - start) / np.hypot(*(goal - start))
    sides = np.array(((0.3, 0.9), (-0.3, 0.9), (-0.3, -0.9), (0.3, -0.9)))
    area = 0.5 * (start + goal) + sides @ np.array((ahead, (-ahead[1], ahead[0])))
    assert run_trial(scenario, Parts(world, certificates=(rule(KeepOut(area)),)), seed=1).outcome == "reached"


HALL = "world: !Obstacles {bounds: [0, -3, 9, 3], cylinders: [[2, 1.4, 0.3]], start: [0.6, 0, 0], goal: [8.2, 0]}\n"


@pytest.mark.parametrize("model", ["starbot", "carrier"])
def test_a_declared_zone_is_driven_round_and_kept(model: str, tmp_path) -> None:
    text = f"{HALL}robot: {{model: {model}}}\nzones:\n"
    text += "- !KeepOut {name: dock, polygon: [[3, -1.2], [5, -1.2], [5, 3], [3, 3]]}\n"
    text += "- !SpeedZone {polygon: [[5, -3], [7, -3], [7, 3], [5, 3]], max_speed: 0.3}\n"
    scenario = parse_scenario(text, name="zones")
    assert parse_scenario(format_scenario(scenario), name="zones") == scenario
    trial = run_trial(scenario, csv=tmp_path / "states.csv")
    assert trial.outcome == "reached"
    states = np.genfromtxt(tmp_path / "states.csv", delimiter=",", names=True)
    places = np.column_stack((states["x"], states["y"]))
    dock, slow = scenario.zones
    assert measure_signed_distance(dock.corners, places).min() > scenario.robot.shape.cover_radius
    assert states["v"][measure_signed_distance(slow.corners, places) < 0.0].max() < 0.3 + 0.01


DOCK = "name: dock, polygon: [[3, -3], [5, -3], [5, 3], [3, 3]]"
AROUND_THE_GOAL = "polygon: [[7.5, -1], [9, -1], [9, 1], [7.5, 1]]"


@pytest.mark.parametrize(("zone", "name"), [(DOCK, "dock"), (AROUND_THE_GOAL, "zones[0]")])
def test_where_a_zone_leaves_no_way_the_goal_is_given_up_early_and_it_is_named(zone: str, name: str) -> None:
    trial = run_trial(parse_scenario(f"{HALL}zones: [!KeepOut {{{zone}}}]", name="closed"))
    assert (trial.outcome, trial.blocked_by) == ("unreachable", f"no way is left but through {name}")
    assert make_caption_lines(trial)[-1] == trial.blocked_by
    assert trial.time_s < 30.0 and trial.min_clearance_m > 0.0
