"""ROS 2 by Cyclone DDS, without ROS (extra `ros2`): the messages of a robot's loop as its types, and the network."""

import dataclasses
import os
import re
from collections.abc import Callable, Iterator
from functools import partial
from types import new_class
from typing import Any
from xml.sax.saxutils import quoteattr

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription
from cyclonedds.core import DDSException, InstanceState, Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct, types
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from drake_starnav.errors import StarnavError
from drake_starnav.runtime.ros2_base import Endpoint
from drake_starnav.runtime.ros2_definitions import FIELDS

PLAIN: dict[str, tuple[Any, Any]] = {"string": (str, ""), "bool": (bool, False)}
PLAIN |= {name: (getattr(types, name), 0) for name in ("uint8", "int32", "uint32")}
PLAIN |= {name: (getattr(types, name), 0.0) for name in ("float32", "float64")}


def make_dds_name(kind: str) -> str:
    """The name that DDS has for a type."""
    package, _, name = kind.partition("/")
    return f"{package}::msg::dds_::{name}_"


def make_ros_name(name: str) -> str:
    """The type that DDS has a name for; the name itself if it is no message of ROS."""
    match = re.fullmatch(r"(\w+)::msg::dds_::(\w+)_", name)
    return "/".join(match.groups()) if match else name


class Messages:
    """The classes of FIELDS as attributes; each field has a value from the start: zero, empty, or 1 of a `w`."""

    def __init__(self) -> None:
        for kind, definition in FIELDS.items():
            fields = [self._field(*each.split()) for each in definition.split(", ")]
            name = kind.partition("/")[2]
            message_class = new_class(name, (IdlStruct,), {"typename": make_dds_name(kind)}, partial(_declare, fields))
            setattr(self, name, dataclasses.dataclass(message_class))

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(f"no message {name}; allowed: {', '.join(FIELDS)}")

    def _field(self, kind: str, name: str) -> tuple[str, Any, Any]:
        """Name, type and initial value of a field."""
        base, _, count = kind.rstrip("]").partition("[")
        each, value = PLAIN[base] if base in PLAIN else (getattr(self, base), None)
        if kind != base:
            field_type = types.array[each, int(count)] if count else types.sequence[each]
            return name, field_type, dataclasses.field(default_factory=lambda: int(count or 0) * [value])
        return name, each, dataclasses.field(default_factory=each) if value is None else 1.0 if name == "w" else value


def _declare(fields: list[tuple[str, Any, Any]], space: dict[str, Any]) -> None:
    """The body of a class with these fields."""
    for name, kind, value in fields:
        space["__annotations__"][name] = kind
        space[name] = value


MESSAGES = Messages()


MOST_ENDPOINTS = 1000
"""Endpoints that are looked at."""
LOCAL = "lo", "lo0"
"""Interfaces that reach this machine alone, and know no multicast."""


def make_configuration(interface: str) -> str:
    """What Cyclone DDS is told; CYCLONEDDS_URI comes after it. Peers are as of ROS_STATIC_PEERS.

    Type information is ignored: Fast DDS describes sequences in a way that Cyclone DDS takes for another type, and
    then nothing matches.
    """
    local = interface in LOCAL
    general = f"<Interfaces><NetworkInterface name={quoteattr(interface)}/></Interfaces>" if interface else ""
    general += "<AllowMulticast>false</AllowMulticast>" if local else ""
    peers = [each for each in os.environ.get("ROS_STATIC_PEERS", "").split(";") if each] + ["127.0.0.1"] * local
    peer_list = "".join(f"<Peer address={quoteattr(each)}/>" for each in peers)
    finding = f"<ParticipantIndex>auto</ParticipantIndex><Peers>{peer_list}</Peers>" if peers else ""
    own = (
        "<Compatibility><IgnoreTypeInformation>1.15</IgnoreTypeInformation></Compatibility>"
        f"<General>{general}</General><Discovery>{finding}<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex></Discovery>"
    )
    text = f'<CycloneDDS xmlns="https://cdds.io/config"><Domain Id="any">{own}</Domain></CycloneDDS>'
    return ",".join(filter(None, (text, os.environ.get("CYCLONEDDS_URI", ""))))


def _open_domain(number: int, interface: str) -> Domain | None:
    """A domain as configured; None: this process is in it already."""
    try:
        return Domain(number, make_configuration(interface))
    except DDSException as error:
        if error.code == DDSException.DDS_RETCODE_PRECONDITION_NOT_MET:
            return None
        raise


class Cyclone:
    """A `Middleware`."""

    def __init__(self, domain: int | None, interface: str) -> None:
        number = int(os.environ.get("ROS_DOMAIN_ID") or 0) if domain is None else domain
        self.types = MESSAGES
        try:
            self._domain = _open_domain(number, interface)
            self._participant = DomainParticipant(number)
        except DDSException as error:
            raise StarnavError(
                f"domain {number}, interface {interface or 'as the machine prefers'}: Cyclone DDS says {error.msg}; "
                "allowed: a domain from 0 to 232, and the name of a network interface"
            ) from None
        self._found = {
            publishers: BuiltinDataReader(self._participant, topic)
            for publishers, topic in ((True, BuiltinTopicDcpsPublication), (False, BuiltinTopicDcpsSubscription))
        }

    def _topic(self, topic: str, kind: str) -> Topic:
        return Topic(self._participant, f"rt{topic}", getattr(self.types, kind.partition("/")[2]))

    def subscribe(self, topic: str, kind: str, depth: int, latched: bool = False) -> Callable[[], list[Any]]:
        reliability, durability = Policy.Reliability.BestEffort, Policy.Durability.Volatile
        if latched:
            reliability = Policy.Reliability.Reliable(duration(milliseconds=100))
            durability = Policy.Durability.TransientLocal
        qos = Qos(reliability, durability, Policy.History.KeepLast(depth))
        reader = DataReader(self._participant, self._topic(topic, kind), qos)
        message_type = getattr(self.types, kind.partition("/")[2])
        # other messages say that a writer left
        return lambda: [each for each in reader.take(depth) if isinstance(each, message_type)]

    def publish(self, topic: str, kind: str, latched: bool = False) -> Callable[[Any], None]:
        qos = Qos(
            Policy.Reliability.Reliable(duration(milliseconds=1)),
            Policy.Durability.TransientLocal if latched else Policy.Durability.Volatile,
            Policy.History.KeepLast(1),
            Policy.DataRepresentation(use_cdrv0_representation=True),
        )
        writer = DataWriter(self._participant, self._topic(topic, kind), qos)
        return lambda message: writer.write(message)

    def _others(self, publishers: bool) -> Iterator[Any]:
        for each in self._found[publishers].read(MOST_ENDPOINTS):
            alive = each.sample_info.instance_state == InstanceState.Alive
            if alive and each.participant_key != self._participant.guid and each.topic_name.startswith("rt/"):
                yield each

    def endpoints(self, topic: str, publishers: bool) -> list[Endpoint]:
        found_endpoints = []
        for each in self._others(publishers):
            if each.topic_name == f"rt{topic}":
                is_latched = each.qos[Policy.Durability] != Policy.Durability.Volatile
                found_endpoints.append(Endpoint(topic, make_ros_name(each.type_name), is_latched))
        return found_endpoints

    def topics(self) -> list[str]:
        return sorted({each.topic_name.removeprefix("rt") for each in self._others(True)})

    def close(self) -> None:
        self._found.clear()
        self._participant = self._domain = None
