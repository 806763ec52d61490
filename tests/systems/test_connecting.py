"""Systems are connected by the names of their ports, and told where they do not fit."""

import pytest
from pydrake.common.value import Value
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import ConstantValueSource, ConstantVectorSource, PassThrough

from drake_starnav.errors import StarnavError
from drake_starnav.systems.connecting import add_system, connect_inputs, find_output_port, list_outputs
from drake_starnav.systems.release import release


class Ports(LeafSystem):
    """Input ports of some names and sizes; size 0 is an abstract one."""

    def __init__(self, **sizes: int) -> None:
        super().__init__()
        for name, size in sizes.items():
            if size:
                self.DeclareVectorInputPort(name, size)
            else:
                self.DeclareAbstractInputPort(name, Value[object](1))


def wired(**sizes: int) -> tuple[DiagramBuilder, Ports]:
    builder = DiagramBuilder()
    system = builder.AddSystem(Ports(**sizes))
    source = builder.AddSystem(ConstantVectorSource([1.0, 2.0]))
    other = builder.AddSystem(ConstantVectorSource([3.0, 4.0]))
    if "taken" in sizes:
        builder.Connect(other.get_output_port(), system.GetInputPort("taken"))
    connect_inputs(builder, system, dict.fromkeys(("goal", "taken"), source.get_output_port()), "planner")
    return builder, system


def test_ports_of_known_names_are_connected_and_others_left() -> None:
    builder, system = wired(goal=2, taken=2, other=3)
    context = builder.Build().CreateDefaultContext()
    inside = system.GetMyContextFromRoot(context)
    assert list(system.GetInputPort("goal").Eval(inside)) == [1.0, 2.0]
    assert list(system.GetInputPort("taken").Eval(inside)) == [3.0, 4.0]
    assert not system.GetInputPort("other").HasValue(inside)


@pytest.mark.parametrize(
    "sizes, words",
    [
        ({"goal": 3}, "planner: port goal is a vector of size 3; allowed: a vector of size 2"),
        ({"goal": 0}, "planner: port goal is abstract; allowed: a vector of size 2"),
        ({"goall": 2}, "input port goall is not connected; did you mean goal\\? allowed: goal, taken"),
    ],
)
def test_what_does_not_fit_is_refused(sizes, words) -> None:
    with pytest.raises(StarnavError, match=words):
        wired(**sizes)


def test_the_only_output_may_have_any_name() -> None:
    source = ConstantVectorSource([1.0, 2.0])
    assert find_output_port(source, "twist_command", 2, "controller") is source.get_output_port()
    with pytest.raises(StarnavError, match="output port y0 is a vector of size 2; allowed: a vector of size 5"):
        find_output_port(source, "state", 5, "controller")
    with pytest.raises(StarnavError, match="controller has the output ports none; allowed: one named twist_command"):
        find_output_port(Ports(), "twist_command", 2, "controller")
    abstract = ConstantValueSource(Value[object]("a footprint"))
    assert find_output_port(abstract, "footprint", None, "footprint") is abstract.get_output_port()
    with pytest.raises(StarnavError, match="output port y0 is a vector of size 1; allowed: abstract"):
        find_output_port(ConstantVectorSource([1.0]), "footprint", None, "footprint")
    assert list(list_outputs(source)) == ["y0"]


def test_a_system_is_added_once() -> None:
    builder, system = DiagramBuilder(), PassThrough(2)
    assert add_system(builder, "mine", system, "goal") is system
    assert add_system(builder, "again", system, "goal") is system
    assert system.get_name() == "mine"
    with pytest.raises(StarnavError, match="goal is .room.; allowed: a System of Drake"):
        add_system(builder, "x", "room", "goal")  # type: ignore[arg-type]


def test_a_system_of_a_diagram_that_was_released_is_refused() -> None:
    builder, system = wired()
    release(builder.Build())
    with pytest.raises(StarnavError, match="controller has served for a trial or a diagram that was released; allowed"):
        add_system(DiagramBuilder(), "controller", system, "controller")
