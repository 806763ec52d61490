"""ROS 2 by Cyclone DDS, without ROS (extra `ros2`)."""

import os
from collections.abc import Callable, Iterator
from typing import Any
from xml.sax.saxutils import quoteattr

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription
from cyclonedds.core import DDSException, InstanceState, Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from drake_starnav.errors import StarnavError
from drake_starnav.runtime.ros2_base import Endpoint
from drake_starnav.runtime.ros2_messages import MESSAGES, make_ros_name

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
        reliability = (
            Policy.Reliability.Reliable(duration(milliseconds=100)) if latched else Policy.Reliability.BestEffort
        )
        durability = Policy.Durability.TransientLocal if latched else Policy.Durability.Volatile
        reader = DataReader(
            self._participant, self._topic(topic, kind), Qos(reliability, durability, Policy.History.KeepLast(depth))
        )
        message_type = getattr(self.types, kind.partition("/")[2])

        def taken() -> list[Any]:
            return [
                each for each in reader.take(depth) if isinstance(each, message_type)
            ]  # others say that a writer left

        return taken

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
