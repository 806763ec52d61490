"""What a navigator makes of drivers that lie: after how long it brakes, how far the robot drives on, and what it says.

The robot does exactly what it is told, at 0.75 to 0.8 m/s, in the forests of some seeds; each fault of
tests/helpers/driver_faults.py begins after 1.6 s and lasts; in the last rows the ground gives
less than the wheels turn. What is not noticed within 5 s has no row.

Run: python scripts/experiments/driver_faults.py [--seeds 3]
"""

import argparse
import re

import numpy as np

from drake_starnav import load_scenario
from drake_starnav.runtime import Navigator
from tests.helpers.bare_robot import Slipping
from tests.helpers.driver_faults import BEGIN, FAULTS, Faults, driven

SHARES = {"slips_by_20_percent": 0.8, "slips_by_30_percent": 0.7, "wheels_spin": 0.0}
"""Of the wheels' way that the ground gives."""
LASTS = 5.0
"""How long a fault is watched, s."""


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=3)
    seeds = range(parser.parse_args().seeds)
    scenario = load_scenario("forest")
    navigator = Navigator(scenario, warm=False)
    print("| fault | brakes after, s | drives on, m: median, most | it says |\n| --- | --: | --: | --- |")
    for kind in (*FAULTS, *SHARES):
        ways, times, said = [], [], ""
        for seed in seeds:
            navigator.reset()
            fault = None if kind in SHARES else getattr(Faults(), kind)
            robot = Slipping(scenario, SHARES.get(kind, 1.0), BEGIN, seed=seed)
            driven(navigator, robot, BEGIN)
            commands = driven(navigator, robot, BEGIN + LASTS, fault)
            braked = [command.status != "driving" for command in commands]
            if not any(braked):
                continue
            first = braked.index(True)
            stood = [command.status for command in commands[first:]].index("standing")
            ways.append(robot.period * sum(abs(float(each.twist[0])) for each in commands[: first + stood]))
            times.append(first * robot.period)
            said = said or re.sub(r"\d[\d.e+-]*", "...", commands[first].why)
        if not ways:
            continue
        print(f"| {kind.replace('_', ' ')} | {max(times):.2f} | {np.median(ways):.2f}, {max(ways):.2f} | `{said}` |")


if __name__ == "__main__":
    main()
