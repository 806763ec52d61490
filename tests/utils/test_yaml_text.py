"""YAML of plain values and tagged mappings."""

import dataclasses
from pathlib import Path

import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.scenario.scenario_file import format_scenario, parse_scenario
from drake_starnav.utils.yaml_text import Loader, PlainLoader, load_yaml


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: [1\nb: 2", "line 2, column 2"),
        ("*nobody", "nobody|undefined alias"),
        ("x: \0", "control characters are not allowed"),
        ("x: 2024-13-01", "month must be in 1..12"),
        ("{}\n---\n{}", "line 2, column 1"),
    ],
)
def test_what_is_refused_is_reported_with_its_place(text: str, message: str) -> None:
    with pytest.raises(StarnavError, match=f"^here.*{message}.*; allowed: valid YAML$"):
        load_yaml(text, "here")


def test_merged_keys_may_be_overridden() -> None:
    text = "world: !Forest {}\nrobot: &a {radius: 0.3}\nlidar: {}\n"
    text = text.replace("robot: &a {radius: 0.3}", "robot: {<<: {radius: 0.3, max_speed: 0.5}, radius: 0.2}")
    robot = parse_scenario(text, name="x").robot
    assert (robot.radius, robot.max_speed) == (0.2, 0.5)


@pytest.mark.parametrize("text", ["/a\x85b", "/a\u2028", "a\x85\nb", "\n\u2029", "\ta\n", "a \nb", "\n"])
def test_texts_that_yaml_cannot_show_read_back_equal(text: str) -> None:
    scenario = parse_scenario("world: !Model {goal: [4, 0]}", name="x")
    scenario = dataclasses.replace(scenario, world=dataclasses.replace(scenario.world, directives=text))
    assert parse_scenario(format_scenario(scenario), name="x") == scenario


@pytest.mark.parametrize("tag", ["apply:os.mkdir ['{}']", "new:os.mkdir ['{}']"])
def test_yaml_never_runs_code(tag: str, tmp_path: Path) -> None:
    with pytest.raises(StarnavError, match="could not determine a constructor"):
        load_yaml("x: !!python/object/" + tag.format(tmp_path / "harm"), "here")
    assert not [*tmp_path.iterdir()]


@pytest.mark.parametrize("loader", [PlainLoader, Loader])
def test_numbers_are_those_of_yaml_1_2(loader: type) -> None:
    text = "[-.25, +.5, .5, 1e-3, -.2e1, 1., -0.25, 1.5E-1, .2e0, +1_0e-2]"
    assert load_yaml(text, "x", loader) == [-0.25, 0.5, 0.5, 1e-3, -2.0, 1.0, -0.25, 0.15, 0.2, 0.1]
    assert load_yaml("[a.5, -., ., -.x]", "x", loader) == ["a.5", "-.", ".", "-.x"]


@pytest.mark.parametrize("loader", [PlainLoader, Loader])
def test_aliases_that_stand_for_millions_of_values_are_refused(loader: type) -> None:
    bomb = "[&a0 [" + ", ".join("l" * 10) + "]"
    for k in range(1, 9):
        bomb += f", &a{k} [" + ", ".join([f"*a{k - 1}"] * 10) + "]"
    for text in (f"a: {bomb}]", "&a [*a]", "&a {b: *a}"):
        with pytest.raises(StarnavError, match="x line .* aliases stand for more than 1000000 values; allowed"):
            load_yaml(text, "x", loader)
    assert load_yaml("[&a [1, 2], *a, *a]", "x", loader) == [[1, 2]] * 3
