"""Connects systems of the user's by the names of their ports."""

import difflib
from collections.abc import Mapping

from pydrake.systems.framework import DiagramBuilder, InputPort, OutputPort, PortDataType, System

from drake_starnav.errors import StarnavError, said_by, shown
from drake_starnav.systems.release import RELEASED

UNNAMED = frozenset(("y0", "y"))
"""Names of a lone output port that count as none: Drake's default, and that of its `PassThrough`."""
ALIKE = 0.8
"""An unconnected port whose name is this similar to a source's is taken for a slip of the pen."""


def add_system(builder: DiagramBuilder, name: str, system: System, role: str) -> System:
    """The system in the builder: as it is if it is there already, and else added under a name.

    Raises:
        StarnavError: it is no system of Drake, or belongs to another diagram, be it released.
    """
    if not isinstance(system, System):
        raise StarnavError(f"{role} is {shown(system)}; allowed: a System of Drake, e.g. a LeafSystem")
    if hasattr(system, RELEASED):
        raise StarnavError(f"{role} has served for a trial or a diagram that was released; allowed: a new one")
    if system in builder.GetSystems():
        return system
    try:
        return builder.AddNamedSystem(name, system)
    except RuntimeError as error:
        raise StarnavError(f"{role} cannot be added to the builder: {error}; allowed: a system of its own") from None


def connect_inputs(builder: DiagramBuilder, system: System, sources: Mapping[str, OutputPort], role: str) -> None:
    """Connect those input ports of a system that have the names of sources and are not connected yet.

    Its other ports stay as they are; `role` is what messages call it.

    Raises:
        StarnavError: a port has another size or type than the source of its name, or nearly the name of one.
    """
    for index in range(system.num_input_ports()):
        port = system.get_input_port(index)
        if builder.IsConnectedOrExported(port):
            continue
        name = port.get_name()
        if name in sources:
            connect(builder, sources[name], port, role)
        elif similar_names := difflib.get_close_matches(name, sources, n=1, cutoff=ALIKE):
            raise StarnavError(
                f"{role}: input port {name} is not connected; did you mean {similar_names[0]}? allowed: "
                f"{', '.join(sources)}, "
                "or any port that you connected before"
            )


def connect(builder: DiagramBuilder, source: OutputPort, port: InputPort, role: str) -> None:
    """Connect two ports, or raise a `StarnavError` where they do not fit."""
    if _describe_kind(source) != _describe_kind(port):
        raise StarnavError(
            f"{role}: port {port.get_name()} is {_describe_kind(port)}; allowed: {_describe_kind(source)}"
        )
    try:
        builder.Connect(source, port)
    except RuntimeError as error:
        raise StarnavError(f"{role}: port {port.get_name()} cannot be connected: {said_by(error)}") from None


def find_output_port(system: System, name: str, size: int | None, role: str) -> OutputPort:
    """The output port of a name, a vector of that size or abstract (None); a lone one without a name serves as well.

    Raises:
        StarnavError: there is none, or it has another size or type.
    """
    ports = list_outputs(system)
    if name not in ports and not (len(ports) == 1 and ports.keys() <= UNNAMED):
        raise StarnavError(f"{role} has the output ports {', '.join(ports) or 'none'}; allowed: one named {name}")
    port = ports.get(name) or next(iter(ports.values()))
    wanted_kind = "abstract" if size is None else f"a vector of size {size}"
    if _describe_kind(port) != wanted_kind:
        raise StarnavError(f"{role}: output port {port.get_name()} is {_describe_kind(port)}; allowed: {wanted_kind}")
    return port


def list_outputs(system: System) -> dict[str, OutputPort]:
    """The output ports of a system by name."""
    ports = (system.get_output_port(index) for index in range(system.num_output_ports()))
    return {port.get_name(): port for port in ports}


def _describe_kind(port: InputPort | OutputPort) -> str:
    vector = port.get_data_type() == PortDataType.kVectorValued
    return f"a vector of size {port.size()}" if vector else "abstract"
