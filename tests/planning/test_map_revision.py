"""Old regions yield to new scans where they disagree, and only there."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_starnav.planning.grid import Coverage
from drake_starnav.planning.map_revision import (
    CONTRADICTION,
    find_consistent_regions,
    find_mappable_hits,
    forget_contradicted,
    measure_share_seen_through,
)
from drake_starnav.planning.parameters import PlannerParameters
from drake_starnav.planning.roadmap import StarRoadmap, add_node, replace_regions
from drake_starnav.surroundings.star_region import clear_region, cut_back
from drake_starnav.worlds.world import World
from tests.helpers.scans import MARGINS, RADIUS, cast, explored, noisy, observed, seeds, segment_distance, wandered

DROPPING = dataclasses.replace(MARGINS, drop_seen_through=True)
WALLS = (-3.0, -2.0, 3.0, 2.0)
ROOM = World("room", (0, 0, 0), (0, 0), cylinders=[(1.0, 0.8, 0.3)], bounds=WALLS)
PLACES = np.array([(-1.5, 0.0), (0.0, 0.0), (1.0, -0.5)])
HERE = np.array((0.5, -0.2, 0.3))


def reconcile(roadmap, observation, margins, cover_radius):
    """The roadmap without what a new scan contradicts."""
    return replace_regions(
        roadmap, find_consistent_regions(roadmap, observation, margins, cover_radius), margins, cover_radius
    )


def shifted(roadmap, offset):
    """A roadmap built with the robot's estimated pose off by `offset`."""
    out = StarRoadmap.empty(PlannerParameters(), RADIUS)
    for node in roadmap.nodes:
        out = add_node(out, observed(node.scan, node.pose + (*offset, 0.0)), DROPPING, RADIUS)
    return out


def seen_at(world, pose, time, rng=None):
    """What is observed at a pose and a time; with noise, if there is a generator."""
    scan = cast(world, pose) if rng is None else noisy(cast(world, pose), 0.01, rng)
    return observed(dataclasses.replace(scan, time=float(time)), pose)


@given(seeds)
def test_of_what_stands_no_hit_is_forgotten(seed):
    """Nor of posts that the beams of later scans miss."""
    world, roadmap = wandered(seed, nodes=4)
    rng = np.random.default_rng(seed)
    posts = [(*rng.uniform(-2.0, 2.0, 2), 0.004) for _ in range(10)]
    world = dataclasses.replace(world, cylinders=(*world.cylinders, *posts))
    seen = tuple(seen_at(world, node.pose, k, rng) for k, node in enumerate(roadmap.nodes))
    assert forget_contradicted(seen, seen, RADIUS) is seen


@pytest.mark.parametrize("turned", [0.0, 1.0, -2.5])
def test_hits_are_forgotten_that_later_scans_alone_saw_through(turned):
    door = np.array([(0.4, -1.0), (0.5, -1.0), (0.5, 1.0), (0.4, 1.0)])
    shut, place = dataclasses.replace(ROOM, cylinders=(), polygons=(door,)), np.array((-1.0, 0.3, 0.0))
    free = dataclasses.replace(shut, polygons=())
    before, now = seen_at(shut, place, 0.0), np.array((-0.5, -0.6, turned))
    after = seen_at(free, now, 1.0)
    (left,) = forget_contradicted((before,), (after,), RADIUS)
    hits = find_mappable_hits(left)[0]
    assert 0 < len(hits) < len(find_mappable_hits(before)[0]) and (np.abs(hits) > (2.9, 1.9)).any(axis=1).all()
    assert forget_contradicted((after,), (before,), RADIUS)[0] is after


@given(seeds)
def test_where_nothing_has_moved_no_node_is_dropped(seed):
    world, roadmap = wandered(seed, nodes=4, margins=DROPPING)
    pose = roadmap.nodes[0].pose
    assert len(reconcile(roadmap, observed(cast(world, pose), pose), DROPPING, RADIUS)) == len(roadmap)


@given(seeds)
def test_a_small_error_of_the_pose_drops_no_node(seed):
    world, roadmap = wandered(seed, nodes=4, margins=DROPPING)
    rng = np.random.default_rng(seed)
    angle = rng.uniform(-np.pi, np.pi)
    moved = shifted(roadmap, (0.04 * np.cos(angle), 0.04 * np.sin(angle)))
    pose = roadmap.nodes[0].pose
    assert len(reconcile(moved, observed(cast(world, pose), pose), DROPPING, RADIUS)) >= len(moved) - 1


@given(seeds)
def test_a_cut_region_is_clear_of_the_new_hits(seed):
    world, roadmap = wandered(seed, nodes=3, margins=DROPPING)
    moved = shifted(roadmap, (0.2, 0.1))
    pose = roadmap.nodes[0].pose
    scan = cast(world, pose)
    for region in moved.regions:
        if np.hypot(*(scan.points(pose) - region.center).T).min() < RADIUS + region.margin:
            continue  # its centre is no place for the robot: from there all ways out are ways away
        values = cut_back(region, *find_mappable_hits(observed(scan, pose)), RADIUS + region.margin)
        assert (values <= region.free_range).all()
        angle = region.bearing_0 + 2.0 * np.pi / len(values) * np.arange(len(values))
        tips = region.center + values[:, None] * np.column_stack((np.cos(angle), np.sin(angle)))
        tips = tips[values > 0.0]
        away = segment_distance(scan.points(pose)[None], region.center, tips[:, None])
        assert away.size == 0 or away.min() >= RADIUS + region.margin - 1e-9


@pytest.mark.parametrize("offset", [(0.3, 0.0), (-0.2, 0.25), (0.5, 0.3)])
def test_a_drifted_map_yields_to_the_latest_scan(offset):
    roadmap = shifted(explored(ROOM, PLACES), offset)
    seen = observed(cast(ROOM, HERE), HERE)
    found = reconcile(roadmap, seen, DROPPING, RADIUS)
    assert len(found) < len(roadmap)
    for region in found.regions:
        radius = RADIUS + region.margin - CONTRADICTION * RADIUS
        slack = region.free_range - cut_back(region, *find_mappable_hits(seen), radius)
        assert slack.max() <= CONTRADICTION * RADIUS
    # ghosts of the old walls are gone with their nodes
    ahead = HERE[:2] + np.array([(0.0, 0.0), (-0.3, 0.2), (0.3, -0.2)])
    assert (found.grid.distance(ahead) > RADIUS).all()


def test_a_new_obstacle_cuts_a_region_back_and_keeps_the_rest():
    empty = dataclasses.replace(ROOM, cylinders=[])
    roadmap = explored(empty, PLACES[:1])
    pose = np.array((-1.5, 0.0, 0.0))
    found = reconcile(roadmap, observed(cast(ROOM, pose), pose), DROPPING, RADIUS)
    assert len(found) == 1
    before, after = roadmap.regions[0], found.regions[0]
    inside = np.array([(1.0, 0.8), (0.9, 0.5)]), np.array([(-2.0, 1.0), (0.0, -1.0)])
    assert before.contains(inside[0]).all() and not after.contains(inside[0]).any()
    assert after.contains(inside[1]).all()


def test_nodes_seen_through_are_kept_if_the_pose_is_exact():
    posts = dataclasses.replace(ROOM, cylinders=[(x, y, 0.15) for x in (-1.0, -0.3, 0.4) for y in (-1.2, 1.2)])
    roadmap = explored(posts, PLACES[:1])
    through = observed(cast(dataclasses.replace(ROOM, cylinders=[]), HERE), HERE)
    trusting = MARGINS
    assert measure_share_seen_through(roadmap.nodes[0], through, CONTRADICTION * RADIUS) > 0.1
    assert reconcile(roadmap, through, trusting, RADIUS) is roadmap
    assert len(reconcile(roadmap, through, DROPPING, RADIUS)) == 0


@pytest.mark.parametrize("pose_errs", [False, True])
def test_hits_of_dropped_nodes_are_forgotten_only_where_the_pose_may_err(pose_errs):
    """Behind a wall with a door stands a post that only the node in the doorway has seen."""
    walls = [[(0.5, low), (0.6, low), (0.6, high), (0.5, high)] for low, high in ((-2.0, 0.5), (1.5, 2.0))]
    world = dataclasses.replace(ROOM, cylinders=[(2.0, -1.2, 0.2)], polygons=walls)
    margins = dataclasses.replace(MARGINS, drop_seen_through=pose_errs)
    doorway = np.array((0.55, 1.0))
    roadmap = explored(world, np.array([(-1.5, 0.0), doorway]), margins)
    post = find_mappable_hits(roadmap.nodes[1])[0]
    post = post[np.hypot(*(post - (2.0, -1.2)).T) < 0.25]
    assert len(post) > 3 and (roadmap.grid.distance(post) < 0.05).all()
    after = replace_regions(roadmap, [roadmap.regions[0], None], margins, RADIUS)
    assert len(after) == 1
    assert ((after.grid.distance(post) < 0.05) == (not pose_errs)).all()


@settings(max_examples=20)
@given(seeds, st.sampled_from((0.8, 1.0)))
def test_a_revision_equals_a_roadmap_made_anew(seed, kept):
    """Of regions cut back at random and without some nodes; and again after one more."""
    rng = np.random.default_rng(seed)
    _, roadmap = wandered(seed, nodes=8)
    for _ in range(2):
        places, more = rng.uniform(-2.0, 2.0, (2, 2)), roadmap.nodes[-1]
        regions = [
            clear_region(region, places, RADIUS + region.margin) if rng.random() < 0.5 else region
            for region in roadmap.regions
        ]
        regions = [region if rng.random() < kept else None for region in regions]
        found = replace_regions(roadmap, regions, MARGINS, RADIUS)
        anew = StarRoadmap(
            dataclasses.replace(roadmap.grid, coverage=Coverage())
        )  # in which all hits are stamped already
        for node, region in zip(roadmap.nodes, regions, strict=True):
            if region is not None:
                anew = add_node(anew, dataclasses.replace(node, region=region), MARGINS, RADIUS)
        np.testing.assert_array_equal(found.edges, anew.edges)
        for ours, theirs in zip(found.union, anew.union, strict=True):
            np.testing.assert_array_equal(ours.reshape(-1), theirs.reshape(-1))
        roadmap = add_node(found, observed(more.scan, more.pose), DROPPING, RADIUS)
