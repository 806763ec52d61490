"""The command `margins`: the error budget of a scenario, and the margins that follow from it."""

import argparse

from drake_starnav.cli.options import REACHED, Command, add_overrides, add_scenario


def _add_options(parser: argparse.ArgumentParser) -> None:
    add_scenario(parser)
    add_overrides(parser)


def _work(options: argparse.Namespace) -> int:
    from drake_starnav.loading import load_scenario
    from drake_starnav.scenario.error_budget import SYMBOLS, TERMS, error_budget
    from drake_starnav.scenario.margins import derive_margins
    from drake_starnav.station.navigation_station import NavigationStation
    from drake_starnav.worlds import World

    scenario = load_scenario(options.scenario, overrides=options.overrides)
    mounts = NavigationStation(World("empty", (0.0, 0.0, 0.0), (1.0, 0.0)), scenario).robot_interface.mounts
    budgets = [error_budget(scenario, *each) for each in zip(mounts, scenario.all_lidars, strict=True)]
    budget = max(budgets, key=lambda each: each.total)
    for term, value in zip(TERMS, budget.terms, strict=True):
        print(f"{1e3 * value:8.2f} mm  {term.text}: {term.meaning}")
    print(f"{1e3 * budget.total:8.2f} mm  the sum, which is the safety margin\n")
    for name, value in budget.symbols.items():
        print(f"{value:11.6g}  {name} = {SYMBOLS[name].text}: {SYMBOLS[name].meaning}")
    print()
    for name, value in vars(derive_margins(scenario, mounts)).items():
        print(f"{str(round(value, 6) if isinstance(value, float) else value):>11}  {name}")
    return REACHED


margins = Command(
    "margins",
    "Print the error that a scenario's margins allow for, term by term, and these margins.",
    _add_options,
    _work,
)
