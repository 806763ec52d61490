"""The names of what is shipped are known without the numerics."""

import subprocess
import sys

import pytest
import yaml

from drake_starnav.scenario.scenario_file import find_scenario
from drake_starnav.scenario.shipped import list_scenario_names


def test_help_is_shown_before_anything_heavy_is_imported() -> None:
    code = (
        "import sys; from drake_starnav.cli.simulate import simulate\n"
        "try: simulate(['--help'])\n"
        "except SystemExit: pass\n"
        "print(*sorted({'numba', 'scipy', 'pydrake', 'tqdm'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "exit codes: 0" in done.stdout
    assert done.stdout.splitlines()[-1] == ""


@pytest.mark.parametrize("name", [name for name in list_scenario_names() if not name.startswith("paper_")])
def test_shipped_scenarios_say_what_is_and_not_how_to_drive(name: str) -> None:
    keys = yaml.compose(find_scenario(name).read_text(encoding="utf-8"), yaml.SafeLoader).value
    sections = {key.value for key, _ in keys}
    assert sections <= {"world", "robot", "lidar", "localization", "drive", "obstacles", "simulation", "robots"}
