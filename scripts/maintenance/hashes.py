"""Show that a change keeps the behaviour: python scripts/maintenance/hashes.py --check out/hashes.json

Compares a fixed list of trials, by the hash of each one's plant states, and of short drives with lidars in several
places, by the hash of every array that perception, planner, tracker and shield keep or send, with a file that `--write`
left before the change, on the same machine. Arrays have no names in it, so that renaming keeps it; one that is no
longer kept is reported as gone, one whose numbers differ as new.
"""

import argparse
import dataclasses
import hashlib
import json
import math
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from operator import methodcaller
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
from pydrake.systems.analysis import Simulator

from drake_starnav import load_scenario, make_diagram, parse_scenario, run_trial
from drake_starnav.utils.resources import find_model_path

RECORDS = Path(__file__).resolve().parents[2] / "benchmarks" / "results" / "star.jsonl"
RECORDED, FEW = 20, 5
"""Trials of each recorded scenario, and of each other one."""
FAULTS = (
    ("lidar.noise=0.03",),
    ("localization.drift=0.02",),
    ("drive.delay=0.1",),
    ("drive.slip=0.1",),
    ("lidar.outliers=0.02",),
)
METHODS = ("star_paper", "dsm", "foa", "foa_cluster", "foa_roadmap", "dwa")
DURATION, PERIOD = 3.0, 0.05
"""Of each short drive, and between two looks at what is kept in it, s."""
LARGEST = 100_000
"""Arrays of more numbers are stores, in whose unused part anything may stand."""
POSTS = (
    "!Obstacles {start: [0, 0, 0.3], goal: [3, 0], bounds: [-4, -4, 5, 4], cylinders: [[1.2, 0.6, 0.15], "
    "[-1.1, -0.8, 0.2], [0.2, 1.5, 0.1], [2.2, -0.9, 0.3], [-1.5, 1.2, 0.2], [0.3, -1.4, 0.1]]}"
)
FRAMES = {
    "ahead": (0.15, 0.0, 0.0),
    "aside": (0.12, 0.05, 0.2),
    "right": (0.12, -0.12, -0.25 * math.pi),
    "left": (-0.12, 0.12, 0.75 * math.pi),
}
"""Frames of lidars: x, y, yaw on the robot, m and rad."""
WIDE = f"angle_min: {-0.75 * math.pi}, angle_max: {0.75 * math.pi}, beams: 271"
LIDARS = {
    "axis": "[{beams: 360}]",
    "axis, limited": f"[{{{WIDE}}}]",
    "axis, noise": "[{beams: 360, noise: 0.04}]",
    "axis, outliers": "[{beams: 360, outliers: 0.02}]",
    "ahead": "[{beams: 360, frame: ahead}]",
    "aside, limited": f"[{{{WIDE}, frame: aside}}]",
    "corners": f"[{{{WIDE}, frame: right}}, {{{WIDE}, frame: left}}]",
    "corners, rates": f"[{{{WIDE}, frame: right, noise: 0.01}}, {{{WIDE}, frame: left, noise: 0.01, rate: 7}}]",
}
BODIES = {
    "disc": "{}",
    "rectangle": "{footprint: [[0.4, -0.25], [0.4, 0.25], [-0.4, 0.25], [-0.4, -0.25]]}",
    "omnidirectional": "{base: omnidirectional}",
}


class Run(NamedTuple):
    """One trial."""

    scenario: str
    seed: int
    method: str = "star"
    overrides: tuple[str, ...] = ()

    def name(self) -> str:
        """Return its key in the file of hashes."""
        return " ".join((self.scenario, self.method, str(self.seed), *self.overrides))

    def hashes(self) -> list[str]:
        """Return outcome and hash of the trial."""
        scenario = load_scenario(self.scenario, method=self.method, overrides=self.overrides)
        trial = run_trial(scenario, method=self.method, seed=self.seed)
        return [f"{trial.outcome} {trial.state_hash}"]


class ShortDrive(NamedTuple):
    """The first seconds of a drive, of which all arrays are compared."""

    lidars: str
    body: str
    method: str = "star"
    world: str = POSTS
    sections: str = ""

    def name(self) -> str:
        """Return its key in the file of hashes."""
        return " ".join(("arrays", self.lidars, self.body, self.method, self.sections)).strip()

    def hashes(self) -> list[str]:
        """Return the sorted hashes of all arrays that the systems keep in abstract state, or send as twists."""
        text = f"world: {self.world}\nrobot: {BODIES[self.body]}\nlidars: {LIDARS[self.lidars]}\n{self.sections}"
        with TemporaryDirectory() as folder:
            model = Path(folder) / "mounted.urdf"
            frames = [
                f'<frame name="{name}" link="base_link" xyz="{x} {y} 0.1" rpy="0 0 {yaw}"/>'
                for name, (x, y, yaw) in FRAMES.items()
            ]
            urdf = find_model_path("robots", "starbot.urdf").read_text(encoding="utf-8")
            model.write_text(urdf.replace("</robot>", "".join((*frames, "</robot>"))), encoding="utf-8")
            overrides = [] if self.body == "omnidirectional" and "axis" in self.lidars else [f"robot.model={model}"]
            scenario = parse_scenario(text, name="arrays", method=self.method, overrides=overrides)
            diagram = make_diagram(scenario, seed=3)
        simulator, found = Simulator(diagram), set()
        simulator.Initialize()
        for step in range(1, round(DURATION / PERIOD) + 1):
            simulator.AdvanceTo(step * PERIOD)
            context = simulator.get_context()
            kept = [diagram.navigation.read(name, context) for name in ("twist_command", "state")]
            for system in diagram.GetSystems():
                state = system.GetMyContextFromRoot(context).get_abstract_state()
                kept += [state.get_value(k).get_value() for k in range(state.size())]
            found |= {hashlib.sha256(array.tobytes()).hexdigest()[:12] for array in arrays_in(kept)}
        return sorted(found)


def arrays_in(value: Any) -> Iterator[np.ndarray]:
    """Yield all arrays in a value, but for empty ones and stores: in its sequences and fields, and theirs."""
    if isinstance(value, np.ndarray):
        if 0 < value.size <= LARGEST:
            yield value
    elif dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            yield from arrays_in(getattr(value, field.name))
    elif isinstance(value, (list, tuple)):
        for each in value:
            yield from arrays_in(each)


def runs() -> Iterator[Run | ShortDrive]:
    """Yield all trials and short drives."""
    for lidars in LIDARS:
        yield from (ShortDrive(lidars, body) for body in BODIES)
    yield ShortDrive("axis", "disc", "star_paper")
    moving = "obstacles: {max_speed: 0.5}"
    for lidars in ("axis", "corners, rates"):
        yield ShortDrive(lidars, "disc", "star", "!Crowd {moving_obstacles: [6, 6]}", moving)
    with RECORDS.open(encoding="utf-8") as file:
        records = [json.loads(line) for line in list(file)[1:]]
    for scenario in ("forest", "maze", "room"):
        seeds = [record["seed"] for record in records if record["scenario"] == scenario]
        yield from (Run(scenario, seed) for seed in seeds[:RECORDED])
    for number in range(FEW):
        yield Run("barn", number, overrides=(f"world.id={number}",))
        yield Run("crowd_room", number)
        yield Run("forest", number, overrides=FAULTS[number])
    yield from (Run("forest", number, method) for number, method in enumerate(METHODS))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run all; see `--help`. Returns 1 where a hash differs from the file's."""
    parser = argparse.ArgumentParser(description="Compare the hashes of a fixed list of trials and short drives.")
    parser.add_argument("--jobs", type=int, default=1, metavar="N", help="number of processes (default: 1)")
    parser.add_argument("--only", default="", metavar="TEXT", help="only those whose names begin with it")
    goal = parser.add_mutually_exclusive_group(required=True)
    goal.add_argument("--write", type=Path, metavar="FILE", help="write the hashes to a JSON file")
    goal.add_argument("--check", type=Path, metavar="FILE", help="compare with such a file")
    options = parser.parse_args(arguments)
    expected = {} if options.check is None else json.loads(options.check.read_text(encoding="utf-8"))
    listed, found, differing = [run for run in runs() if run.name().startswith(options.only)], {}, 0
    with ProcessPoolExecutor(options.jobs, mp_context=get_context("spawn")) as executor:
        for run, values in zip(listed, executor.map(methodcaller("hashes"), listed), strict=True):
            found[run.name()] = values
            before = set(expected.get(run.name(), ()))
            gone, new = len(before.difference(values)), len(set(values) - before)
            differing += options.check is not None and gone + new > 0
            remark = f": {gone} gone, {new} new of {len(values)}" if options.check is not None and gone + new else ""
            print(f"{run.name()}{remark}", flush=True)
    if options.write is not None:
        options.write.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
        return 0
    print(f"{differing} of {len(found)} differ")
    return 1 if differing else 0


if __name__ == "__main__":
    sys.exit(main())
