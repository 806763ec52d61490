"""Bodies that are not star-shaped drive on although what is in their notch hides a part of them from their lidar."""

from pathlib import Path

import pytest

from drake_starnav.scenario.scenario_file import parse_scenario
from drake_starnav.simulation.run import run_trial

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore:.*joints held still:UserWarning")]

SMALL = Path(__file__).parents[1] / "data" / "small_base.urdf"
"""A base that lies within all of these footprints."""
ELL = "[[[-0.345, -0.255], [0.345, -0.255], [0.345, 0.255], [-0.345, 0.255]], "
ELL += "[[-0.345, 0.235], [-0.145, 0.235], [-0.145, 0.455], [-0.345, 0.455]]]"
TEE = (
    "[[[-0.35, -0.15], [0.2, -0.15], [0.2, 0.15], [-0.35, 0.15]], [[0.15, -0.4], [0.3, -0.4], [0.3, 0.4], [0.15, 0.4]]]"
)
FORK = "[[[-0.3, -0.25], [0.1, -0.25], [0.1, 0.25], [-0.3, 0.25]], [[0.05, 0.1], [0.5, 0.1], [0.5, 0.2], [0.05, 0.2]], "
FORK += "[[0.05, -0.2], [0.5, -0.2], [0.5, -0.1], [0.05, -0.1]]]"


@pytest.mark.parametrize("base", ["omnidirectional", "differential"])
@pytest.mark.parametrize("footprint", [ELL, TEE, FORK], ids=["ell", "tee", "fork"])
def test_past_the_end_of_a_wall_that_its_notch_takes_in(footprint: str, base: str) -> None:
    scenario = parse_scenario(
        f"""
        world: !Obstacles
          bounds: [0, 0, 9, 5]
          polygons: [[[6.87, 3.84], [6.92, 3.84], [6.92, 5.0], [6.87, 5.0]]]
          start: [5.0, 2.77, 0.376]
          goal: [7.72, 4.23]
        robot: {{base: {base}, footprint: {footprint}, model: {SMALL}}}
        simulation: {{timeout: 60}}
        """,
        name="notch",
    )
    for seed in range(2):
        trial = run_trial(scenario, seed=seed)
        assert trial.outcome == "reached" and trial.min_clearance_m > 0.0


@pytest.mark.parametrize("footprint", [ELL, TEE], ids=["ell", "tee"])
def test_away_from_a_post_that_stands_in_its_notch_at_the_start(footprint: str) -> None:
    """With less room than the margin: what the post hides is beside corners of the robot, which leave it."""
    x, y = (2.08, 3.25) if footprint == TEE else (1.96, 3.33)
    for base in ("differential", "omnidirectional"):
        scenario = parse_scenario(
            f"""
            world: !Obstacles {{bounds: [0, 0, 8, 6], cylinders: [[{x}, {y}, 0.06]], start: [2, 3, 0], goal: [6.5, 3]}}
            robot: {{base: {base}, footprint: {footprint}, model: {SMALL}}}
            simulation: {{timeout: 20}}
            """,
            name="post",
        )
        trial = run_trial(scenario, seed=0)
        assert trial.outcome == "reached" and trial.min_clearance_m > 0.009
