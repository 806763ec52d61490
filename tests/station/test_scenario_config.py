"""Scenarios pass through Drake's typed YAML functions and come back equal."""

import dataclasses

import numpy as np
import pytest
from pydrake.common.yaml import yaml_dump_typed, yaml_load_typed

from drake_starnav.errors import StarnavError
from drake_starnav.scenario import METHODS, load_scenario, parse_scenario, scenario_names
from drake_starnav.station.model_world import make_world_with_footprints
from drake_starnav.station.scenario_config import ScenarioConfig
from drake_starnav.utils.resources import model_path


@pytest.mark.parametrize("name", scenario_names())
def test_each_shipped_scenario_is_written_and_read_back_equal(name: str) -> None:
    scenario = load_scenario(name)
    text = yaml_dump_typed(ScenarioConfig.of(scenario))
    assert yaml_load_typed(schema=ScenarioConfig, data=text).scenario() == scenario


@pytest.mark.parametrize("method", METHODS)
def test_so_are_all_methods_and_settings_of_drake(method: str) -> None:
    scenario = dataclasses.replace(
        parse_scenario(
            "world: !Obstacles {cylinders: [[1, 2, 0.5]], polygons: [[[3, 0], [4, 0], [4, 1]]], goal: [5, 0]}\n"
            "plant_config: {contact_model: point, penetration_allowance: 0.002}",
            name="mine",
            method=method,
        )
    )
    text = yaml_dump_typed(ScenarioConfig.of(scenario))
    assert yaml_load_typed(schema=ScenarioConfig, data=text).scenario() == scenario


def test_the_files_of_scenarios_are_read_by_drake() -> None:
    path = model_path("scenarios", "rooms.yaml")
    config = yaml_load_typed(schema=ScenarioConfig, filename=path)
    config.name = "rooms"
    assert config.scenario() == load_scenario("rooms")
    config.robot.max_speed = 0.3
    assert config.scenario().robot.max_speed == 0.3


def test_values_are_checked_when_it_becomes_a_scenario() -> None:
    config = ScenarioConfig()
    config.robot.radius = -1.0
    with pytest.raises(StarnavError, match="robot.radius is -1.0; allowed: 0.01 <= x <= 5 m"):
        config.scenario()


def test_structs_do_not_share_their_values() -> None:
    one, other = ScenarioConfig(), ScenarioConfig()
    one.lidar.beams = 7
    one.plant_config["contact_model"] = "point"
    assert other.lidar.beams == 360 and not other.plant_config


DIRECTIVES = """
world: !Model {goal: [5, 0]}
directives:
- add_model: {name: barrel, file: "package://drake_starnav/worlds/barrel.urdf"}
- add_weld: {parent: world, child: "barrel::barrel", X_PC: {translation: [3, 2, 0], rotation: !Rpy {deg: [0, 0, 30]}}}
"""


def test_directives_are_drake_s_own() -> None:
    config = yaml_load_typed(schema=ScenarioConfig, data=DIRECTIVES)
    assert config.directives[0].add_model.name == "barrel"
    config.directives[1].add_weld.X_PC.translation = (1.0, 2.0, 0.0)
    scenario = yaml_load_typed(schema=ScenarioConfig, data=yaml_dump_typed(config)).scenario()
    cylinder = make_world_with_footprints(scenario.world, 0, 0.25).cylinders[0]
    assert np.allclose(cylinder[:2], (1.0, 2.0))
    again = yaml_load_typed(schema=ScenarioConfig, data=yaml_dump_typed(ScenarioConfig.of(scenario)))
    assert again.scenario() == scenario


def test_directives_need_a_model_without_others() -> None:
    config = yaml_load_typed(schema=ScenarioConfig, data=DIRECTIVES)
    config.world.directives = "other.sdf"
    with pytest.raises(StarnavError, match="directives in scenario beside world.directives; allowed"):
        config.scenario()
    config.world = ScenarioConfig().world
    with pytest.raises(StarnavError, match="directives in scenario beside world: !Forest; allowed"):
        config.scenario()
