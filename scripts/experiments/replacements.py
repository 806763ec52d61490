"""Functions that take the place of others in an ablation, and a pool whose workers use them.

A name says where a function is looked up by its caller. Compiled functions do not look anything up: where one calls
what is to be replaced, it is itself replaced by the Python that it is compiled from.
"""

import dataclasses
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor, Future
from contextlib import AbstractContextManager, ExitStack, contextmanager
from typing import Any
from unittest.mock import patch

import numpy as np

from drake_starnav.control.path_following import _follow_guidance, guiding_vector
from drake_starnav.evaluation.workers import Pool
from drake_starnav.lidar.field_of_view import TURN
from drake_starnav.paper.modulation import modulate_vector
from drake_starnav.planning import PlannerInput, PlannerState
from drake_starnav.robot.motion import Actuation
from drake_starnav.safety.shield import ramp_twist
from drake_starnav.surroundings.piecewise_cubic import fit_adaptively
from drake_starnav.surroundings.region_union import RegionUnion
from scripts.experiments.ablate_segments import fit_equal

Replaced = Mapping[str, Any]
"""By dotted name, what takes a function's place."""
SEGMENTS = 16
"""Number of segments of equal length."""
WAY_POINT_REACHED = 0.25
"""A way point this near is reached where the path is not shortened, m."""


def run_replaced(replaced: Replaced, function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a function while others are replaced."""
    with ExitStack() as stack:
        for name, value in replaced.items():
            stack.enter_context(patch(name, value))
        return function(*arguments)


def replacing_pool(pool: Pool, replaced: Replaced) -> Pool:
    """A pool whose workers run each trial with functions replaced."""
    return Pool(lambda: _replacing(pool.make_executor(), replaced), pool.in_flight)


@contextmanager
def _replacing(made: AbstractContextManager[Executor], replaced: Replaced) -> Iterator[Executor]:
    with made as executor:
        yield _ReplacingExecutor(executor, replaced)


class _ReplacingExecutor(Executor):
    """Submits each call with functions replaced."""

    def __init__(self, executor: Executor, replaced: Replaced) -> None:
        self._executor, self._replaced = executor, replaced

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **named: Any) -> Future[Any]:
        return self._executor.submit(run_replaced, dict(self._replaced), function, *arguments, **named)


def interpreted_followed(*arguments: Any) -> None:
    """For `path_following._follow_guidance`: not compiled."""
    _follow_guidance.py_func(*arguments)


def interpreted_guiding_vector(*arguments: Any) -> tuple:
    """For `path_following.guiding_vector`: not compiled."""
    return guiding_vector.py_func(*arguments)


def same_direction(x: float, y: float, ux: float, uy: float, *others: Any) -> tuple[float, float]:
    """For functions of a position or a guiding vector, and a direction, which stays as it is."""
    return ux, uy


def first_argument(first: Any, *others: Any) -> Any:
    """For functions of a state, which stays as it is, or of a path."""
    return first


def nothing(*arguments: Any) -> None:
    """For functions that may find nothing."""
    return


def zero(*arguments: Any) -> float:
    """For functions of a length that may be zero."""
    return 0.0


def uncertified_twist(
    pose: np.ndarray, twist: np.ndarray, desired: np.ndarray, certificates: tuple, actuation: Actuation
) -> tuple[np.ndarray, bool]:
    """For `shield_twist`: whatever is desired, ramped."""
    return ramp_twist(twist, desired, actuation), True


def shortened_range(distance: np.ndarray, disc: tuple) -> tuple:
    """For `compute_disc_range`: ranges less the radius."""
    beams, limit, radius, (margin, _), *_ = disc
    beam = np.rint(TURN / len(limit) * np.arange(len(limit)) / beams.increment).astype(int) % len(distance)
    return np.clip(distance[beam] - radius - margin, 0.0, limit), limit, margin


def two_sided_fit(samples: np.ndarray, lengths: tuple[float, float], one_sided: bool) -> tuple:
    """For `fit_adaptively`: cubics through the samples."""
    return fit_adaptively(samples, lengths, False)


def equal_segments(samples: np.ndarray, lengths: tuple[float, float], one_sided: bool) -> tuple:
    """For `fit_adaptively`: SEGMENTS segments of equal length."""
    fit = fit_equal(samples, SEGMENTS, one_sided)
    return fit.starts, fit.values, fit.slopes


def along_cells(state: PlannerState, check: Any, inputs: PlannerInput) -> PlannerState:
    """For `drop_passed_points`: way points are driven to, whatever is in sight."""
    path = state.route.path
    while len(path) > 1 and np.hypot(*(path[0] - inputs.position)) < WAY_POINT_REACHED:
        path = path[1:]
    return dataclasses.replace(state, route=state.route._replace(path=path))


def paper_direction(x: float, y: float, ux: float, uy: float, regions: RegionUnion, _radius: float) -> np.ndarray:
    """For `modulate_direction`: the paper's sum, normalised."""
    vector = modulate_vector(np.array((x, y)), np.array((ux, uy)), regions)
    length = np.hypot(*vector)
    return vector / length if length > 1e-9 else np.array((ux, uy))
