"""The written tables agree with the code, and the code documents all that they show."""

import pytest
from pydrake.systems.framework import PortDataType

from drake_starnav.parameters import build, declared
from drake_starnav.scenario.scenario_file import load_scenario
from drake_starnav.scenario.schema import SECTIONS
from drake_starnav.worlds import WORLD_KINDS
from scripts.maintenance import write_tables

SYSTEMS = {type(system).__name__: system for system in write_tables.all_systems()}


@pytest.mark.parametrize("name", write_tables.PAGES)
def test_page_is_up_to_date(name: str) -> None:
    written = (write_tables.ROOT / name).read_text(encoding="utf-8")
    assert written == write_tables.PAGES[name](), (
        f"run python scripts/maintenance/write_tables.py: {name} is out of date"
    )


def test_every_system_of_the_package_is_in_the_table() -> None:
    assert write_tables.system_classes() == {type(s) for s in SYSTEMS.values()}


@pytest.mark.parametrize("name", SYSTEMS)
def test_every_port_is_documented_and_only_ports_are(name: str) -> None:
    system = SYSTEMS[name]
    rows = write_tables.port_rows(system)
    assert len(rows) == system.num_input_ports() + system.num_output_ports()
    for _, port, _, meaning in rows:
        assert meaning, f"{name}: port {port} is not in the docstring"
    texts = list(write_tables.documented_ports(type(system)).values())
    assert set(texts) == {row[-1] for row in rows}, f"{name}: the docstring has ports that do not exist"


@pytest.mark.parametrize("name", SYSTEMS)
def test_the_docstring_has_a_port_diagram_with_every_port(name: str) -> None:
    system = SYSTEMS[name]
    diagram = type(system).__doc__.split("```")[1]
    for direction, port, _, _ in write_tables.port_rows(system):
        if direction == "in":
            assert f"{port.strip('`')} ─" in diagram
        else:
            assert f"> {port.strip('`')}" in diagram or f", {port.strip('`')}" in diagram


@pytest.mark.parametrize("name", [name for name in SYSTEMS if name not in ("NavigationStation", "RobotInterface")])
def test_the_documented_kind_is_the_port_s(name: str) -> None:
    system = SYSTEMS[name]
    ports = [system.get_input_port(k) for k in range(system.num_input_ports())]
    ports += [system.get_output_port(k) for k in range(system.num_output_ports())]
    for port, (*_, carries, meaning) in zip(ports, write_tables.port_rows(system), strict=True):
        if port.get_data_type() == PortDataType.kVectorValued:
            assert "vector" in meaning
        else:
            assert meaning.startswith("abstract, ")
            assert carries.strip("`").replace("object", "any object") in meaning


@pytest.mark.parametrize(("section", "cls"), [*SECTIONS.items(), *(("world", kind) for kind in WORLD_KINDS.values())])
def test_every_parameter_has_a_meaning_and_its_default_is_allowed(section: str, cls: type) -> None:
    rows = write_tables.parameter_rows(cls, section)
    assert [row[0] for row in rows] == [f"`{section}.{field.name}`" for field in declared(cls)]
    for name, _, default, allowed, meaning, _ in rows:
        assert len(meaning) > 3, name
        assert default != "``", name
        assert allowed, name
    defaults = {field.name: getattr(cls(), field.name) for field in declared(cls)}
    assert build(cls, defaults, section) == cls()  # every default passes its own check


def test_a_written_default_can_be_set_on_the_command_line() -> None:
    for section, cls in SECTIONS.items():
        for name, _, default, *_ in write_tables.parameter_rows(cls, section):
            scenario = load_scenario("room", overrides=[f"{name.strip('`')}={default.strip('`')}"])
            value = getattr(getattr(scenario, section), name.strip("`").partition(".")[2])
            standard = getattr(cls(), name.strip("`").partition(".")[2])
            assert value == (pytest.approx(standard, rel=1e-5) if isinstance(standard, float) else standard)
