"""A ROS 2 robot for `drive`: scans, odometry, mounts and goal come from its topics, twists go to `cmd_vel`."""

import dataclasses
import math
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from drake_starnav.errors import StarnavError, counted
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.mounts import Mount
from drake_starnav.lidar.transforms import Frames, frame_name, pose_along, seconds
from drake_starnav.runtime.intake import CLOCK, WITHDRAWN, Odometry
from drake_starnav.runtime.log import PLAN_PERIOD, read_plan
from drake_starnav.runtime.loop import Reading
from drake_starnav.runtime.navigator import Command, Navigator
from drake_starnav.runtime.ros2_base import STAMPED, TWIST, make_header, open_middleware
from drake_starnav.runtime.watchdog import Watched, read_ramp
from drake_starnav.scenario.schema import Scenario
from drake_starnav.station.lidar_mounts import find_mount

SCAN, ODOMETRY, TRANSFORMS, POSE = (
    "sensor_msgs/LaserScan", "nav_msgs/Odometry", "tf2_msgs/TFMessage", "geometry_msgs/PoseStamped"
)  # fmt: skip
PATH, MARKERS, EMPTY = "nav_msgs/Path", "visualization_msgs/MarkerArray", "std_msgs/Empty"
DEPTH = {SCAN: 10, ODOMETRY: 100, TRANSFORMS: 100, POSE: 1, EMPTY: 1}
"""Messages that may wait."""
POLL = 0.05
"""Between two looks at what is there, s."""
OLDEST = 1.0
"""A first stamp that is older than this is of another clock, s."""


@dataclass
class Ros2:
    """A robot as of `drake_starnav.runtime`; names of topics that begin without a slash are in the namespace.

    It waits until scans and odometry come and a base listens. Commands go through the watchdog's process. A goal is a
    `PoseStamped` in the odometry's frame; one with an orientation of zeros asks for no heading. An `Empty` on `cancel`
    withdraws it: the robot stops, and stands until another comes.

    Attributes:
        scenario: what is declared of the robot.
        scan: topic of each lidar, in the order of the declared ones.
        odom, cmd_vel, goal, cancel: topics. `cmd_vel` has a header if the base expects one.
        tf_static: topic of the transforms that say where the lidars are; if nobody publishes it, the model does.
        namespace: as `/robot_1`.
        domain, interface: as of `ros2_base.middleware`.
        wait: how long it waits for what is missing, s.
        mounts: of the lidars; None: as the model says.
        watched: whether a watchdog sends the commands: always.
        navigator: whose path and newest regions are published as `plan` and `markers`; None: nothing is.

    Raises:
        StarnavError: what is missing in the end.
    """

    scenario: Scenario
    scan: str | Sequence[str] = "scan"
    odom: str = "odom"
    cmd_vel: str = "cmd_vel"
    goal: str = "goal_pose"
    cancel: str = "goal_cancel"
    tf_static: str = "/tf_static"
    namespace: str = ""
    domain: int | None = None
    interface: str = ""
    wait: float = 10.0
    mounts: tuple[Mount, ...] | None = dataclasses.field(default=None, init=False)
    navigator: Navigator | None = dataclasses.field(default=None, init=False)
    watched: bool = dataclasses.field(default=True, init=False)

    def __post_init__(self) -> None:
        scan_topics = [self.scan] if isinstance(self.scan, str) else list(self.scan)
        self._lidars = self.scenario.all_lidars
        if len(scan_topics) != len(self._lidars):
            count_text = counted(len(scan_topics), "topic")
            raise StarnavError(f"scan names {count_text}; allowed: {len(self._lidars)}, one of each lidar")
        self._ros = open_middleware(self.domain, self.interface)
        self._scans = {self.absolute(each): self._subscribe(each, SCAN) for each in scan_topics}
        self._odometry, self._goals = self._subscribe(self.odom, ODOMETRY), self._subscribe(self.goal, POSE)
        self._cancels = self._subscribe(self.cancel, EMPTY)
        self._transforms = self._ros.subscribe(self.absolute(self.tf_static), TRANSFORMS, DEPTH[TRANSFORMS], True)
        self._goal: Any = None
        self._first: dict[str, Any] = {}
        self._frames = Frames(f"transforms of {self.absolute(self.tf_static)}")
        self._frame, self._shown, self._base = "odom", -math.inf, None
        try:
            self._until(self._missing)
            self._base = self._watched()
            self._until(self._silent)
        except StarnavError:
            self.close()
            raise
        self._plan, self._markers = (
            (self.absolute(name), self._ros.publish(self.absolute(name), kind))
            for name, kind in (("plan", PATH), ("markers", MARKERS))
        )

    def absolute(self, name: str) -> str:
        """The topic of a name."""
        return name if name.startswith("/") else f"/{self.namespace.strip('/')}/{name}".replace("//", "/")

    def _subscribe(self, name: str, kind: str) -> Callable[[], list[Any]]:
        return self._ros.subscribe(self.absolute(name), kind, DEPTH[kind])

    def _until(self, missing: Callable[[], str]) -> None:
        """Wait until nothing is missing."""
        end_time = time.monotonic() + self.wait
        while missing_text := missing():
            if time.monotonic() > end_time:
                raise StarnavError(f"ROS 2, after {self.wait:g} s: {missing_text}")
            time.sleep(POLL)

    def _missing(self) -> str:
        """The first reason for which the robot cannot be driven; empty: none."""
        topic_readers = {**self._scans, self.absolute(self.odom): self._odometry}
        for topic, read_messages in topic_readers.items():
            kind = SCAN if topic in self._scans else ODOMETRY
            for message in read_messages():
                self._first[topic] = message
            if fault := self._not_offered(topic, kind) or self._not_timely(topic):
                return fault
        return self._not_heard() or self._not_mounted()

    def _not_offered(self, topic: str, kind: str) -> str:
        publishers = self._ros.endpoints(topic, True)
        found_kinds = sorted({each.kind for each in publishers})
        if not found_kinds:
            topics_text = ", ".join(self._ros.topics()) or "nothing"
            return f"nobody publishes {topic}; published is {topics_text}"
        if found_kinds != [kind]:
            return f"{topic} is published as {' and as '.join(found_kinds)}; allowed: {kind}"
        return "" if topic in self._first else f"{topic} is published, but no message arrives"

    def _not_timely(self, topic: str) -> str:
        stamp_age = time.time() - seconds(self._first[topic].header.stamp)
        if -CLOCK <= stamp_age <= OLDEST:
            return ""
        age_text = f"{stamp_age:.3g} s behind" if stamp_age > 0.0 else f"{-stamp_age:.3g} s ahead of"
        return f"stamps of {topic} are {age_text} this computer's clock; allowed: clocks that agree within {CLOCK:g} s"

    def _not_heard(self) -> str:
        """Why the base would not, or should not, be sent twists."""
        topic = self.absolute(self.cmd_vel)
        if self._ros.endpoints(topic, True):
            return f"another node publishes {topic}; allowed: none, as the certificate holds only for its own commands"
        subscribers = self._ros.endpoints(topic, False)
        found_kinds = sorted({each.kind for each in subscribers})
        if not found_kinds:
            return f"nobody listens to {topic}"
        if found_kinds not in ([TWIST], [STAMPED]):
            return f"{topic} is listened to as {' and as '.join(found_kinds)}; allowed: {TWIST}, or {STAMPED}"
        if any(each.latched for each in subscribers):
            return f"{topic} is listened to with durability transient local; allowed: volatile, as an old twist is none"
        return ""

    def _not_mounted(self) -> str:
        """Find the mounts, if transforms say where lidars are; else why they cannot be."""
        for message in self._transforms():
            for each in message.transforms:
                self._frames.add(each.child_frame_id, each.header, each.transform, moves=False)
        odometry = self._first[self.absolute(self.odom)]
        self._frame, base_frame = odometry.header.frame_id, frame_name(odometry.child_frame_id)
        tree_topic, mounts = self.absolute(self.tf_static), []
        if not self._ros.endpoints(tree_topic, True):
            return ""
        for topic, lidar in zip(self._scans, self._lidars, strict=True):
            lidar_frame = frame_name(self._first[topic].header.frame_id)
            frame_chain = self._frames.ways(lidar_frame).get(base_frame)
            if frame_chain is None:
                return f"no transform of {tree_topic} leads from {base_frame} to {lidar_frame}, the frame of {topic}"
            X_BS = RigidTransform(pose_along(frame_chain, 0.0))
            mounts.append(find_mount(X_BS, dataclasses.replace(lidar, frame=lidar_frame), float(X_BS.translation()[2])))
        self.mounts = tuple(mounts)
        return ""

    def _watched(self) -> Watched:
        topic, limits = self.absolute(self.cmd_vel), self.scenario.robot.limits
        (kind,) = {each.kind for each in self._ros.endpoints(topic, False)}
        arguments = {"topic": topic, "stamped": kind == STAMPED, "steers": limits.steers > 0.0, "domain": self.domain}
        arguments |= {"interface": self.interface, "frame": self._first[self.absolute(self.odom)].child_frame_id}
        return Watched("drake_starnav.runtime.ros2_base:Base", arguments, read_ramp(limits))

    def _silent(self) -> str:
        heard = self._ros.endpoints(self.absolute(self.cmd_vel), True)
        return "" if heard else f"the watchdog's process does not publish {self.absolute(self.cmd_vel)}"

    def read(self) -> Reading:
        """What came since the last call; what is no scan, odometry or goal is passed on, for it brakes the robot."""
        scans = [(k, read_scan(each)) for k, take in enumerate(self._scans.values()) for each in take()]
        odometry = [read_odometry(each) for each in self._odometry()]
        for message in self._goals():
            self._goal = read_goal(message, self._frame)
        if self._cancels():
            self._goal = WITHDRAWN
        return Reading(time.time(), scans, odometry, self._goal)

    def drive(self, command: Command) -> None:
        """Send a twist; now and then publish what is planned."""
        assert self._base is not None
        self._base.drive(command.twist.tolist())
        if self.navigator is not None and time.monotonic() > self._shown + PLAN_PERIOD:
            self._shown = time.monotonic()
            self._show(self.navigator)

    def _show(self, navigator: Navigator) -> None:
        (plan, send), (markers, mark) = self._plan, self._markers
        if not (self._ros.endpoints(plan, False) or self._ros.endpoints(markers, False)):
            return
        path, outlines = read_plan(navigator)
        make = self._ros.types
        head = make_header(make, time.time(), self._frame)
        path_poses = [make.Pose(position=each) for each in self._points(path)]
        send(make.Path(header=head, poses=[make.PoseStamped(header=head, pose=each) for each in path_poses]))
        outline_points = [
            each for outline in outlines for each in self._points(np.roll(np.repeat(outline, 2, axis=0), -1, axis=0))
        ]
        line_look = {"scale": make.Vector3(x=0.02), "color": make.ColorRGBA(g=0.6, a=1.0), "points": outline_points}
        mark(make.MarkerArray(markers=[make.Marker(header=head, ns="regions", type=5, **line_look)]))  # a line list

    def _points(self, places: Iterable[Any]) -> list[Any]:
        return [self._ros.types.Point(x=float(x), y=float(y)) for x, y in places]

    def close(self) -> None:
        """Let the watchdog's process end, and leave the network."""
        if self._base is not None:
            self._base.close()
        self._ros.close()


def read_scan(message: Any) -> Any:
    """The scan of a message, as of its last beam; the message itself if it is none."""
    names = "angle_min", "angle_increment", "range_min", "range_max", "time_increment", "scan_time"
    scan_fields: dict[str, Any] = {name: float(getattr(message, name)) for name in names}
    last = seconds(message.header.stamp) + max(scan_fields["time_increment"], 0.0) * max(len(message.ranges) - 1, 0)
    try:
        return LaserScan(last, ranges=np.array(message.ranges, float), lost_beams=True, **scan_fields)
    except StarnavError:
        return message


def read_odometry(message: Any) -> Odometry:
    """The odometry of a message, whose twist is in the robot's frame."""
    p, twist = message.pose.pose.position, message.twist.twist
    yaw = read_yaw(message.pose.pose.orientation)
    return Odometry(seconds(message.header.stamp), p.x, p.y, yaw, twist.linear.x, twist.angular.z, twist.linear.y)


def read_goal(message: Any, frame: str) -> Any:
    """(x, y) or (x, y, yaw) of a goal in a frame; a text that says what it is if it is in another."""
    goal_frame, p, q = message.header.frame_id, message.pose.position, message.pose.orientation
    if frame_name(goal_frame) != frame_name(frame):
        return f"in frame {goal_frame}, and odometry in {frame}"
    return (p.x, p.y, read_yaw(q)) if any((q.x, q.y, q.z, q.w)) else (p.x, p.y)


def read_yaw(q: Any) -> float:
    """The turn of a quaternion about z, rad."""
    return math.atan2(2.0 * (q.w * q.z + q.x * q.y), q.w * q.w + q.x * q.x - q.y * q.y - q.z * q.z)
