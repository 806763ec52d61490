"""No shape is left out of a plant with no more than a warning, and no inertia replaced without one."""

import pytest
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from drake_starnav.errors import StarnavError
from drake_starnav.models.parser_warnings import refuse_parser_warnings

LINK = '<sdf version="1.7"><model name="m"><link name="l">{}</link></model></sdf>'
INERTIA = '<inertial><mass value="0"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'


def parse(text: str, kind: str) -> None:
    with refuse_parser_warnings("model m"):
        builder = DiagramBuilder()
        plant, _ = AddMultibodyPlantSceneGraph(builder, 0.01)
        Parser(plant).AddModelsFromString(text, kind)


@pytest.mark.parametrize("shape", ["<cone/>", "<polyline><point>0 0</point><height>1</height></polyline>"])
def test_what_matters_is_refused(shape: str) -> None:
    with pytest.raises(StarnavError, match="model m cannot be read: .*; allowed: what Drake's parser reads") as caught:
        parse(LINK.format(f'<collision name="c"><geometry>{shape}</geometry></collision>'), "sdf")
    assert "\n" not in str(caught.value)


def test_an_inertia_that_is_replaced_is_a_warning() -> None:
    with pytest.warns(UserWarning, match="model m: .*inertia"):
        parse(f'<robot name="r"><link name="l">{INERTIA}</link></robot>', "urdf")
