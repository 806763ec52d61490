"""The graph of frames that ROS messages describe, and the pose of one frame in another over time, without ROS."""

import functools
import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from drake_starnav.errors import StarnavError

ODOMETRY = "odom"
"""What the name of a frame has in which an odometry is given: its pose in another holds until it is corrected again."""


@dataclass
class Link:
    """The pose of a frame in another over time: rows of time, s, position, m, and quaternion (x, y, z, w).

    Attributes:
        parent, child: names of the frames.
        moves: whether the pose changes.
        holds: whether it holds from one sample to the next, as what corrects an odometry does.
    """

    parent: str
    child: str
    moves: bool
    holds: bool = False
    rows: list[tuple[float, ...]] = field(default_factory=list)

    def at(self, time: float) -> np.ndarray:
        """The pose at a time, interpolated between the samples, as a matrix of shape (4, 4)."""
        table = np.array(self.rows)
        k = int(np.clip(np.searchsorted(table[:, 0], time), 1, len(table) - 1)) if len(table) > 1 else 0
        previous_row, next_row = table[k - 1], table[k]
        if next_row[4:] @ previous_row[4:] < 0.0:
            next_row = np.append(next_row[:4], -next_row[4:])  # the same rotation, by the shorter way
        time_step = next_row[0] - previous_row[0]
        share = min(max((time - previous_row[0]) / time_step, 0.0), 1.0) if time_step > 0.0 else 1.0
        return _matrix(previous_row + (math.floor(share) if self.holds else share) * (next_row - previous_row))


class Turned(NamedTuple):
    """A link in the other direction: the pose of the parent in the child."""

    link: Link

    def at(self, time: float) -> np.ndarray:
        """As `Link.at`."""
        return np.linalg.inv(self.link.at(time))


class Frames:
    """The graph of frames that messages describe: links by the names of parent and child.

    `source` is where they come from, for messages.
    """

    def __init__(self, source: str) -> None:
        self._source = source
        self._links: dict[tuple[str, str], Link] = {}
        self._robot: Link | None = None

    def add(self, child: str, header: Any, transform: Any, *, moves: bool) -> None:
        """A transform of `tf2_msgs/TFMessage`."""
        frame_names = frame_name(header.frame_id), frame_name(child)
        link = self._links.get(frame_names)
        if link is None or (moves and not link.moves):
            link = self._links[frame_names] = Link(*frame_names, moves)
        if moves or not link.moves:
            self._sample(link, header, transform.translation, transform.rotation)

    def add_robot(self, child: str, header: Any, pose: Any) -> None:
        """A pose of the robot, whose frame may be unnamed."""
        if self._robot is None:
            self._robot = Link(frame_name(header.frame_id), frame_name(child), True)
        self._sample(self._robot, header, pose.position, pose.orientation)

    def _sample(self, link: Link, header: Any, p: Any, q: Any) -> None:
        row = seconds(header.stamp), p.x, p.y, p.z, q.x, q.y, q.z, q.w
        if not all(map(math.isfinite, row)):
            raise StarnavError(
                f"{self._source}: the pose of {link.child or 'the robot'} at {row[0]:.3f} s is {row[1:]}; "
                "allowed: finite"
            )
        if link.moves:
            link.rows.append(row)
        else:
            link.rows = [row]

    def chain(self, frame: str) -> list[Link | Turned]:
        """The links from the frame of a lidar up to W: that of the robot's poses, or else the root that moves most."""
        frame_chains = self.ways(frame_name(frame))
        if self._robot is not None:
            if self._robot.child and self._robot.child not in frame_chains:
                if any(not link.moves for link in self._links.values()):
                    warnings.warn(
                        f"{self._source}: no transform leads from {self._robot.child} to the scan's frame {frame}: "
                        "the robot's poses are taken for the lidar's",
                        stacklevel=4,
                    )
                return [self._robot]
            return [*frame_chains[self._robot.child or self._top(frame_name(frame))], self._robot]
        children = {child for _, child in self._links}
        root_chains = [moving_chain for name, moving_chain in frame_chains.items() if name not in children]
        moving_chain = max(root_chains, key=lambda moving_chain: len(_moving(moving_chain)), default=[])
        if not _moving(moving_chain):
            frame_names = ", ".join(sorted({name for _, name in self._links})) or "none"
            raise StarnavError(
                f"{self._source}: no transform that moves leads from the scan's frame {frame} to a fixed one; "
                f"allowed: one of {frame_names}, or a pose_topic"
            )
        for link in _moving(moving_chain):
            link.holds = ODOMETRY in link.child.rpartition("/")[2] and len(_moving(moving_chain)) > 1
        return moving_chain

    def ways(self, frame: str) -> dict[str, list[Link | Turned]]:
        """The links to each frame that a frame is linked with, by the fewest."""
        frame_chains: dict[str, list[Link | Turned]] = {frame: []}
        for name in (queue := [frame]):
            for link in self._links.values():
                next_frame, step = (link.parent, link) if link.child == name else (link.child, Turned(link))
                if name in (link.parent, link.child) and next_frame not in frame_chains:
                    frame_chains[next_frame] = [*frame_chains[name], step]
                    queue.append(next_frame)
        return frame_chains

    def _top(self, frame: str) -> str:
        """The topmost frame that holds a frame fast."""
        parent_frames = {link.child: link.parent for link in self._links.values() if not link.moves}
        seen_frames = {frame}
        while frame in parent_frames and parent_frames[frame] not in seen_frames:
            frame = parent_frames[frame]
            seen_frames.add(frame)
        return frame


def _moving(chain: Sequence[Link | Turned]) -> list[Link]:
    links = [step.link if isinstance(step, Turned) else step for step in chain]
    return [link for link in links if link.moves]


def pose_along(chain: Sequence[Link | Turned], time: float) -> np.ndarray:
    """The pose, shape (4, 4), of the frame in which a chain of links begins in that in which it ends, at a time, s."""
    return functools.reduce(lambda X, link: link.at(time) @ X, chain, np.eye(4))


def span(chain: list[Link | Turned]) -> tuple[float, float]:
    """From when to when all moving links of a chain are known, s, but for those that hold."""
    for link in _moving(chain):
        link.rows.sort()
    times = [(link.rows[0][0], link.rows[-1][0]) for link in _moving(chain) if not link.holds]
    return max(begin for begin, _ in times), min(end for _, end in times)


def _matrix(row: np.ndarray) -> np.ndarray:
    """The homogeneous matrix, shape (4, 4), of a row as in `Link`; a quaternion of zeros turns nothing."""
    transform_matrix = np.eye(4)
    transform_matrix[:3, 3] = row[1:4]
    if row[4:].any():
        transform_matrix[:3, :3] = Rotation.from_quat(row[4:]).as_matrix()
    return transform_matrix


def frame_name(frame: str) -> str:
    """A frame's name without the leading slash that ROS 1 allowed."""
    return frame.removeprefix("/")


def seconds(stamp: Any) -> float:
    """A stamp in seconds."""
    return float(stamp.sec + 1e-9 * stamp.nanosec)
