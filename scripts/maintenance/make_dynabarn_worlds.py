"""Write a file of worlds of the DynaBARN benchmark's kind, such as the shipped models/worlds/dynabarn_like.json."""

import argparse
import json
from pathlib import Path

from drake_starnav.utils.files import check_writable, write_text
from drake_starnav.worlds.generators.dynabarn_like import GOAL, START, dynabarn_like


def file_text(count: int, seed: int) -> str:
    """The text of a file with worlds 0 to `count` - 1 and their trajectories, a line for each."""
    meta = {
        "source": f"scripts/maintenance/make_dynabarn_worlds.py --worlds {count} --seed {seed}",
        "units": "metres, radians, seconds",
        "start": list(START),
        "goal": list(GOAL),
    }
    worlds, trajectories = [], []
    for number in range(count):
        world, crossings = dynabarn_like(number, seed)
        worlds.append(json.dumps(world))
        trajectories += [f"{json.dumps(name)}: {json.dumps(crossing)}" for name, crossing in crossings.items()]
    return (
        f'{{"meta": {json.dumps(meta)}, "worlds": [\n' + ",\n".join(worlds) + "\n],"
        '"trajectories": {\n' + ",\n".join(trajectories) + "\n}}\n"
    )


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
