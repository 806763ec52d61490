"""The written tables agree with the code, and the code documents all that they show."""

import pytest

from drake_starnav.parameters import build, declared
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
