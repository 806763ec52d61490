"""Steps a second of the environments for learning: python -m benchmarks.learning [--several 16] [--rounds 5]

All take turns, with random actions that are drawn beforehand and a new episode where one ends. The CPU time is that of
all processes; on an idle machine the rates of several environments tell how many cores they use.
"""

import argparse
import time
from collections.abc import Sequence
from pathlib import Path

import gymnasium
from gymnasium.vector import AsyncVectorEnv, VectorEnv

from drake_starnav.evaluation.summary import markdown_table
from drake_starnav.gym import NavigationVectorEnv

ACTIONS = 100
"""Steps of a round."""


class Stepped:
    """Environments that take turns with others."""

    def __init__(self, kind: str, mode: str, count: int, shield: bool) -> None:
        name = f"drake_starnav.gym:starnav/{kind}-v0"
        self._env: VectorEnv = gymnasium.make_vec(name, count, mode, shield=shield)
        self._env.action_space.seed(0)
        self._env.reset(seed=0)
        self._actions = [self._env.action_space.sample() for _ in range(ACTIONS)]
        self.steps, self.cpu, self.wall = 0, 0.0, 0.0

    def turn(self, counts: bool) -> None:
        """Take a round of steps; it is measured if it counts."""
        before = self._spent(), time.perf_counter()
        for actions in self._actions:
            self._env.step(actions)
        if counts:
            self.steps += ACTIONS * self._env.num_envs
            self.cpu += self._spent() - before[0]
            self.wall += time.perf_counter() - before[1]

    def _spent(self) -> float:
        """CPU time of this process and those of the environments, s."""
        own = self._env.unwrapped
        processes = own.processes if isinstance(own, AsyncVectorEnv | NavigationVectorEnv) else []
        files = [Path(f"/proc/{process.pid}/schedstat") for process in processes]
        return time.process_time() + sum(1e-9 * int(file.read_text().split()[0]) for file in files)

    def close(self) -> None:
        """End it."""
        self._env.close()


def measure(several: int, rounds: int) -> str:
    """The table."""
    kinds: Sequence[tuple[str, str, int, bool]] = (
        ("Kinematic", "sync", 1, True),
        ("Kinematic", "sync", 1, False),
        ("Plant", "sync", 1, True),
        ("Plant", "sync", 1, False),
        ("Kinematic", "vector_entry_point", several, True),
        ("Kinematic", "async", several, True),
    )
    stepped = [Stepped(*kind) for kind in kinds]
    for k in range(-1, rounds):
        for each in stepped:
            each.turn(k >= 0)
    rows = []
    for (kind, mode, count, shield), each in zip(kinds, stepped, strict=True):
        each.close()
        what = f"{count} of {kind}, {mode}, {'shield' if shield else 'no shield'}"
        rows.append((what, f"{each.steps / each.cpu:.0f}", f"{each.steps / each.wall:.0f}"))
    return markdown_table(("environments", "steps per CPU second", "steps per second"), rows)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--several", type=int, default=16, help="environments that are stepped at once (default: 16)")
    parser.add_argument("--rounds", type=int, default=5, help=f"of {ACTIONS} steps each (default: 5)")
    options = parser.parse_args()
    print(measure(options.several, options.rounds))


if __name__ == "__main__":
    main()
