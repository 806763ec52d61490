"""The contents of a recording over time, kept in memory to draw pictures without a browser."""

import bisect
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from pydrake.geometry import Rgba
from pydrake.perception import PointCloud


@dataclass
class Shape:
    """One flat object of a recording.

    Attributes:
        points: vertices of the triangles, or lone points, shape (n, 2), W, m.
        height: above the floor, m.
        faces: shape (k, 3), indices of points; None for lone points.
        colors: shape (1, 3) for all of it, or (n, 3) for each point; red, green, blue, 0 to 1.
        size: of a lone point, pixels.
        on_top: whether it is never hidden.
        tracks: property -> its keyframes.
    """

    points: np.ndarray
    height: float
    faces: np.ndarray | None
    colors: np.ndarray
    size: float = 0.0
    on_top: bool = False
    tracks: dict[str, "Track"] = field(default_factory=dict)

    @cached_property
    def loops(self) -> list[list[int]]:
        """Boundary loops of the triangles as indices of points; inner loops have the opposite sense."""
        faces = np.zeros((0, 3), int) if self.faces is None else self.faces
        edges = np.vstack((faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]])).tolist()
        inner = {(b, a) for a, b in edges}
        after: dict[int, list[int]] = {}
        for a, b in edges:
            if (a, b) not in inner:
                after.setdefault(a, []).append(b)
        loops = []
        while after:
            loop = [next(iter(after))]
            while loop[-1] in after:
                here = loop[-1]
                loop.append(after[here].pop())
                if not after[here]:
                    del after[here]
            loops.append(loop[:-1])
        return loops

    def value(self, name: str, time: float, otherwise: Any) -> Any:
        """A property at a time."""
        return self.tracks[name].at(time) if name in self.tracks else otherwise


@dataclass
class Track:
    """Keyframes of one property, in the order of their times."""

    times: list[float] = field(default_factory=list)
    values: list[Any] = field(default_factory=list)

    def set(self, value: Any, time: float) -> None:
        """Add a keyframe; it replaces one of the same time."""
        k = bisect.bisect_left(self.times, time)
        if k < len(self.times) and self.times[k] == time:
            self.values[k] = value
        else:
            self.times.insert(k, time)
            self.values.insert(k, value)

    def at(self, time: float) -> Any:
        """The value at a time: numbers are interpolated between keyframes, as in Meshcat; flags switch."""
        k = bisect.bisect_right(self.times, time)
        if k == 0:
            return self.values[0]
        if k == len(self.times) or isinstance(self.values[k - 1], bool):
            return self.values[k - 1]
        share = (time - self.times[k - 1]) / (self.times[k] - self.times[k - 1])
        return (1.0 - share) * self.values[k - 1] + share * self.values[k]


class Timeline:
    """Receives the calls of `MeshcatStage` to Meshcat and stores the flat objects with their keyframes."""

    def __init__(self) -> None:
        self._shapes: dict[str, Shape] = {}

    def SetTriangleMesh(self, path: str, vertices: np.ndarray, faces: np.ndarray, rgba: Rgba) -> None:
        """Add triangles of one colour; vertices have shape (3, n), faces (3, k)."""
        color = np.array([[rgba.r(), rgba.g(), rgba.b()]])
        self._shapes[path] = Shape(vertices[:2].T, vertices[2, 0], faces.T, color)
        self._set(path, "opacity", rgba.a(), 0.0)

    def SetTriangleColorMesh(self, path: str, vertices: np.ndarray, faces: np.ndarray, colors: np.ndarray) -> None:
        """Add triangles whose vertices have colours of shape (3, n), linear light."""
        self._shapes[path] = Shape(vertices[:2].T, vertices[2, 0], faces.T, colors.T ** (1.0 / 2.2))

    def SetObject(self, path: str, cloud: PointCloud, size: float, rgba: Rgba) -> None:
        """Add lone points."""
        color = np.array([[rgba.r(), rgba.g(), rgba.b()]])
        points = np.array(cloud.xyzs().T, dtype=float)
        self._shapes[path] = Shape(points[:, :2], points[0, 2], None, color, size)

    def SetProperty(self, path: str, name: str, value: Any, time_in_recording: float = 0.0) -> None:
        """Set a keyframe of `visible` or of the opacity; other properties hardly matter from above."""
        path = path.removesuffix("/<object>")
        if name == "visible":
            self._set(path, "visible", bool(value), time_in_recording)
        elif name == "material.opacity":
            self._set(path, "opacity", float(value), time_in_recording)
        elif name == "material.depthTest":
            self._shapes[path].on_top = not value

    def Delete(self, path: str) -> None:
        """Remove everything in a folder."""
        self._shapes = {name: shape for name, shape in self._shapes.items() if not f"{name}/".startswith(f"{path}/")}

    def visible(self, time: float) -> dict[str, Shape]:
        """Path -> object of what is visible at a time, s, in the order of their creation."""
        return {path: shape for path, shape in self._shapes.items() if shape.value("visible", time, True)}

    def _set(self, path: str, name: str, value: Any, time: float) -> None:
        self._shapes[path].tracks.setdefault(name, Track()).set(value, time)


class Broadcast:
    """Forwards each call to several receivers, such as Meshcat and a `Timeline`; returns nothing."""

    def __init__(self, *receivers: Any) -> None:
        self._receivers = receivers

    def __getattr__(self, name: str) -> Any:
        methods = [getattr(receiver, name) for receiver in self._receivers]

        def call(*arguments: Any) -> None:
            for method in methods:
                method(*arguments)

        return call
