"""A robot that does not follow its commands is reported within 5 s, with the likely cause."""

import dataclasses
from pathlib import Path

import pytest

from drake_starnav import StarnavError, load_scenario, run_trial
from tests.station.test_robot_file import EDITED, JOINTS

SOONEST = 5.0
"""Simulated time within which it is reported, s."""
WHEEL = '<geometry><cylinder radius="0.06" length="0.04"/></geometry></collision>'
FRICTION = (
    '<drake:proximity_properties><drake:mu_static value="0"/><drake:mu_dynamic value="0"/>'
    "</drake:proximity_properties></collision>"
)
CAUSES = {
    "weak": (
        '<axis xyz="0 0 1"/>',
        '<axis xyz="0 0 1"/><limit effort="0.0001" velocity="9"/>',
        "its wheels turn it with at most",
    ),
    "slippery": (WHEEL, WHEEL.replace("</collision>", FRICTION), "wheels turn, but do not move it"),
}


@pytest.mark.parametrize("kind", CAUSES)
def test_a_robot_that_stays_where_it_is_is_reported(tmp_path: Path, kind: str) -> None:
    old, new, cause = CAUSES[kind]
    text = EDITED.replace("<robot ", '<robot xmlns:drake="http://drake.mit.edu" ').replace(old, new)
    assert new in text
    path = tmp_path / "robot.urdf"
    path.write_text(text, encoding="utf-8")
    scenario = load_scenario("room", overrides=[f"simulation.timeout={SOONEST}"])
    robot = dataclasses.replace(scenario.robot, model=str(path), wheel_joints=JOINTS)
    with pytest.raises(StarnavError, match=f"{cause}.*; allowed: "):
        run_trial(dataclasses.replace(scenario, robot=robot))


def test_a_robot_that_slips_and_drifts_is_not_reported_while_it_drives() -> None:
    faults = ("drive.slip=0.05", "drive.delay=0.05", "localization.drift=0.02", "lidar.noise=0.02")
    assert run_trial(load_scenario("maze", overrides=faults), seed=3739256933).outcome == "reached"
