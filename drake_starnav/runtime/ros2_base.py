"""The base of a ROS 2 robot, `cmd_vel`, as of `watchdog.Watched`; loads neither Drake nor NumPy."""

import importlib.util
import math
import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Protocol

from drake_starnav.errors import StarnavError

TWIST, STAMPED = "geometry_msgs/Twist", "geometry_msgs/TwistStamped"


class Endpoint(NamedTuple):
    """A publisher or subscription of somebody else: its topic, its type, and whether it is latched."""

    topic: str
    kind: str
    latched: bool


class Middleware(Protocol):
    """ROS 2 by one library; `types` has the classes of the messages by their names.

    Topics are absolute, types are as `std_msgs/Header`. A latched publisher keeps its last message for those who come
    later. Subscriptions take what any publisher offers, but latched ones.
    """

    types: Any

    def subscribe(self, topic: str, kind: str, depth: int, latched: bool = False) -> Callable[[], list[Any]]:
        """A function that returns the messages that came since its last call, oldest first, without waiting."""

    def publish(self, topic: str, kind: str) -> Callable[[Any], None]:
        """A function that sends a message, reliably."""

    def endpoints(self, topic: str, publishers: bool) -> list[Endpoint]:
        """The publishers or the subscriptions of a topic in other nodes."""

    def topics(self) -> list[str]:
        """What other nodes publish."""

    def close(self) -> None:
        """Leave the network."""


def open_middleware(domain: int | None = None, interface: str = "") -> Middleware:
    """By `rclpy` where it is installed, as where ROS 2 is, and by `cyclonedds` elsewhere.

    Args:
        domain: None: ROS_DOMAIN_ID, or 0.
        interface: the name of the network interface to use alone, as `lo`; empty: what the machine prefers.

    Raises:
        StarnavError: neither is installed, or they cannot use what is given.
    """
    if importlib.util.find_spec("rclpy") is not None:
        from drake_starnav.runtime.ros2_rclpy import Rclpy

        return Rclpy(domain, interface)
    if importlib.util.find_spec("cyclonedds") is None:
        raise StarnavError(
            "ROS 2 needs rclpy or cyclonedds; allowed: a shell in which ROS 2's setup.bash was sourced, or "
            "pip install 'drake-starnav[ros2]'"
        )
    from drake_starnav.runtime.ros2_cyclone import Cyclone

    return Cyclone(domain, interface)


class Base:
    """Sends twists to `cmd_vel`."""

    def __init__(
        self, topic: str, stamped: bool, steers: bool, domain: int | None = None, interface: str = "", frame: str = ""
    ) -> None:
        """
        Args:
            topic: absolute.
            stamped: whether its messages have a header, with `frame`.
            steers: whether the last component of twists is a curvature, 1/m.
            domain, interface: as of `middleware`.
        """
        self._ros = open_middleware(domain, interface)
        self._send = self._ros.publish(topic, STAMPED if stamped else TWIST)
        self._stamped, self._steers, self._frame = stamped, steers, frame

    def drive(self, twist: Sequence[float]) -> None:
        """Send it at once."""
        make, (*translation, turning) = self._ros.types, twist
        turning *= translation[0] if self._steers else 1.0
        x, y = (*translation, 0.0)[:2]
        message = make.Twist(linear=make.Vector3(x=float(x), y=float(y)), angular=make.Vector3(z=float(turning)))
        if self._stamped:
            message = make.TwistStamped(header=make_header(make, time.time(), self._frame), twist=message)
        self._send(message)

    def close(self) -> None:
        """Leave the network."""
        self._ros.close()


def make_header(make: Any, current_time: float, frame: str) -> Any:
    """The header of a message: its time, s, and the frame of what it holds."""
    return make.Header(
        stamp=make.Time(sec=math.floor(current_time), nanosec=int(current_time % 1.0 * 1e9)), frame_id=frame
    )
