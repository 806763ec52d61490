"""The environments of Gymnasium: their interface, their determinism, and the shield."""

import numpy as np
import pytest

from drake_starnav.errors import StarnavError, UnsupportedError
from drake_starnav.scenario.scenario_file import parse_scenario

gymnasium = pytest.importorskip("gymnasium", reason="needs the extra gym")

from gymnasium.utils.env_checker import check_env  # noqa: E402

from drake_starnav.gym import NavigationEnv, NavigationVectorEnv  # noqa: E402

YARD = parse_scenario(
    "world: !Obstacles {cylinders: [[1.4, 0.0, 0.3]], goal: [3.0, 0.0], bounds: [-1, -1.5, 4, 1.5]}", name="yard"
)
AHEAD = np.array([0.8, 0.0], dtype=np.float32)


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("plant", [False, True])
@pytest.mark.parametrize("shield", [False, True])
def test_gymnasium_accepts_it(plant: bool, shield: bool) -> None:
    environment = NavigationEnv("room", shield=shield, plant=plant, render_mode="rgb_array")
    check_env(environment)
    environment.close()


@pytest.mark.parametrize("plant", [False, True])
def test_a_policy_observes_the_twist(plant: bool) -> None:
    environment = NavigationEnv(YARD, plant=plant)
    observation, _ = environment.reset(seed=1)
    assert observation["twist"].tolist() == pytest.approx([0.0, 0.0], abs=1e-3)
    for _ in range(8):
        observation, *_ = environment.step(np.array([0.4, 0.3], dtype=np.float32))
    assert observation["twist"].tolist() == pytest.approx([0.4, 0.3], abs=0.02)
    environment.close()


@pytest.mark.parametrize("plant", [False, True])
def test_a_picture_shows_where_the_robot_is(plant: bool) -> None:
    environment = NavigationEnv(YARD, plant=plant, render_mode="rgb_array")
    environment.reset(seed=1)
    before = environment.render()
    for _ in range(5):
        environment.step(AHEAD)
    after = environment.render()
    assert before.shape == after.shape and before.dtype == np.uint8 and before.shape[2] == 3
    assert (before == environment.render()).all(axis=2).mean() > 0.9 and (before != after).any()
    environment.close()
    assert NavigationEnv(YARD).render() is None
    with pytest.raises(StarnavError, match="render_mode is human; allowed: rgb_array, or None"):
        NavigationEnv(YARD, render_mode="human")


@pytest.mark.parametrize("plant", [False, True])
def test_the_shield_stops_before_an_obstacle_and_without_it_the_robot_hits_it(plant: bool) -> None:
    for shield in (True, False):
        environment = NavigationEnv(YARD, shield=shield, plant=plant)
        environment.reset(seed=1)
        for _ in range(40):
            _, _, terminated, _, info = environment.step(AHEAD)
            if terminated:
                break
        assert (info["outcome"] == "collision") is not shield
        gap = 1.4 - 0.3 - 0.25 - info["pose"][0]
        assert (0.0 < gap < 0.1) if shield else gap < 0.005
        environment.close()


def test_both_kinds_drive_alike() -> None:
    poses = []
    for plant in (False, True):
        environment = NavigationEnv(YARD, plant=plant)
        environment.reset(seed=1)
        for _ in range(10):
            _, _, _, _, info = environment.step(np.array([0.5, 0.6], dtype=np.float32))
        poses.append(info["pose"])
        environment.close()
    assert poses[0] == pytest.approx(poses[1], abs=0.05)


def test_the_goal_is_in_the_robots_frame_and_ends_the_episode() -> None:
    world = YARD.world.make(np.random.default_rng(0), 0.25)
    environment = NavigationEnv(parse_scenario("world: !Obstacles {goal: [1.0, 0.0]}", name="near"))
    observation, _ = environment.reset(seed=1)
    assert world.start == (0.0, 0.0, 0.0)
    assert observation["goal"] == pytest.approx([1.0, 0.0])
    total, terminated = 0.0, False
    while not terminated:
        _, reward, terminated, _, info = environment.step(AHEAD)
        total += reward
    assert info["outcome"] == "reached"
    assert total == pytest.approx(1.0 + info["pose"][0])  # progress, and the bonus


@pytest.mark.parametrize(("shield", "seed"), [(True, 0), (True, 1), (False, 0)])
def test_random_actions_in_forests_touch_nothing_with_the_shield_alone(shield: bool, seed: int) -> None:
    environment, rng, contacts = NavigationEnv("forest", shield=shield), np.random.default_rng(seed), 0
    environment.reset(seed=seed)
    for k in range(1000):
        if k % 10 == 0:  # held, or the robot would hardly leave its place
            action = rng.uniform(environment.action_space.low, environment.action_space.high)
        _, _, terminated, truncated, info = environment.step(action)
        contacts += info["outcome"] == "collision"
        if terminated or truncated:
            environment.reset()
    assert contacts == 0 if shield else contacts > 2


def test_what_the_kinematics_do_not_have_is_refused() -> None:
    for change in ("drive.delay=0.1", "obstacles.max_speed=0.5", "lidar.rolling=true"):
        scenario = parse_scenario("world: !Room {}", name="room", overrides=[change])
        with pytest.raises(UnsupportedError, match=f"{change.partition('=')[0]} is .* with plant=False"):
            NavigationEnv(scenario)
    with pytest.raises(StarnavError, match="no episode; allowed: reset"):
        NavigationEnv("room").step(AHEAD)
    environment = NavigationEnv("room")
    environment.reset(seed=0)
    with pytest.raises(StarnavError, match="action is .*nan.*; allowed: finite"):
        environment.step(np.array([np.nan, 0.0]))


def test_several_lidars_are_no_observation() -> None:
    with pytest.raises(UnsupportedError, match="lidars has 2 entries; allowed: the one lidar"):
        NavigationEnv(parse_scenario("world: !Obstacles {}\nlidars: [{}, {}]", name="two"))


def test_other_bases_have_other_actions() -> None:
    with pytest.raises(UnsupportedError, match="robot.base is car; allowed: differential"):
        NavigationEnv(parse_scenario("world: !Obstacles {}\nrobot: {base: car}", name="car"))


@pytest.mark.parametrize(("count", "processes"), [(4, 2), (3, 2)])
def test_several_in_processes_are_as_those_in_one(count: int, processes: int) -> None:
    def make(mode: str, **settings):
        name = "drake_starnav.gym:starnav/Kinematic-v0"
        return gymnasium.make_vec(
            name, num_envs=count, vectorization_mode=mode, scenario=YARD, shield=False, **settings
        )

    ours, theirs = make("vector_entry_point", processes=processes), make("sync")
    assert ours.action_space == theirs.action_space and ours.observation_space == theirs.observation_space
    actions = np.tile(AHEAD, (count, 1)) * np.linspace(1.0, 0.2, count, dtype=np.float32)[:, None]
    found = [[each.reset(seed=3), *(each.step(actions) for _ in range(20))] for each in (ours, theirs)]
    for mine, other in zip(*found, strict=True):
        np.testing.assert_equal(mine, other)
    assert found[0][-1][4]["outcome"].tolist()[-1] == "" and any(step[2].any() for step in found[0][1:])
    ours.close()
    theirs.close()
    with pytest.raises(StarnavError, match="num_envs is 4, processes 0; allowed: whole numbers > 0"):
        NavigationVectorEnv(4, processes=0)
