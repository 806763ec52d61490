"""Old keys: an unknown one is answered with the name that it has now."""

import dataclasses

import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.scenario import parse_scenario
from drake_starnav.scenario.renamed import RENAMED, name_now
from drake_starnav.scenario.schema import SECTIONS
from drake_starnav.worlds import Crowd


def fields(cls: type) -> set[str]:
    return {field.name for field in dataclasses.fields(cls)}


@pytest.mark.parametrize("old", RENAMED)
def test_the_message_suggests_the_name_now(old: str) -> None:
    section, _, key = old.partition(".")
    line = f"world: !Crowd {{{key}: 1}}" if section == "world" else f"world: !Room {{}}\n{section}: {{{key or 'x'}: 1}}"
    with pytest.raises(StarnavError, match=rf"^unknown key {old}.*: did you mean {RENAMED[old]}\? allowed: "):
        parse_scenario(line, name="old")
    override = f"{old}=1" if key else f"{old}.max_speed=1"
    with pytest.raises(StarnavError, match=rf"did you mean {RENAMED[old]}\?"):
        parse_scenario("world: !Crowd {}", name="old", overrides=[override])


def test_new_names_are_valid_and_old_ones_are_not() -> None:
    sections = {**SECTIONS, "world": Crowd}
    for old, new in RENAMED.items():
        section, _, key = old.partition(".")
        valid = fields(sections[section]) if key else set(sections)
        elsewhere, _, name = new.rpartition(".")
        assert (name in fields(sections[elsewhere]) if elsewhere else new in valid) and (key or section) not in valid


@pytest.mark.parametrize("old", ["min_moving_obstacles", "max_moving_obstacles", "min_speed", "max_speed"])
def test_the_ends_of_a_range_lead_to_its_name(old: str) -> None:
    with pytest.raises(StarnavError, match=rf"unknown key world\.{old}: did you mean {old[4:]}\? allowed: "):
        parse_scenario(f"world: !Crowd {{{old}: 1}}", name="old")


def test_other_names_stay() -> None:
    assert name_now("robot.radis") == "radis"
    assert name_now("robott") == "robott"
