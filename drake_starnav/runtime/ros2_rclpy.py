"""ROS 2 by its own library, in this process."""

import importlib
import os
import types
from collections.abc import Callable
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions

from drake_starnav.errors import StarnavError
from drake_starnav.runtime.ros2_base import Endpoint

PACKAGES = (
    "builtin_interfaces", "std_msgs", "geometry_msgs", "nav_msgs", "sensor_msgs", "tf2_msgs", "visualization_msgs"
)  # fmt: skip


def import_message_types() -> Any:
    """The classes of messages by name, of the packages that are installed."""
    found_types: dict[str, Any] = {}
    for package in PACKAGES:
        try:
            module = importlib.import_module(f"{package}.msg")
        except ImportError:
            continue
        found_types |= {name: kind for name, kind in vars(module).items() if isinstance(kind, type)}
    return types.SimpleNamespace(**found_types)


class Rclpy:
    """A `Middleware`."""

    def __init__(self, domain: int | None, interface: str) -> None:
        if interface:
            raise StarnavError(
                f"interface is {interface}; allowed with rclpy: none, as its middleware is configured by its own file"
            )
        self.types = import_message_types()
        self._context = Context()
        rclpy.init(context=self._context, domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
        self._node = rclpy.create_node(
            f"starnav_{os.getpid()}", context=self._context, enable_rosout=False, start_parameter_services=False
        )

    def subscribe(self, topic: str, kind: str, depth: int, latched: bool = False) -> Callable[[], list[Any]]:
        message_type = getattr(self.types, kind.partition("/")[2], None)
        if message_type is None:  # a package that is not installed: nobody could send one
            return list
        reliability = ReliabilityPolicy.RELIABLE if latched else ReliabilityPolicy.BEST_EFFORT
        durability = DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE
        qos = QoSProfile(depth=depth, reliability=reliability, durability=durability)
        subscription = self._node.create_subscription(message_type, topic, lambda message: None, qos)

        def taken() -> list[Any]:
            taken_messages: list[Any] = []
            with subscription.handle:
                while (
                    len(taken_messages) < depth
                    and (each := subscription.handle.take_message(message_type, False)) is not None
                ):
                    taken_messages.append(each[0])
            return taken_messages

        return taken

    def publish(self, topic: str, kind: str) -> Callable[[Any], None]:
        return self._node.create_publisher(
            getattr(self.types, kind.partition("/")[2]), topic, QoSProfile(depth=1)
        ).publish

    def endpoints(self, topic: str, publishers: bool) -> list[Endpoint]:
        get = self._node.get_publishers_info_by_topic if publishers else self._node.get_subscriptions_info_by_topic
        return [
            Endpoint(
                topic,
                each.topic_type.replace("/msg/", "/"),
                each.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL,
            )
            for each in get(topic)
            if each.node_name != self._node.get_name()
        ]

    def topics(self) -> list[str]:
        return sorted(topic for topic, _ in self._node.get_topic_names_and_types() if self.endpoints(topic, True))

    def close(self) -> None:
        self._node.destroy_node()
        self._context.shutdown()
