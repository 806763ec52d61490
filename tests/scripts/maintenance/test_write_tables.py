"""The written tables agree with the code, and the code documents all that they show."""

import dataclasses
from xml.etree import ElementTree

import pytest
from pydrake.systems.framework import PortDataType

from drake_starnav.parameters import build, declared, parameter
from drake_starnav.scenario.scenario_file import load_scenario
from drake_starnav.scenario.schema import SECTIONS
from drake_starnav.scenario.shipped import METHODS
from drake_starnav.worlds import WORLD_KINDS
from scripts.maintenance import draw_diagrams, write_tables

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


@pytest.mark.parametrize("name", SYSTEMS)
def test_the_drawn_diagram_shows_the_ports_there_are(name: str) -> None:
    picture = ElementTree.parse(write_tables.DIAGRAMS / f"{name}.svg")
    shown = [text.text for text in picture.iter("{http://www.w3.org/2000/svg}text")]
    system = SYSTEMS[name]
    ports = [port.strip("`") for _, port, _, _ in write_tables.port_rows(system)]
    assert sorted(shown) == sorted([*ports, name, *([f"name={system.get_name()}"] if system.get_name() else [])]), (
        f"run python scripts/maintenance/draw_diagrams.py: {name}.svg is out of date"
    )


def test_diagrams_are_drawn_alike_in_each_process() -> None:
    first, again = draw_diagrams.graphs(), draw_diagrams.graphs()
    assert first == again
    assert {path.stem for path in write_tables.DIAGRAMS.glob("*.svg")} == set(first)
    assert "drake_starnav." not in "".join(first.values())


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


def test_what_methods_set_is_shown_beside_the_default() -> None:
    head = ("default", *METHODS)
    rows = {name.strip("`"): dict(zip(head, values, strict=True)) for name, *values in write_tables.method_rows()}
    own = {name: {key for key, row in rows.items() if row[name]} for name in METHODS}
    for method, sections in METHODS.items():
        for section, values in sections.items():
            for key, value in values.items():
                assert rows[f"{section}.{key}"][method] == f"`{write_tables.yaml_text(value)}`"
                assert rows[f"{section}.{key}"][method] != rows[f"{section}.{key}"]["default"]
        assert own[method] == {f"{section}.{key}" for section, values in sections.items() for key in values}


def test_cells_keep_their_bars_out_of_the_table() -> None:
    @dataclasses.dataclass(frozen=True)
    class Sample:
        size: float = parameter(1.0, "a | b", unit="m", above=0.0, when="seldom")
        label: str = parameter("x", "a name")
        on: bool = parameter(True, "whether")

    rows = write_tables.parameter_rows(Sample, "sample")
    assert rows == [
        ("`sample.size`", "m", "`1`", "0 < x m", "a | b", "seldom"),
        ("`sample.label`", "", "`x`", "a text", "a name", ""),
        ("`sample.on`", "", "`true`", "true or false", "whether", ""),
    ]
    text = write_tables.table(write_tables.PARAMETER_HEAD, rows).splitlines()
    assert text[0] == "| parameter | unit | default | allowed | meaning | when to change it |"
    assert text[1] == "| --- | --- | --- | --- | --- | --- |"
    assert text[2].endswith("| a \\| b | seldom |")


def test_a_last_column_without_a_word_is_left_out() -> None:
    assert write_tables.table(("name", "note"), [("a", ""), ("b", "")]).splitlines()[0] == "| name |"
    assert write_tables.table(("name", "note"), [("a", ""), ("b", "x")]).splitlines()[0] == "| name | note |"


def test_check_mode_reports_an_outdated_page_and_writes_nothing(tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.setattr(write_tables, "ROOT", tmp_path)
    monkeypatch.setattr("sys.argv", ["write_tables.py", "--check"])
    assert write_tables.main() == 1
    assert "docs/ports.md is out of date" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
    monkeypatch.setattr("sys.argv", ["write_tables.py"])
    assert write_tables.main() == 0
    monkeypatch.setattr("sys.argv", ["write_tables.py", "--check"])
    assert write_tables.main() == 0
