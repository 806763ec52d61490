"""The commands `show_world` and `margins`: a scenario's world, and what its margins allow for, without a run."""

import argparse
from pathlib import Path

from drake_starnav.cli.options import REACHED, Command, add_scenario, check_seed, show_progress_bar
from drake_starnav.errors import StarnavError
from drake_starnav.utils.files import check_outputs, make_file_name


def _add_options(parser: argparse.ArgumentParser) -> None:
    add_scenario(parser)
    parser.add_argument("--seed", type=int, default=0, help="of the world (default: 0)")
    parser.add_argument("--out", type=Path, metavar="FILE", help="a .png (default: out/SCENARIO.png)")


def _show_scenario(options: argparse.Namespace) -> int:
    from drake_starnav.loading import load_scenario
    from drake_starnav.worlds import make_world

    check_seed(options.seed)
    scenario = load_scenario(options.scenario, overrides=options.overrides)
    picture_file = Path("out", f"{make_file_name(scenario.name)}.png") if options.out is None else options.out
    if picture_file.suffix != ".png":
        raise StarnavError(f"--out is {picture_file}; allowed: a file whose name ends in .png")
    check_outputs([picture_file])
    with show_progress_bar(f"{scenario.name} seed {options.seed}"):
        # bad input is reported before Drake is loaded
        make_world(scenario.world, options.seed, scenario.robot.shape, scenario.goals)
        from drake_starnav.navigation.robot import robot_world
        from drake_starnav.simulation.trial import find_omniscient_path
        from drake_starnav.station.navigation_station import NavigationStation
        from drake_starnav.visualization.world_figure import write_png

        world = robot_world(scenario, options.seed)
        found_path = find_omniscient_path(world, scenario.robot.shape)
        length = "no shortest path" if found_path is None else f"shortest path {found_path[0]:.2f} m"
        title = f"{scenario.name} · seed {options.seed} · {length}"
        NavigationStation(world, scenario)  # it warns of what lidars do not see
        write_png(world, scenario, None if found_path is None else found_path[1], title, picture_file)
    moving = f", {len(world.moving_obstacles)} that move" if len(world.moving_obstacles) else ""
    print(f"{title}\nobstacles: {len(world.discs)} round, {len(world.polygons)} polygons{moving}\nwrote {picture_file}")
    return REACHED


show_world = Command(
    "show_world",
    "Draw a scenario's world with zones, start, goal, shortest path and the paths of moving obstacles.",
    _add_options,
    _show_scenario,
)


def _print_margins(options: argparse.Namespace) -> int:
    from drake_starnav.loading import load_scenario
    from drake_starnav.navigation.robot import robot_mounts
    from drake_starnav.scenario.error_budget import SYMBOLS, TERMS, evaluate_error_budget
    from drake_starnav.scenario.margins import derive_margins

    scenario = load_scenario(options.scenario, overrides=options.overrides)
    mounts = robot_mounts(scenario)
    budgets = [evaluate_error_budget(scenario, *each) for each in zip(mounts, scenario.all_lidars, strict=True)]
    budget = max(budgets, key=lambda each: each.total)
    counting_terms = [(term, value) for term, value in zip(TERMS, budget.terms, strict=True) if value > 0.0]
    for term, value in counting_terms:
        print(f"{1e3 * value:8.2f} mm  {term.text}: {term.meaning}")
    print(f"{0.0:8.2f} mm  the other {len(TERMS) - len(counting_terms)} terms that SAFETY.md lists")
    derived_margins = vars(derive_margins(scenario, mounts))
    print(f"{1e3 * budget.total:8.2f} mm  the sum, which is the safety margin")
    print(f"{1e3 * derived_margins['thinnest']:8.2f} mm  the thinnest obstacle that is certain to be seen\n")
    for name, value in budget.symbols.items():
        print(f"{value:11.6g}  {name} = {SYMBOLS[name].text}: {SYMBOLS[name].meaning}")
    print()
    retention = {f"retention.{name}": value for name, value in derived_margins.pop("retention")._asdict().items()}
    for name, value in {**derived_margins, **retention}.items():
        print(f"{str(round(value, 6) if isinstance(value, float) else value):>11}  {name}")
    return REACHED


margins = Command(
    "margins",
    "Print the error that a scenario's margins allow for, term by term, and these margins.",
    add_scenario,
    _print_margins,
)
