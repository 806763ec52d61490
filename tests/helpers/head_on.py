"""Something comes head on at a robot that sees it too late, faster than it drives."""

import json
from pathlib import Path

from drake_starnav.scenario.scenario_file import parse_scenario
from drake_starnav.scenario.schema import Scenario


def head_on(folder: Path, max_speed: float) -> Scenario:
    """The scenario, with its worlds in a file of the folder, for a robot of some speed, m/s."""
    content = {
        "meta": {"start": [0, 0, 0], "goal": [6, 0]},
        "worlds": [{"id": 0, "plugins": ["a"], "walls": []}],
        "trajectories": {"a": {"total": 10.0, "keys": [[0.0, 4.0, 0.0], [10.0, -16.0, 0.0]]}},
    }
    (folder / "worlds.json").write_text(json.dumps(content))
    text = f"world: !DynaBarn {{file: {folder / 'worlds.json'}}}\nrobot: {{max_speed: {max_speed}}}\n"
    text += "lidar: {range_max: 0.6}\n"
    return parse_scenario(text, name="head on", method="foa_roadmap")
