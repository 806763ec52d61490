"""Margins, smoothing and memory that the declared faults require; with the defaults nothing changes."""

import dataclasses
import math

from drake_starnav.control import ControllerParameters
from drake_starnav.errors import StarnavError
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.planning import PlannerParameters
from drake_starnav.scenario.error_budget import NOMINAL_NOISE
from drake_starnav.scenario.faults import LocalizationParameters

SMOOTHED_DEVIATIONS = 3.0
"""Smoothing may move ranges by this many standard deviations of the noise beyond the nominal."""
NOISE_PER_DEGREE = 0.015
"""The certificate smooths over a degree to each side per so much noise, m; the margin covers what corners lose."""
FINE_ENOUGH = 0.5
"""The certificate does not smooth over less than this share of a beam: the next beam would cut corners too much."""
AVERAGED_NOISE = 0.04
"""From this noise on ranges are also averaged: the nearest hit of several scans would close passable gaps, m."""
LARGEST_ERROR = 0.5
"""Margins may grow by this much, m."""


def with_margins(
    planner: PlannerParameters,
    controller: ControllerParameters,
    error: float,
    localization: LocalizationParameters | None = None,
    lidar: LidarParameters | None = None,
) -> tuple[PlannerParameters, ControllerParameters]:
    """The parameters of planner and controller with an error (m), as from `error_budget`, added to their margins.

    Where the localization is not exact, old regions are compared with new scans. Where the lidar has more than the
    nominal noise, its ranges are smoothed by more, also for the certificate; with much noise they are averaged over
    the remembered scans.

    Raises:
        StarnavError: the error is too large for any margin.
    """
    if localization is not None and not localization.exact:
        contradiction = max(planner.contradiction, PlannerParameters.contradiction)  # at least the default
        planner = dataclasses.replace(planner, contradiction=contradiction, drop_seen_through=True)
    if lidar is not None:
        slack = SMOOTHED_DEVIATIONS * max(lidar.noise - NOMINAL_NOISE, 0.0)
        width = math.radians(lidar.noise / NOISE_PER_DEGREE) / lidar.angle_increment
        beams = math.ceil(width - 1e-9) if width >= FINE_ENOUGH else 0
        planner = dataclasses.replace(planner, smoothing_slack=max(planner.smoothing_slack, slack))
        controller = dataclasses.replace(
            controller,
            smoothed_beams=max(controller.smoothed_beams, beams),
            average_scans=controller.average_scans or lidar.noise >= AVERAGED_NOISE,
        )
    if error == 0.0:
        return planner, controller
    if error > LARGEST_ERROR:
        raise StarnavError(
            f"what is declared of lidar, localization and drive adds {error:.3g} m to the margins; allowed: at most "
            f"{LARGEST_ERROR:g} m"
        )
    return (
        dataclasses.replace(planner, margin=planner.margin + error),
        dataclasses.replace(controller, safety_margin=controller.safety_margin + error),
    )
