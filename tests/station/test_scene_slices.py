import io
import warnings

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.common import MemoryFile
from pydrake.geometry import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    HalfSpace,
    InMemoryMesh,
    Mesh,
    MeshcatCone,
    PerceptionProperties,
    ProximityProperties,
    Role,
    SceneGraph,
    Sphere,
)
from pydrake.math import RigidTransform, RotationMatrix
from scipy.spatial.transform import Rotation

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.raycast import Fan
from drake_starnav.station.scene_slices import SceneSlices

FAN = Fan.regular(-np.pi, 2.0 * np.pi / 120, 120)
REACH = 20.0
ALLOWED = 2e-5  # m: the scan plane is rounded to 1e-6 in direction and height, over distances up to 6 m

# A five-pointed star prism: not convex, closed.
_POINTS = [(r * np.cos(a), r * np.sin(a)) for a, r in zip(np.arange(10) * np.pi / 5, [1.0, 0.4] * 5, strict=True)]
STAR = "".join(f"v {x} {y} {z}\n" for z in (-0.5, 0.5) for x, y in _POINTS) + "".join(
    f"f {k + 1} {(k + 1) % 10 + 1} {(k + 1) % 10 + 11} {k + 11}\n" for k in range(10)
)


def star(scale=1.0):
    return Mesh(InMemoryMesh(mesh_file=MemoryFile(contents=STAR, extension=".obj", filename_hint="star")), scale)


class Scene:
    """A SceneGraph with its context, for tests."""

    def __init__(self, *shapes, moving=(), role=Role.kProximity):
        self.graph = SceneGraph()
        self.source = self.graph.RegisterSource("test")
        self.role = role
        for shape, X_WG in shapes:
            self.add(shape, X_WG)
        self.frames = []
        for shape, X_FG in moving:
            frame = self.graph.RegisterFrame(self.source, GeometryFrame(f"frame{len(self.frames)}"))
            name = f"moving{len(self.frames)}"
            self._assign(self.graph.RegisterGeometry(self.source, frame, GeometryInstance(X_FG, shape, name)))
            self.frames.append(frame)
        self.context = self.graph.CreateDefaultContext()
        self.move(*(RigidTransform() for _ in self.frames))

    def add(self, shape, X_WG):
        name = f"shape{self.graph.model_inspector().num_geometries()}"
        self._assign(self.graph.RegisterAnchoredGeometry(self.source, GeometryInstance(X_WG, shape, name)))

    def _assign(self, geometry):
        properties = ProximityProperties() if self.role == Role.kProximity else PerceptionProperties()
        self.graph.AssignRole(self.source, geometry, properties)

    def move(self, *poses):
        value = FramePoseVector()
        for frame, X_WF in zip(self.frames, poses, strict=True):
            value.set_value(frame, X_WF)
        self.graph.get_source_pose_port(self.source).FixValue(self.context, value)

    def query(self):
        return self.graph.get_query_output_port().Eval(self.context)

    def cast(self, X_WS, slices=None):
        ranges = (slices or SceneSlices(self.role)).cast(self.query(), X_WS.GetAsMatrix34(), FAN, REACH)
        return np.where(ranges < REACH, ranges, np.inf)


def random_pose(rng, spread):
    return RigidTransform(RotationMatrix(Rotation.random(rng=rng).as_matrix()), rng.uniform(-spread, spread, 3))


def beams_in(X_GS):
    directions = np.column_stack((FAN.directions, np.zeros(len(FAN.directions))))
    return X_GS.translation(), directions @ X_GS.rotation().matrix().T


def quadratic(o, d, keep):
    """The interval of t within (o + t d)^T diag(keep) (o + t d) <= 1."""
    a, b, c = (d * d) @ keep, (o * d) @ keep, (o * o) @ keep - 1.0
    root = np.sqrt(np.where(b * b - a * c >= 0.0, b * b - a * c, np.nan))
    return (-b - root) / a, (-b + root) / a


def slab(o, d, half):
    with np.errstate(divide="ignore"):
        t = np.array([(-half - o) / d, (half - o) / d])
    return t.min(axis=0), t.max(axis=0)


def entry(*intervals):
    begin = np.max([i[0] for i in intervals], axis=0)
    end = np.min([i[1] for i in intervals], axis=0)
    return np.where((begin <= end) & (begin >= 0.0), begin, np.inf)


def truth(kind, X_GS, sizes):
    """Where beams first meet a solid, in three dimensions, from outside."""
    o, d = beams_in(X_GS)
    if kind == "sphere" or kind == "ellipsoid":
        return entry(quadratic(o, d, 1.0 / sizes**2))
    if kind == "box":
        return entry(*(slab(o[k], d[:, k], sizes[k]) for k in range(3)))
    radius, half = sizes[0], sizes[2]
    round_ = np.array([1.0, 1.0, 0.0]) / radius**2
    sides = entry(quadratic(o, d, round_), slab(o[2], d[:, 2], half))
    if kind == "cylinder":
        return sides
    ball = np.full(3, 1.0 / radius**2)
    ends = [entry(quadratic(o - (0.0, 0.0, z), d, ball)) for z in (-half, half)]
    return np.min([sides, *ends], axis=0)


def shape_of(kind, sizes):
    shapes = {"sphere": (Sphere, sizes[:1]), "ellipsoid": (Ellipsoid, sizes), "box": (Box, 2.0 * sizes)}
    long = sizes[0], 2.0 * sizes[2]
    shape, arguments = (shapes | {"cylinder": (Cylinder, long), "capsule": (Capsule, long)})[kind]
    return shape(*arguments)


@pytest.mark.parametrize("moves", [False, True])
@pytest.mark.parametrize("kind", ["sphere", "ellipsoid", "box", "cylinder", "capsule"])
@settings(derandomize=True, max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_solids_at_any_pose_have_the_ranges_of_three_dimensions(kind, moves, seed):
    rng = np.random.default_rng(seed)
    sizes = rng.uniform(0.2, 1.0, 3)
    if kind == "sphere":
        sizes[:] = sizes[0]
    X_WG = random_pose(rng, 2.0)
    X_GS = random_pose(rng, 0.0)
    X_GS.set_translation(X_GS.rotation().matrix() @ (rng.uniform(1.8, 4.0), 0.0, rng.uniform(-0.8, 0.8)))
    X_FG = random_pose(rng, 1.0)
    scene = Scene(moving=[(shape_of(kind, sizes), X_FG)]) if moves else Scene((shape_of(kind, sizes), X_WG))
    if moves:
        scene.move(X_WG @ X_FG.inverse())
    ranges = scene.cast(X_WG @ X_GS)
    # The true range lies between those of a slightly smaller and a slightly larger solid, also for grazing beams.
    assert (ranges <= truth(kind, X_GS, sizes - ALLOWED) + 2.0 * ALLOWED).all()
    assert (ranges >= truth(kind, X_GS, sizes + ALLOWED) - 2.0 * ALLOWED).all()


def brute_triangles(vertices, triangles, X_GS):
    """Möller-Trumbore, every beam against every triangle, from either side."""
    o, directions = beams_in(X_GS)
    best = np.full(len(directions), np.inf)
    for k, d in enumerate(directions):
        for a, b, c in vertices[triangles]:
            matrix = np.column_stack((-d, b - a, c - a))
            if abs(np.linalg.det(matrix)) > 1e-12:
                t, u, v = np.linalg.solve(matrix, o - a)
                if t >= 0.0 and u >= 0.0 and v >= 0.0 and u + v <= 1.0:
                    best[k] = min(best[k], t)
    return best


@pytest.mark.parametrize("moves", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_meshes_agree_with_brute_force_over_triangles(seed, moves):
    rng = np.random.default_rng(seed)
    X_WG, X_WS = random_pose(rng, 0.5), random_pose(rng, 0.1)
    X_WS.set_translation(X_WG.translation() + X_WS.rotation().matrix() @ (0.2 if seed == 0 else 2.0, 0.0, 0.1))
    mesh = trimesh.load(io.StringIO(STAR), file_type="obj", process=False)
    exact = brute_triangles(1.5 * mesh.vertices, mesh.faces, X_WG.inverse() @ X_WS)
    X_FG = random_pose(rng, 1.0)
    scene = Scene(moving=[(star(1.5), X_FG)]) if moves else Scene((star(1.5), X_WG))
    if moves:
        scene.move(X_WG @ X_FG.inverse())
    ranges = scene.cast(X_WS)
    assert np.isfinite(exact).sum() > 5
    assert np.allclose(ranges, exact, rtol=0.0, atol=1e-4)


def test_a_convex_shape_is_seen_as_its_hull_and_a_mesh_as_itself(tmp_path):
    path = tmp_path / "star.obj"
    path.write_text(STAR)
    # The first beam looks back at the origin, into the notch between two points of the star.
    X_WS = RigidTransform(RotationMatrix.MakeZRotation(np.pi / 5), np.zeros(3)) @ RigidTransform([3.0, 0.0, 0.0])
    hull = Scene((Convex(str(path), 1.0), RigidTransform())).cast(X_WS)
    mesh = Scene((Mesh(str(path), 1.0), RigidTransform())).cast(X_WS)
    assert mesh[0] == pytest.approx(3.0 - 0.4, abs=1e-5)
    assert hull[0] == pytest.approx(3.0 - np.cos(np.pi / 5), abs=1e-5)


def test_a_half_space_is_a_line_where_the_plane_meets_it():
    X_WG = RigidTransform(RotationMatrix.MakeYRotation(-np.pi / 2), [2.0, 0.0, 0.0])  # a wall at x = 2
    ranges = Scene((HalfSpace(), X_WG)).cast(RigidTransform([0.0, 50.0, 0.3]))
    cosine = FAN.directions[:, 0]
    seen = cosine > 0.2
    assert np.allclose(ranges[seen], 2.0 / cosine[seen], rtol=0.0, atol=1e-8)
    assert np.isinf(ranges[cosine < 0.0]).all()
    level = Scene((HalfSpace(), RigidTransform()))
    assert np.isinf(level.cast(RigidTransform([0.0, 0.0, 0.3]))).all()
    tilted = level.cast(RigidTransform(RotationMatrix.MakeYRotation(np.pi / 6), [0.0, 0.0, 0.3]))
    assert tilted[60] == pytest.approx(0.6, abs=1e-5)  # forward is downward


@settings(derandomize=True, max_examples=10, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_memory_of_slices_changes_nothing(seed):
    rng = np.random.default_rng(seed)
    shapes = [(Cylinder(0.3, 1.0), random_pose(rng, 2.0)), (Box(0.5, 0.3, 0.8), random_pose(rng, 2.0))]
    shapes += [(Cylinder(0.3, 1.0), RigidTransform([float(x), 0.7, 0.0])) for x in range(0, 60, 12)]
    scene = Scene(*shapes, moving=[(Capsule(0.2, 0.8), random_pose(rng, 0.2)), (Sphere(0.4), random_pose(rng, 0.2))])
    kept = SceneSlices(Role.kProximity)
    for k, x in enumerate((0.0, 1.0, 30.0, 16.0, 58.0, 3.0)):  # it drives away, where it sees what was far before
        upright = [RigidTransform(RotationMatrix.MakeZRotation(k), rng.uniform(-2, 2, 3) * (1, 1, 0)) for _ in range(2)]
        scene.move(*(upright if k % 2 else [upright[0], random_pose(rng, 2.0)]))
        X_WS = random_pose(rng, 1.0) if k == 3 else RigidTransform([x, 0.0, 0.2])
        assert np.array_equal(scene.cast(X_WS, kept), scene.cast(X_WS))


def test_a_change_of_geometry_is_seen():
    scene = Scene((Sphere(0.5), RigidTransform([2.0, 0.0, 0.0])))
    slices = SceneSlices(Role.kProximity)
    assert scene.cast(RigidTransform(), slices)[60] == pytest.approx(1.5)
    instance = GeometryInstance(RigidTransform([1.0, 0.0, 0.0]), Sphere(0.5), "late")
    late = scene.graph.RegisterGeometry(
        scene.context, scene.source, scene.graph.model_inspector().world_frame_id(), instance
    )
    scene.graph.AssignRole(scene.context, scene.source, late, ProximityProperties())
    assert scene.cast(RigidTransform(), slices)[60] == pytest.approx(0.5)
    scene.graph.RemoveGeometry(scene.context, scene.source, late)
    assert scene.cast(RigidTransform(), slices)[60] == pytest.approx(1.5)


def test_a_meshcat_cone_is_ignored_with_a_warning():
    scene = Scene(role=Role.kPerception)
    scene.add(MeshcatCone(1.0, 1.0, 1.0), RigidTransform())
    scene.context = scene.graph.CreateDefaultContext()
    with pytest.warns(UserWarning, match="MeshcatCone shape0 is ignored"):
        assert np.isinf(scene.cast(RigidTransform([0.0, 0.0, 0.5]))).all()


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        (
            "gone.obj",
            None,
            r"gone\.obj.* of geometry moving0: no such file; allowed: a readable \.obj, \.gltf, \.vtk file",
        ),
        ("broken.obj", "v 0 0 0\n", r"broken\.obj.* of geometry moving0: .+; allowed"),
        ("room.stl", "solid\n", r"room\.stl.* of geometry moving0: a \.stl file; allowed"),
    ],
)
def test_a_mesh_that_cannot_be_read_is_named(tmp_path, name, content, message):
    if content is not None:
        (tmp_path / name).write_text(content)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        scene = Scene(moving=[(Mesh(str(tmp_path / name), 1.0), RigidTransform())], role=Role.kPerception)
        with pytest.raises(StarnavError, match=message):
            scene.cast(RigidTransform())
