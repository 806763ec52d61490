"""Margins, ranges and smoothing that follow from what a scenario declares, narrower as well as wider."""

import dataclasses
import math

from drake_starnav.control import ControllerParameters
from drake_starnav.errors import StarnavError
from drake_starnav.planning import PlannerParameters
from drake_starnav.scenario.error_budget import SAMPLED, Declared, error_budget
from drake_starnav.scenario.schema import Scenario

NOMINAL_NOISE = 0.01
"""Range noise that the steps within a surface allow for without slack, m."""
SMOOTHED_DEVIATIONS = 3.0
"""Smoothing may move ranges by this many standard deviations of the noise beyond the nominal."""
NOISE_PER_DEGREE = 0.015
"""The certificate smooths over a degree to each side per so much noise, m; the margin covers what corners lose."""
FINE_ENOUGH = 0.5
"""The certificate does not smooth over less than this share of a beam: the next beam would cut corners too much."""
AVERAGED_NOISE = 0.04
"""From this noise on ranges are also averaged: the nearest hit of several scans would close passable gaps, m."""
LARGEST_MARGIN = 0.5
"""Safety margins are no wider than this, m."""


def with_margins(scenario: Scenario) -> tuple[PlannerParameters, ControllerParameters]:
    """The scenario's parameters of planner and controller, with all that is derived.

    The safety margin is the `error_budget`. The safety star reaches farther than the robot needs to stop. Where the
    localization is not exact, nodes whose hits a new scan sees through are discarded. Noise is smoothed; from
    AVERAGED_NOISE on, ranges are averaged over the remembered scans.

    Raises:
        StarnavError: the margin would be too wide.
    """
    given, lidar = Declared.of(scenario), scenario.lidar
    margin = error_budget(given)
    if margin > LARGEST_MARGIN:
        raise StarnavError(
            f"what is declared of lidar, localization, drive and robot gives a safety margin of {margin:.3g} m; "
            f"allowed: at most {LARGEST_MARGIN:g} m"
        )
    width = math.radians(lidar.noise / NOISE_PER_DEGREE) / lidar.angle_increment
    planner = dataclasses.replace(
        scenario.planner,
        margin=margin + scenario.planner.comfort,
        least_margin=margin - SAMPLED,  # regions are not motions that are sampled
        smoothing_slack=SMOOTHED_DEVIATIONS * max(lidar.noise - NOMINAL_NOISE, 0.0),
        drop_seen_through=not scenario.localization.exact,
    )
    controller = dataclasses.replace(
        scenario.controller,
        safety_margin=margin,
        safety_range=given.safety_range,
        smoothed_beams=math.ceil(width - 1e-9) if width >= FINE_ENOUGH else 0,
        average_scans=lidar.noise >= AVERAGED_NOISE,
    )
    return planner, controller
