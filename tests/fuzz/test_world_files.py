"""Any JSON as a file of worlds: read, or refused in words."""

import json
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drake_starnav.errors import StarnavError
from drake_starnav.worlds import Barn, DynaBarn, make_world

numbers = st.one_of(
    st.integers(-20, 20), st.floats(-20.0, 20.0), st.sampled_from([10**400, 1e308, float("nan"), float("inf"), True])
)
leaves = st.one_of(st.none(), numbers, st.sampled_from(["a", "b", ""]))
anything = st.recursive(
    leaves, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=3)
)
triples = st.lists(numbers, min_size=3, max_size=3)
paths = st.lists(triples, min_size=0, max_size=4).map(lambda rows: [[0.0, *rows[0][1:]], *rows[1:]] if rows else rows)
walls = st.fixed_dictionaries({"pose": st.lists(numbers, min_size=6, max_size=6), "size": triples})
moving = st.fixed_dictionaries(
    {
        "meta": st.fixed_dictionaries({"start": triples | anything, "goal": st.lists(numbers, min_size=2, max_size=2)}),
        "worlds": st.fixed_dictionaries(
            {
                "id": st.just(0),
                "plugins": st.lists(st.sampled_from("ab"), max_size=3),
                "walls": st.lists(walls, max_size=2),
            }
        ).map(lambda world: [world]),
        "trajectories": st.fixed_dictionaries(
            {name: st.fixed_dictionaries({"total": numbers, "keys": paths}) | anything for name in "ab"}
        ),
    }
)
standing = st.fixed_dictionaries(
    {
        "id": st.just(0),
        "cylinders": st.lists(triples, max_size=4) | anything,
        "start": triples | anything,
        "goal": st.lists(numbers, min_size=2, max_size=2) | anything,
        "path_length_official": numbers | anything,
    }
).map(lambda world: {"worlds": [world]})


@pytest.mark.parametrize("kind", [Barn, DynaBarn])
@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(data=st.data())
def test_a_file_of_worlds_never_breaks_the_reader(tmp_path: Path, kind: type, data: st.DataObject) -> None:
    content = data.draw(st.one_of(moving, standing, anything))
    file = tmp_path / "worlds.json"
    file.write_text(json.dumps(content))
    try:
        world = make_world(kind(file=str(file)), 0, 0.25)
    except StarnavError as error:
        assert "allowed" in str(error)
        assert "\n" not in str(error)
    else:
        assert world.timeout == 100.0
