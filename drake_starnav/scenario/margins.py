"""Margins, ranges and smoothing that follow from what a scenario declares, narrower as well as wider."""

import math
from collections.abc import Mapping, Sequence

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.mounts import ON_AXIS, Mount
from drake_starnav.scenario.error_budget import evaluate_error_budget
from drake_starnav.scenario.schema import Scenario
from drake_starnav.surroundings.margins import Margins, ViewRetention

NOMINAL_NOISE = 0.04
"""Range noise that the steps within a surface allow for without slack, in cover radii of the robot."""
SMOOTHED_DEVIATIONS = 3.0
"""Smoothing may move ranges by this many standard deviations of the noise beyond the nominal."""
NOISE_PER_DEGREE = 0.06
"""The certificate smooths over a degree to each side for this noise, in radii; the margin covers corners' loss."""
FINE_ENOUGH = 0.5
"""The certificate does not smooth over less than this share of a beam: the next beam would cut corners too much."""
AVERAGED_NOISE = 0.16
"""From this noise on, in radii, ranges are also averaged: the nearest hit of several scans would close narrow gaps."""
NOISE_SHARE = 0.75
"""Share of the noise by which the ranges of a past view count as shorter: as the `error_budget` allows for one scan."""
LEAST_EXTENT = 0.2
"""Certified stars reach at least as far, in cover radii: else the robot would hardly move."""
LARGEST_MARGIN = 0.5
"""Safety margins are no wider than this, m."""


def derive_margins(scenario: Scenario, mounts: Sequence[Mount] = ()) -> Margins:
    """What follows from the faults, the robot and the rates that a scenario declares.

    The safety margin is the sum of the `error_budget`. The certified star reaches farther than the robot needs to
    stop. Where the localization is not exact, nodes whose hits a new scan sees through are discarded. Noise is
    smoothed; from AVERAGED_NOISE on, ranges are averaged over the recent scans. Of several lidars the worst counts.
    The region ends where two beams are as far apart as the thinnest obstacle that is declared.

    Without mounts all lidars are on the axis. Too wide a margin, or too small a region, is a `StarnavError`.
    """
    lidars = scenario.all_lidars
    mounts = mounts or (ON_AXIS,) * len(lidars)
    budgets = [evaluate_error_budget(scenario, *each) for each in zip(mounts, lidars, strict=True)]
    safety, noise = max(budget.total for budget in budgets), max(lidar.noise for lidar in lidars)
    if safety > LARGEST_MARGIN:
        raise StarnavError(
            f"what is declared of lidar, localization, drive and robot gives a safety margin of {safety:.3g} m; "
            f"allowed: at most {LARGEST_MARGIN:g} m"
        )
    radius, declared_width = scenario.robot.shape.cover_radius, scenario.obstacles.min_width
    for lidar, budget in zip(lidars, budgets, strict=True):
        least = budget.symbols["g"] * (budget.symbols["r"] + budget.symbols["o"] + LEAST_EXTENT * radius)
        if 0.0 < declared_width < least:
            raise StarnavError(
                f"obstacles.min_width is {declared_width:g} m, with a lidar whose beams are up to "
                f"{math.degrees(lidar.widest_gap):.3g} degrees apart; allowed: at least {least:.3g} m, so that it sees "
                "what is beside the robot, a lidar with more beams, or 0"
            )
    width = max(math.radians(lidar.noise / (NOISE_PER_DEGREE * radius)) / lidar.angle_increment for lidar in lidars)
    return Margins(
        safety=safety,
        preferred=safety + scenario.planner.clearance(radius),
        least=safety - budgets[0].symbols["s"],  # regions are not motions that are sampled
        safety_range=min(budget.symbols["G"] for budget in budgets),
        thinnest=max(budget.symbols["W"] for budget in budgets),
        smoothing_slack=SMOOTHED_DEVIATIONS * max(noise - NOMINAL_NOISE * radius, 0.0),
        smoothed_beams=math.ceil(width - 1e-9) if width >= FINE_ENOUGH else 0,
        average_scans=noise >= AVERAGED_NOISE * radius,
        drop_seen_through=not scenario.localization.exact,
        retention=_derive_view_retention(scenario, budgets[0].symbols),
    )


def _derive_view_retention(scenario: Scenario, symbols: Mapping[str, float]) -> ViewRetention:
    """Return which past views count: those that the `error_budget` allows for, where the pose errs with way or time."""
    oldest_age, localization = symbols["M"] - symbols["T"], scenario.localization
    drift_time = oldest_age if localization.drift > 0.0 else math.inf
    return ViewRetention(
        way=symbols["v"] * drift_time,
        turn=symbols["w"] * drift_time,
        age=oldest_age if localization.jump > 0.0 else math.inf,
        range_error=NOISE_SHARE * max(lidar.noise for lidar in scenario.all_lidars),
    )
