"""The memory of what is drawn agrees with what Meshcat shows."""

import numpy as np
import pytest

from drake_starnav.visualization import meshes
from drake_starnav.visualization.meshcat_stage import MeshcatStage
from drake_starnav.visualization.timeline import Broadcast, Shape, Timeline, Track


def area(points: np.ndarray) -> float:
    """Signed area of a polygon."""
    x, y = points.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


@pytest.fixture
def timeline() -> Timeline:
    return Timeline()


@pytest.fixture
def stage(timeline) -> MeshcatStage:
    return MeshcatStage(timeline, "/starnav", 0.05)


def test_objects_are_there_from_when_they_came_to_when_they_went(stage, timeline) -> None:
    for time in (1.0, 2.0):
        stage.swap("path", meshes.ribbon(np.array([(0.0, 0.0), (time, 0.0)]), 0.1, 0.0), time)
    stage.swap("path", meshes.joined(), 3.0)
    lengths = [
        [shape.points[:, 0].max() for shape in timeline.visible(time).values()] for time in (0.5, 1.0, 1.9, 2.0, 3.0)
    ]
    assert lengths == [[], [1.0], [1.0], [2.0], []]


def test_opacity_glides_between_keyframes(stage, timeline) -> None:
    path = stage.add("regions", meshes.discs(np.zeros((1, 2)), 1.0, 0.0), 1.0, opacity=0.5)
    stage.set_opacity(path, 0.5, 2.0)
    stage.set_opacity(path, 0.1, 3.0)
    (shape,) = timeline.visible(4.0).values()
    assert [shape.value("opacity", time, 1.0) for time in (1.0, 2.5, 4.0)] == pytest.approx([0.5, 0.3, 0.1])


def test_points_colours_and_what_is_never_hidden_are_kept(stage, timeline) -> None:
    stage.add_points("scan", np.array([(1.0, 2.0), (3.0, 4.0)]), 0.0)
    colors = np.array([(0.1, 0.5, 0.9)] * 4)
    stage.add("trail", meshes.ribbon(np.array([(0.0, 0.0), (1.0, 0.0)]), 0.1, 0.0), 0.0, colors=colors)
    scan, trail = timeline.visible(0.0).values()
    assert scan.points == pytest.approx(np.array([(1.0, 2.0), (3.0, 4.0)]))
    assert scan.faces is None and scan.on_top and not trail.on_top
    assert scan.colors[0] == pytest.approx(meshes.LAYERS["scan"].color)
    assert trail.colors == pytest.approx(colors)


@pytest.mark.parametrize(
    ("mesh", "areas"),
    [
        (meshes.fan(np.zeros(2), np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)]), 0.0), [2.0]),
        (meshes.ribbon(np.array([(0.0, 0.0), (2.0, 0.0)]), 0.5, 0.0), [-1.0]),
        (
            meshes.ribbon(np.array([(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)]), 1.0, 0.0, closed=True),
            [-1, 9],
        ),
        (meshes.discs(np.array([(0.0, 0.0), (5.0, 0.0)]), 1.0, 0.0, sides=4), [2.0, 2.0]),
    ],
    ids=["fan", "ribbon", "closed ribbon", "two discs"],
)
def test_rims_enclose_what_the_triangles_cover(mesh, areas) -> None:
    shape = Shape(mesh.vertices[:, :2], 0.0, mesh.faces, np.zeros((1, 3)))
    found = [area(shape.points[loop]) for loop in shape.loops]
    assert sorted(np.abs(found)) == pytest.approx(sorted(np.abs(areas)))
    corners = mesh.vertices[mesh.faces][..., :2]
    covered = sum(abs(area(triangle)) for triangle in corners)
    assert abs(sum(found)) == pytest.approx(covered)  # inner rims count against outer ones


def test_deleting_a_folder_leaves_its_neighbours(stage, timeline) -> None:
    stage.add_points("scan", np.zeros((1, 2)), 0.0)
    stage.add_points("frontiers/covered", np.zeros((1, 2)), 0.0)
    timeline.Delete("/starnav/frontiers")
    assert len(timeline.visible(0.0)) == 1
    timeline.Delete("/starnav")
    assert timeline.visible(0.0) == {}


def test_keyframes_may_come_in_any_order_and_the_last_of_a_time_counts() -> None:
    track = Track()
    for time, value in ((2.0, 4.0), (0.0, 0.0), (1.0, 9.0), (1.0, 2.0)):
        track.set(value, time)
    assert [track.at(time) for time in (-1.0, 0.5, 1.0, 1.5, 3.0)] == [0.0, 1.0, 2.0, 3.0, 4.0]


def test_a_tee_tells_each() -> None:
    first, second = [], []
    Broadcast(first, second).append(3)
    assert (first, second) == ([3], [3])
