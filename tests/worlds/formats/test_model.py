"""What can be said of a model file before Drake reads it."""

from pathlib import Path

import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.worlds import Model, make_world


def test_the_world_is_the_file_with_its_ends(tmp_path: Path) -> None:
    path = tmp_path / "my.room.dmd.yaml"
    path.touch()
    world = make_world(Model(directives=str(path), start=[1.0, 2.0, 0.5], goal=[3, 4], weld=False), 0, 0.25)
    assert (world.name, world.start, world.goal) == ("my", (1.0, 2.0, 0.5), (3.0, 4.0))
    assert world.model is not None
    assert (world.model.path, world.model.weld) == (str(path), False)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({}, r"Model\.directives is ''; allowed: a \.dmd\.yaml, \.sdf, \.world or \.urdf file"),
        ({"directives": "world.obj"}, r"'world\.obj'; allowed"),
        ({"directives": "/nowhere/world.sdf"}, r"/nowhere/world\.sdf: no such file"),
        ({"directives": "package://drake_starnav/worlds/no.sdf"}, r"no\.sdf: no such file"),
        ({"directives": "package://other/no.sdf"}, "allowed: a path, or package://drake_starnav/"),
        ({"goal": []}, r"Model\.goal is \[\]; allowed: finite \[x, y\]"),
        ({"start": []}, r"Model\.start is \[\]; allowed: finite \[x, y, yaw\]"),
        ({"weld": 3}, r"Model\.weld is 3; allowed: true or false"),
    ],
)
def test_bad_input_is_refused(changes: dict, message: str) -> None:
    with pytest.raises(StarnavError, match=message):
        make_world(Model(**{"goal": [1.0, 0.0], **changes}), 0, 0.25)
