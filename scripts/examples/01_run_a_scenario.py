"""Run a scenario from Python: load it, change a parameter, simulate one trial, read the result.

Run: python scripts/examples/01_run_a_scenario.py
"""

import argparse

from drake_starnav import load_scenario, run_trial


def main() -> None:
    """Drive a room twice, with and without a speed limit of half the usual one."""
    for overrides in ([], ["robot.max_speed=0.4"]):
        scenario = load_scenario("room", overrides=overrides)
        trial = run_trial(scenario, seed=1)
        print(f"{scenario.name} at up to {scenario.robot.max_speed:g} m/s: {trial.outcome} in {trial.time_s:.1f} s")
        print(f"  drove {trial.path_length_m:.1f} m; the shortest path there is: {trial.shortest_path_m:.1f} m")
        print(f"  came within {100.0 * trial.min_clearance_m:.1f} cm of an obstacle")


if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter).parse_args()
    main()
