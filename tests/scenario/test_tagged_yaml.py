"""Tags, keys and texts of YAML."""

import dataclasses

import pytest

from drake_starnav.scenario import parse_scenario
from drake_starnav.scenario.scenario_file import scenario_text


def test_merged_keys_may_be_overridden() -> None:
    text = "world: !Forest {}\nrobot: &a {radius: 0.3}\nlidar: {}\n"
    text = text.replace("robot: &a {radius: 0.3}", "robot: {<<: {radius: 0.3, max_speed: 0.5}, radius: 0.2}")
    robot = parse_scenario(text, name="x").robot
    assert (robot.radius, robot.max_speed) == (0.2, 0.5)


@pytest.mark.parametrize("text", ["/a\x85b", "/a\u2028", "a\x85\nb", "\n\u2029", "\ta\n", "a \nb", "\n"])
def test_texts_that_yaml_cannot_show_read_back_equal(text: str) -> None:
    scenario = parse_scenario("world: !Model {goal: [4, 0]}", name="x")
    scenario = dataclasses.replace(scenario, world=dataclasses.replace(scenario.world, directives=text))
    assert parse_scenario(scenario_text(scenario), name="x") == scenario
