"""Many commands at a time: each is decided and driven as if alone, and no contact is missed."""

import numpy as np
import pytest
from hypothesis import given, settings

from drake_starnav.geometry.footprint import disc, footprint
from drake_starnav.lidar.mounts import ON_AXIS
from drake_starnav.scenario.scenario_file import load_scenario
from drake_starnav.simulation.kinematics import KinematicMotion
from drake_starnav.station.model_world import make_world_with_footprints
from drake_starnav.worlds.clearance import body_clearance
from drake_starnav.worlds.world import World
from scripts.experiments.compiled_motion import CompiledMotion, least_clearance
from scripts.experiments.random_drives import PACE, PLANT_ONLY, drawn
from tests.helpers.scans import seeds


@pytest.mark.parametrize("seed", [11, 13, 22, 6])
def test_each_command_is_decided_and_driven_as_one_by_one(seed: int) -> None:
    """By discs and polygons of all bases, with one lidar, with two, and with one of a limited view."""
    case, rng = drawn(seed), np.random.default_rng(seed)
    kept = [text for text in case.overrides if not text.startswith(PLANT_ONLY)]
    scenario = load_scenario(case.scenario, overrides=[*kept, *(f"{key}={value}" for key, value in PACE.items())])
    mounts = tuple(mount._replace(upside_down=False) for mount in case.mounts.values()) or (ON_AXIS,)
    world = make_world_with_footprints(scenario.world, seed, scenario.robot.radius)
    kinds = (KinematicMotion, CompiledMotion)
    single, many = (kind(scenario, world, seed, True, mounts) for kind in kinds)
    most = np.array((*(scenario.robot.max_speed,) * (len(single.twist) - 1), scenario.robot.limits.max_yaw_rate))
    low, high = np.reshape(world.extent, (2, 2))
    places = np.column_stack((rng.uniform(low, high, (4000, 2)), rng.uniform(-np.pi, np.pi, 4000)))
    clear = body_clearance(world, places, disc(scenario.robot.radius))
    beside = places[np.flatnonzero((clear > 0.04) & (clear < 0.1))[0]]
    single.put(beside)
    many.put(beside)
    for step in range(16):
        if step % 4 == 0:
            wish = most * np.sign(rng.uniform(-1.0, 1.0, len(most))) * (*(1.0,) * (len(most) - 1), 0.2)
        poses = many.burst(wish, 24)
        for pose in poses:
            single.drive(wish, 1.0 / PACE["controller.rate"])
            assert single.pose.tolist() == pose.tolist()
        assert single.twist.tolist() == many.twist.tolist()
        if len(poses) < 24:
            single.drive(wish, 1.0 / PACE["controller.rate"])
            assert single.pose.tolist() == many.pose.tolist() and single.twist.tolist() == many.twist.tolist()
        single.look()
        many.look()
    assert many.asked > 100 and many.changed + many.braked > 0


@settings(max_examples=50)
@given(seeds)
def test_the_least_clearance_is_that_of_all_poses(seed: int) -> None:
    rng = np.random.default_rng(seed)
    posts = np.array([(*rng.uniform(-2.0, 2.0, 2), 0.1) for _ in range(5)])
    world = World("posts", (0, 0, 0), (0, 0), cylinders=posts, bounds=(-3.0, -3.0, 3.0, 3.0))
    shape = disc(0.2) if rng.random() < 0.5 else footprint(((-0.3, -0.1), (0.3, -0.1), (0.3, 0.1), (-0.3, 0.1)))
    poses = np.cumsum(0.01 * rng.standard_normal((200, 3)) + 0.02 * rng.uniform(-1.0, 1.0, 3), axis=0)
    clear = body_clearance(world, poses, shape)
    if clear.min() < 0.1:  # else the clearance of polygons is that of discs around them
        least, at = least_clearance(world, poses, shape, np.inf)
        assert least == clear.min() == clear[at]
    assert least_clearance(world, poses, shape, clear.min()) == (clear.min(), -1)
