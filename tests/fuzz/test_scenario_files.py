"""Whatever a scenario says, the reader takes it or refuses it in one sentence, and runs nothing."""

import dataclasses
from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from drake_starnav.errors import StarnavError
from drake_starnav.scenario.scenario_file import load_scenario, parse_scenario, scenario_text
from drake_starnav.scenario.schema import SECTIONS
from drake_starnav.scenario.shipped import METHODS, scenario_names
from drake_starnav.worlds import WORLD_KINDS
from tests.helpers.inputs import corpus, fuzzed, mutated, scalars, values

VALID = b"""world: !Forest {width: 20, seed: 3}
robot: {radius: 0.25, max_speed: 0.8}
lidar: {beams: 360, noise: 0.01, dropout: 0.1}
planner: {preferred_clearance: 0.03, rate: 20.0}
controller: {certificate: true, rate: 50}
"""
names = st.sampled_from([*SECTIONS, "world", "wrold"])
keys = st.one_of(scalars, st.sampled_from(["radius", "noise", "delay", "drift", "margin", "rate", "beams", "file"]))


def accepted(text: str, **options) -> bool:
    """Whether a text is a scenario, whose text then reads back equal; any error but StarnavError is a failure."""
    try:
        scenario = parse_scenario(text, name="fuzz", **options)
    except StarnavError as error:
        assert str(error)
        return False
    assert parse_scenario(scenario_text(scenario), name="fuzz") == scenario
    return True


@fuzzed
@given(st.dictionaries(names, st.one_of(values, st.dictionaries(keys, values, max_size=4)), max_size=4))
def test_any_mapping(sections):
    accepted("world: !Room {}\n" + yaml.safe_dump({k: v for k, v in sections.items() if k != "world"}))


@fuzzed
@given(st.sampled_from([*WORLD_KINDS, "Nowhere"]), st.dictionaries(keys, values, max_size=4))
def test_any_world(kind, parameters):
    accepted(f"world: !{kind} " + yaml.safe_dump(parameters, default_flow_style=True, width=10**6))


@fuzzed
@given(
    st.text(st.one_of(st.sampled_from("\n\n \t#:-.\x85\u2028"), st.characters(exclude_categories=["Cs"])), max_size=60)
)
def test_any_directives(text):
    world = dataclasses.replace(WORLD_KINDS["Model"](), directives=f"{text}\n{text}")
    scenario = dataclasses.replace(load_scenario("room"), world=world)
    assert parse_scenario(scenario_text(scenario), name="room") == scenario


@fuzzed
@given(mutated(VALID))
def test_any_damage(data):
    accepted(data.decode("utf-8", errors="replace"))


@fuzzed
@given(st.text(max_size=60))
def test_any_text(text):
    accepted(text)


@fuzzed
@given(st.one_of(st.text(max_size=30), st.builds("{}.{}={}".format, names, keys, values)))
def test_any_override(override):
    accepted("world: !Room {}", overrides=[override])


@fuzzed
@given(st.binary(max_size=80))
def test_any_file(data):
    path = Path("fuzz.yaml")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Path, "read_bytes", lambda self: data)
        patch.setattr(Path, "read_text", lambda self, encoding: data.decode(encoding))
        try:
            load_scenario(str(path))
        except StarnavError as error:
            assert "fuzz.yaml" in str(error) or "world" in str(error)


@pytest.mark.parametrize("path", corpus("scenarios"), ids=lambda path: path.name)
def test_the_corpus_is_refused_in_one_sentence(path):
    with pytest.raises(StarnavError) as refusal:
        load_scenario(str(path))
    assert "allowed" in str(refusal.value)


@pytest.mark.parametrize(
    "tag",
    ["!!python/object/apply:os.mkdir ['{}']", "!!python/object/new:os.mkdir ['{}']", "!!python/name:os.mkdir {}"],
)
def test_yaml_never_runs_code(tag, tmp_path):
    harm = tmp_path / "harm"
    tag = tag.format(harm)
    for text in (f"world: {tag}", f"world: !Room {{}}\nrobot: {tag}", f"world: !Room {{width: {tag}}}"):
        assert not accepted(text)
    assert not accepted("world: !Room {}", overrides=[f"robot.radius={tag}"])
    assert not harm.exists()


@pytest.mark.parametrize("name", scenario_names())
@pytest.mark.parametrize("method", METHODS)
def test_shipped_scenarios_survive_their_own_text(name, method):
    scenario = load_scenario(name, method=method)
    assert parse_scenario(scenario_text(scenario), name=name) == scenario
