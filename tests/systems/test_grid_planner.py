"""The plain planner: its ways lead around hits, through what is unknown, and to the goal of a drive."""

import numpy as np
import pytest

from drake_starnav import load_scenario, run_trial
from drake_starnav.baselines.grid_astar import add_hits, plan_on_grid

START, GOAL, RADIUS = np.zeros(2), np.array([3.0, 0.0]), 0.2


def wall(low: float, high: float) -> np.ndarray:
    """Hits on a wall across the way."""
    y = np.arange(low, high, 0.02)
    return np.column_stack((np.full(len(y), 1.5), y))


def test_what_is_unknown_is_free() -> None:
    assert plan_on_grid(np.zeros((0, 2)), START, GOAL, RADIUS).tolist() == [GOAL.tolist()]


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_the_way_leads_around_the_nearer_end_of_a_wall_with_the_radius_between(side: float) -> None:
    hits = side * wall(-3.0, 1.0) * (side, 1.0)
    path = np.vstack((START, plan_on_grid(hits, START, GOAL, RADIUS)))
    line = np.concatenate([np.linspace(a, b, 50) for a, b in zip(path, path[1:], strict=False)])
    gaps = np.linalg.norm(line[:, None] - hits, axis=2).min(axis=1)
    assert gaps.min() > 0.8 * RADIUS
    assert 1.0 < side * line[np.abs(line[:, 0] - 1.5).argmin(), 1] < 1.6


def test_there_is_no_way_into_a_ring() -> None:
    bearings = np.linspace(0.0, 2.0 * np.pi, 200)
    ring = GOAL + 0.8 * np.column_stack((np.cos(bearings), np.sin(bearings)))
    assert len(plan_on_grid(ring, START, GOAL, RADIUS)) == 0


def test_hits_in_the_same_place_are_kept_once() -> None:
    hits = add_hits(np.zeros((0, 2)), wall(-1.0, 1.0), RADIUS)
    assert len(add_hits(hits, wall(-1.0, 1.0), RADIUS)) == len(hits) < len(wall(-1.0, 1.0)) + 1


@pytest.mark.slow
@pytest.mark.parametrize("scenario", ["paper_forest", "paper_maze", "maze"])
def test_it_arrives_behind_our_controller_and_shield(scenario: str) -> None:
    trial = run_trial(load_scenario(scenario, method="grid_astar"), seed=1)
    assert trial.outcome == "reached" and trial.nodes == 0
