"""The constants that the paper does not print are listed with their values."""

from pathlib import Path

from drake_starnav.baselines.paper import constants

PAGE = Path(__file__).parents[3] / "docs" / "baselines.md"


def test_the_page_lists_each_constant_with_its_value() -> None:
    rows = [line.strip("| ").split(" | ") for line in PAGE.read_text().splitlines() if line.startswith("| `")]
    listed = {cells[0].strip("`"): float(cells[2].split()[0]) for cells in rows if cells[0].strip("`").isupper()}
    assert listed == {name: value for name, value in vars(constants).items() if name.isupper()}
