"""A second vendor's DDS as a peer of the node: Cyclone DDS on the wire, rosbags as codec.

No ROS here: types, their hashes and their bytes come from rosbags' own definitions, so what node
and referee agree on is what ROS 2 programs agree on. Messages are bytes (CDR) to Cyclone; its own
codec is replaced by theirs.

Without a type name of ROS's form, XCDR1 and keyless types there is no data, and no warning.
"""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from types import new_class
from typing import Any, Final

from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
)
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl import types as idl
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore

STORE: Final = get_typestore(Stores.ROS2_JAZZY)
_BASES: Final = {
    "bool": bool,
    "string": str,
    "byte": idl.uint8,
    "char": idl.uint8,
    **{name: getattr(idl, name) for name in ("int8", "int16", "int32", "int64")},
    **{name: getattr(idl, name) for name in ("uint8", "uint16", "uint32", "uint64")},
    **{name: getattr(idl, name) for name in ("float32", "float64")},
}
_LOOPBACK: Final = """<CycloneDDS><Domain><General><Interfaces>
<NetworkInterface name="lo" multicast="false"/></Interfaces><AllowMulticast>false</AllowMulticast>
</General><Discovery><ParticipantIndex>auto</ParticipantIndex>
<MaxAutoParticipantIndex>60</MaxAutoParticipantIndex>
<SPDPInterval>500ms</SPDPInterval>
<Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>"""


@dataclass
class Endpoint:
    """What another participant says of a topic that it publishes or takes."""

    topic: str
    type: str
    type_hash: str
    is_reliable: bool
    is_volatile: bool


class Referee:
    """A participant in the domain of $ROS_DOMAIN_ID; names of topics are absolute."""

    def __init__(self) -> None:
        os.environ["CYCLONEDDS_URI"] = _LOOPBACK
        self._participant = DomainParticipant(int(os.environ["ROS_DOMAIN_ID"]))
        self._publications = BuiltinDataReader(self._participant, BuiltinTopicDcpsPublication)
        self._subscriptions = BuiltinDataReader(self._participant, BuiltinTopicDcpsSubscription)

    def writer(self, topic: str, type_: str) -> DataWriter[Any]:
        """What publishes messages of rosbags' classes, reliably."""
        return DataWriter(self._participant, self._topic(topic, type_), qos=_qos(type_))

    def reader(self, topic: str, type_: str, *, is_reliable: bool = True) -> DataReader[Any]:
        """What takes a topic's messages as bytes, each in `.cdr`."""
        qos = _qos(type_, is_reliable=is_reliable)
        return DataReader(self._participant, self._topic(topic, type_), qos=qos)

    def published(self) -> dict[str, Endpoint]:
        """The topics that others publish, as they announce them, by ROS's names."""
        return {each.topic: each for each in self._others(self._publications)}

    def taken(self) -> list[Endpoint]:
        """The topics that others take; one may be taken as several types."""
        return list(self._others(self._subscriptions))

    def _others(self, reader: Any) -> Iterator[Endpoint]:  # noqa: ANN401 -- it has no type
        ours = self._participant.guid
        for each in reader.read(N=500):
            is_valid = hasattr(each, "qos") and each.topic_name.startswith("rt/")
            if is_valid and each.participant_key != ours:
                yield _endpoint(each)

    def _topic(self, topic: str, type_: str) -> Topic[Any]:
        return Topic(self._participant, f"rt{topic}", _struct(type_))


def part(type_: str, **fields: Any) -> Any:  # noqa: ANN401 -- of any type
    """A message of rosbags' class, or a part of one."""
    return STORE.types[type_](**fields)


def made(type_: str, **fields: Any) -> Any:  # noqa: ANN401
    """A message as `writer` takes it."""
    return _struct(type_)(cdr=bytes_of(type_, part(type_, **fields)))


def read(type_: str, cdr: bytes) -> Any:  # noqa: ANN401
    """The message that bytes are."""
    return STORE.deserialize_cdr(cdr, type_)


def bytes_of(type_: str, message: object) -> bytes:
    """The bytes that rosbags writes for a message."""
    return bytes(STORE.serialize_cdr(message, type_))


def take_all(reader: DataReader[Any]) -> list[bytes]:
    """The messages that have come, in their order; a peer that left may leave an invalid one."""
    return [each.cdr for each in reader.take(N=100) if hasattr(each, "cdr")]


def type_hash(type_: str) -> str:
    """The hash that ROS 2 gives the type."""
    return str(STORE.hash_rihs01(type_))


# --------------------------------------------------------------------------------------------------


def _qos(type_: str, *, is_reliable: bool = True) -> Qos:
    reliability = Policy.Reliability
    return Qos(
        reliability.Reliable(duration(seconds=10)) if is_reliable else reliability.BestEffort,
        Policy.History.KeepLast(1000),
        Policy.Durability.Volatile,
        Policy.DataRepresentation(use_cdrv0_representation=True),
        Policy.WriterDataLifecycle(autodispose=False),
        Policy.Userdata(f"typehash={type_hash(type_)};".encode()),
    )


@cache
def _struct(type_: str) -> Any:  # noqa: ANN401 -- a class made here
    """A type of Cyclone's with the fields of a message, that is read and written as bytes."""
    package, _, name = type_.split("/")
    fields = {field: _idl(definition) for field, definition in STORE.fielddefs[type_][1]}
    made_class: Any = dataclass(
        new_class(
            f"{name}_",
            (IdlStruct,),
            {"typename": f"{package}.msg.dds_.{name}_"},
            lambda namespace: namespace.update(__annotations__=fields, __module__=__name__),
        )
    )
    made_class.__init__ = lambda self, *, cdr: setattr(self, "cdr", cdr)
    made_class.serialize = lambda self, **_: self.cdr
    made_class.deserialize = classmethod(lambda cls, data, **_: cls(cdr=bytes(data)))
    return made_class


def _idl(definition: Any) -> Any:  # noqa: ANN401 -- a node of rosbags' tree
    kind, detail = definition
    if kind == Nodetype.BASE:
        return _BASES[detail[0]]
    if kind == Nodetype.NAME:
        return _struct(detail)
    inner, count = detail
    if kind == Nodetype.ARRAY:
        return idl.array[_idl(inner), count]
    return idl.sequence[_idl(inner)]


def _endpoint(each: Any) -> Endpoint:  # noqa: ANN401
    qos = each.qos
    said = qos[Policy.Userdata].data.decode() if Policy.Userdata in qos else ""
    keys = dict(pair.split("=", 1) for pair in said.strip(";").split(";") if "=" in pair)
    return Endpoint(
        topic=each.topic_name.removeprefix("rt"),
        type=each.type_name.replace("::dds_::", "/").replace("::", "/").rstrip("_"),
        type_hash=keys.get("typehash", ""),
        is_reliable=isinstance(qos[Policy.Reliability], Policy.Reliability.Reliable),
        is_volatile=qos[Policy.Durability] == Policy.Durability.Volatile,
    )
