"""Scenario files: what they may hold, and that they read back equal."""

import dataclasses
from pathlib import Path

import pytest

from drake_starnav import LidarParameters, StarnavError
from drake_starnav.scenario.scenario_file import format_scenario, load_scenario, parse_scenario
from drake_starnav.scenario.shipped import METHODS, list_scenario_names


def test_an_override_wins_over_the_file() -> None:
    text = "world: !Room {}\nplanner: {preferred_clearance: 0.07}\ncontroller: {rate: 60}"
    scenario = parse_scenario(text, name="x", method="foa", overrides=["controller.rate=80"])
    assert scenario.planner.preferred_clearance == 0.07  # of the file
    assert parse_scenario(text, name="x", method="foa").controller.rate == 60.0
    assert scenario.controller.rate == 80.0  # the override wins over the file


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("world: !Forest {}\nrobot: {radios: 0.3}", ["robot.radios", "radius"]),
        ("world: !Forest {}\nrobots: {}", ["robots", "robot"]),
        ("world: !Forrest {}", ["Forrest", "Forest"]),
        ("world: !Forest {widht: 3}", ["world.widht", "width"]),
        ("world: {}", ["world", "!Forest"]),
        ("world: !Forest {}\nrobot: {radius: -1}", ["robot.radius", "-1", "0 <= x"]),
        ("world: !Forest {}\nlidar: {range_min: 6}", ["range_min", "6"]),
        ("world: !Forest {}\ncontroller: {kind: dwa}", ["controller.kind", "rate"]),
        ("world: !Forest {}\nrobot: 3", ["robot", "3", "mapping"]),
        ("world: !Forest {}\nrobot: {radius: 0.2, radius: 0.4}", ["line 2", "key radius is repeated"]),
        ("world: !Forest {}\nrobot: {}\nrobot: {radius: 0.4}", ["line 3", "key robot is repeated"]),
        ("world: !Forest {width: 20, width: 21}", ["line 1", "key width is repeated"]),
        ("", ["mapping"]),
        (
            "world: !Room {}\ngoals: [[5, 0, 90]]",
            ["goals[0] is [5, 0, 90]: a yaw of 90 rad is more than a turn; allowed: -6.28 <= yaw"],
        ),
        (
            "world: !Room {}\nrobot: {footprint: [[-250, -200], [250, -200], [250, 200]]}",
            ["footprint [[-250.0, -200.0], [250.0, -200.0]", "reaches 320.156 m from the axis; allowed: at"],
        ),
        ("world: !Room {}\nrobot: {footprint: [[0, 0], [0.2, 0], [0.4, 0]]}", ["has all corners in line; allowed: "]),
        (
            "world: !Room {}\nrobots: [{start: [0, 0, -180], goal: [2, 0]}, {start: [2, 0, 0], goal: [0, 0]}]",
            ["a yaw of -180 rad is more"],
        ),
    ],
)
def test_bad_text_is_refused_in_one_sentence(text: str, words: list[str]) -> None:
    with pytest.raises(StarnavError) as error:
        parse_scenario(text, name="x", place="x.yaml")
    assert "\n" not in str(error.value)
    for word in words:
        assert word in str(error.value)


def test_unknown_names_suggest_the_nearest() -> None:
    with pytest.raises(StarnavError, match="did you mean forest"):
        load_scenario("forrest")
    with pytest.raises(StarnavError, match="did you mean star"):
        load_scenario("forest", method="str")
    with pytest.raises(StarnavError, match="cannot be read"):
        load_scenario("no/such/file.yaml")


def test_paths_are_relative_to_the_file_that_names_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("scenarios", "maps", "here"):
        (tmp_path / name).mkdir()
    file = tmp_path / "scenarios" / "mine.yaml"
    file.write_text("world: !RosMap {file: ../maps/mine.yaml}\nrobot: {model: ../robots/mine.urdf}\n")
    monkeypatch.chdir(tmp_path / "here")
    assert load_scenario(str(file)).robot.model == str(tmp_path / "robots" / "mine.urdf")
    assert load_scenario(str(file), overrides=["robot.model=starbot"]).robot.model == "starbot"
    assert load_scenario(str(file)).world.file == str(tmp_path / "maps" / "mine.yaml")
    monkeypatch.chdir(tmp_path)
    assert load_scenario("scenarios/mine.yaml").world.file == str(tmp_path / "maps" / "mine.yaml")
    given = load_scenario("scenarios/mine.yaml", overrides=["world.file=maps/other.yaml"])
    assert given.world.file == str(tmp_path / "maps" / "other.yaml")
    assert parse_scenario(format_scenario(given), name="mine") == given  # a worker may run elsewhere
    assert parse_scenario("world: !RosMap {file: a.yaml}", name="x").world.file == str(tmp_path / "a.yaml")


def test_paths_of_shipped_files_stay_as_they_are(tmp_path: Path) -> None:
    assert load_scenario("map").world.file == "package://drake_starnav/maps/studio.yaml"
    assert load_scenario("map", overrides=[f"world.file={tmp_path}/m.yaml"]).world.file == f"{tmp_path}/m.yaml"
    assert parse_scenario("world: !Model {}", name="x").world.directives == ""


def test_each_of_several_lidars_has_the_values_of_the_lidar_where_it_says_nothing() -> None:
    text = "world: !Room {}\nlidar: {rate: 10, beams: 271}\nlidars: [{frame: front}, {frame: rear, beams: 100}]"
    scenario = parse_scenario(text, name="two", overrides=["lidar.noise=0.02"])
    assert [(each.frame, each.beams, each.rate, each.noise) for each in scenario.all_lidars] == [
        ("front", 271, 10.0, 0.02),
        ("rear", 100, 10.0, 0.02),
    ]
    assert scenario.lidar is scenario.lidars[0]
    assert parse_scenario(format_scenario(scenario), name="two") == scenario
    assert parse_scenario("world: !Room {}", name="two", overrides=["lidars=[{frame: a}]"]).lidar.frame == "a"
    lone = parse_scenario("world: !Room {}", name="one")
    assert lone.lidars == () and lone.all_lidars == (lone.lidar,)


def test_goals_are_places_with_or_without_a_heading() -> None:
    scenario = parse_scenario("world: !Room {}\ngoals: [[1, 2], [3, 4, 1.5]]", name="two")
    assert scenario.goals == ((1, 2), (3, 4, 1.5))
    assert parse_scenario(format_scenario(scenario), name="two") == scenario
    assert parse_scenario("world: !Room {}", name="one", overrides=["goals=[[5, 6]]"]).goals == ((5, 6),)
    assert parse_scenario("world: !Room {}", name="none").goals == ()


TWO = "[{start: [0, 0, 0], goal: [1, 2]}, {model: jackal, name: b, start: [3, 4, 1], goals: [[5, 6], [7, 8, 1]]}]"


def test_each_robot_has_what_is_said_of_all_and_what_its_own_model_says() -> None:
    text = f"world: !Obstacles {{}}\nrobot: {{max_speed: 0.4}}\nlidar: {{beams: 90}}\nrobots: {TWO}"
    scenario = parse_scenario(text, name="two")
    a, b = scenario.robots
    assert (a.name, b.name) == ("starbot_1", "b")
    assert (a.start, a.goals, b.start, b.goals) == ((0, 0, 0), ((1, 2),), (3, 4, 1), ((5, 6), (7, 8, 1)))
    assert (a.robot.radius, b.robot.radius) == (0.25, 0.334) and b.robot.max_yaw_rate == 4.0
    assert a.robot.max_speed == b.robot.max_speed == 0.4 and b.lidar.beams == 90
    assert scenario.world.start == [0, 0, 0] and scenario.world.goal == [1, 2]
    assert parse_scenario(format_scenario(scenario), name="two") == scenario


@pytest.mark.parametrize(
    ("robots", "said"),
    [
        ("{}", "robots is {}; allowed: a list of two or more mappings"),
        ("[{start: [0, 0, 0], goal: [1, 2]}]", "allowed: a list of two or more mappings"),
        ("[{goal: [1, 2]}, {}]", r"robots\[0\] has goal; allowed: start, and goal or goals"),
        (TWO.replace("model", "modle"), r"robots\[1\]: unknown key robot.modle: did you mean model"),
        (TWO.replace("[3, 4, 1]", "[3, 4]"), r"robots\[1\].start is \[3, 4\]; allowed: finite \[x, y, yaw\]"),
        (TWO.replace("[1, 2]", "[1]"), r"robots\[0\]: goals\[0\] is \[1\]"),
        *(
            (TWO.replace("name: b", f"name: {name}"), r"robots\[1\].name is .*; allowed: a text of letters")
            for name in ("a/b", "'a::b'", "''", "null", "[1]", "'a b'")
        ),
        (TWO.replace("name: b", "name: starbot_1"), "robots are named starbot_1, starbot_1; allowed: each name once"),
    ],
)
def test_lists_of_robots_that_cannot_be_are_refused(robots: str, said: str) -> None:
    with pytest.raises(StarnavError, match=said):
        parse_scenario(f"world: !Obstacles {{}}\nrobots: {robots}", name="bad")


def test_the_first_of_several_lidars_is_the_lidar() -> None:
    scenario = parse_scenario("world: !Room {}\nlidars: [{}, {}]", name="two")
    with pytest.raises(StarnavError, match="lidar differs from lidars"):
        dataclasses.replace(scenario, lidar=LidarParameters(beams=90))


def test_robots_know_how_fast_and_how_large_the_others_are() -> None:
    text = "world: !Room {}\nobstacles: {max_radius: 0.1, max_speed: 0.1}\nrobots:\n"
    text += (
        "  - {start: [0, 0, 0], goal: [2, 0], model: carrier, max_speed: 0.7}\n  - {start: [2, 0, 0], goal: [0, 0]}\n"
    )
    small, large = parse_scenario(text, name="two").robots[::-1]
    assert (small.obstacles.max_speed, small.obstacles.max_radius) == (0.7, large.robot.radius)
    assert (large.obstacles.max_speed, large.obstacles.max_radius) == (small.robot.max_speed, small.robot.radius)


@pytest.mark.parametrize("name", list_scenario_names())
def test_shipped_scenarios_survive_their_own_text(name: str) -> None:
    for method in METHODS:
        scenario = load_scenario(name, method=method)
        assert scenario.name == name
        assert parse_scenario(format_scenario(scenario), name=name, method=method) == scenario


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("radius=0.3", r"did you mean robot\.radius\?.*section\.key=value"),
        ("robto.radius=0.3", "robto.*robot"),
        ("robot.radius=[", "YAML"),
        ("lidars=3", "lidars is 3; allowed: a list"),
        ("goals=[3]", r"goals is \[3\]; allowed: a list"),
    ],
)
def test_a_bad_override_is_refused(override: str, message: str) -> None:
    with pytest.raises(StarnavError, match=message):
        load_scenario("forest", overrides=[override])
