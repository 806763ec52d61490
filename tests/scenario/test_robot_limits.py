"""A model's file says what its URDF cannot, and the scenario has the last word."""

from pathlib import Path

import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario import load_scenario, parse_scenario
from drake_starnav.scenario.scenario_file import scenario_text
from drake_starnav.scenario.source_files import source_files
from drake_starnav.utils.resources import model_path

LIMITS = "robot: {radius: 0.4, max_speed: 0.6}\nlidar: {beams: 180}\nnavigation_node: {gain: 3}\n"


def of(folder: Path, said: str = "", limits: str = LIMITS, name: str = "cart.urdf"):
    """The scenario that says something of a robot beside whose model lies a file of limits."""
    (folder / name).write_text("<robot/>", encoding="utf-8")
    (folder / "cart.yaml").write_text(limits, encoding="utf-8")
    return parse_scenario(f"world: !Forest {{}}\nrobot: {{model: {name}{said}}}\n", name="test", folder=folder)


@pytest.mark.parametrize("name", ["cart.urdf", "cart.urdf.xacro", "cart.xacro"])
def test_what_the_scenario_does_not_say_is_taken_from_beside_the_model(tmp_path: Path, name: str) -> None:
    scenario = of(tmp_path, ", max_speed: 0.7", name=name)
    assert (scenario.robot.radius, scenario.robot.max_speed, scenario.lidar.beams) == (0.4, 0.7, 180)
    assert scenario.robot.max_yaw_rate == RobotParameters.max_yaw_rate
    assert tmp_path / "cart.yaml" in source_files(scenario)
    assert parse_scenario(scenario_text(scenario), name="test") == scenario


def test_a_model_may_have_several_lidars(tmp_path: Path) -> None:
    limits = "lidar: {beams: 90}\nlidars: [{frame: front}, {frame: rear, beams: 180}]\n"
    scenario = of(tmp_path, limits=limits)
    assert [(each.frame, each.beams) for each in scenario.lidars] == [("front", 90), ("rear", 180)]


@pytest.mark.parametrize(
    ("said", "limits", "radius"),
    [
        (", footprint: [[0.3, 0.4], [-0.3, 0.4], [-0.3, -0.4], [0.3, -0.4]]", LIMITS, 0.5),
        (", radius: 0.7", "robot: {footprint: [[3, 4], [-3, 4], [-3, -4], [3, -4]]}", 0.7),
        ("", "robot: {footprint: [[0.3, 0.4], [-0.3, 0.4], [-0.3, -0.4], [0.3, -0.4]], model: other.urdf}", 0.5),
    ],
)
def test_radius_and_footprint_replace_each_other(tmp_path: Path, said: str, limits: str, radius: float) -> None:
    robot = of(tmp_path, said, limits).robot
    assert robot.radius == pytest.approx(radius) and Path(robot.model).name == "cart.urdf"


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        ("robot: {radus: 0.4}", "cart.yaml: robot.radus: did you mean radius"),
        ("robot: {radius: -1}", "robot.radius is -1.0; allowed: 0 <= x"),
        ("robot: 3", "cart.yaml: robot is 3; allowed: a mapping"),
        ("robot: {", "cart.yaml.*; allowed: valid YAML"),
    ],
)
def test_what_is_wrong_in_it_is_said(tmp_path: Path, limits: str, said: str) -> None:
    with pytest.raises(StarnavError, match=said):
        of(tmp_path, limits=limits)


def test_the_defaults_are_those_of_the_default_robot() -> None:
    assert load_scenario("forest").robot == RobotParameters()


@pytest.mark.parametrize("model", sorted(path.stem for path in model_path("robots").glob("*.urdf")))
@pytest.mark.parametrize("name", ["forest", "maze", "room"])
def test_each_shipped_robot_has_limits_of_its_own(name: str, model: str) -> None:
    assert model_path("robots", f"{model}.yaml").is_file()
    scenario = load_scenario(name, overrides=[f"robot.model={model}"])
    assert scenario.robot.limits.max_speed == {"jackal": 2.0, "carrier": 1.0}.get(model, 0.8)
