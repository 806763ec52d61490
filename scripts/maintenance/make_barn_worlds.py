"""Write a file of worlds of the BARN benchmark's kind, such as the shipped models/worlds/barn_like.json."""

import argparse
import json
from pathlib import Path

from drake_starnav.scenario import load_scenario
from drake_starnav.utils.files import check_writable, write_text
from drake_starnav.worlds.generators.barn_like import barn_like


def file_text(count: int, seed: int) -> str:
    """The text of a file with worlds 0 to `count` - 1, a line for each, for the robot of the scenario `barn`."""
    radius = load_scenario("barn").robot.radius
    lines = [json.dumps(barn_like(number, seed, radius)) for number in range(count)]
    meta = {
        "source": f"scripts/maintenance/make_barn_worlds.py --worlds {count} --seed {seed}",
        "units": "metres, radians",
        "cylinders": "[x, y, radius] each",
        "start": "[x, y, yaw]",
        "goal": "[x, y]",
        "path_length_official": "of the shortest path of the robot",
    }
    return f'{{"meta": {json.dumps(meta)}, "worlds": [\n' + ",\n".join(lines) + "\n]}\n"


def main() -> None:
    """Write the file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path, help="to write")
    parser.add_argument("--worlds", type=int, default=12, help="how many (default: 12)")
    parser.add_argument("--seed", type=int, default=0, help="of the file (default: 0)")
    options = parser.parse_args()
    check_writable(options.file)
    write_text(options.file, file_text(options.worlds, options.seed))


if __name__ == "__main__":
    main()
