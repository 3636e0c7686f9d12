"""The topics of a robot: each port's by its type, named and paced as `[ros]` of board.toml says.

Published are the output ports of the top model and of its components, and those further below that
`[ros]` names; the input ports of the top model take messages. Names of topics are below the node's
namespace, `/BOARD`.
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, TypeAlias

from msgspec import structs

from firmware_runtime.board.registry import Board
from firmware_runtime.board.ros.conventions import (
    Convention,
    Incoming,
    Options,
    Outgoing,
    conventions,
)
from firmware_runtime.board.ros.names import ros_name
from firmware_runtime.board.ros.plain_types import plain_convention
from firmware_runtime.board.settings import RosSettings, RosTopicSettings
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.ports import InPort, OutPort
from firmware_runtime.errors import ConfigError, did_you_mean
from firmware_runtime.hal.wire_errors import Fault

_Base: TypeAlias = tuple[bool, str | None]
"""Whether it is an input port's, and the name that its convention has for the only one."""
_FAULTS_GO: Final = "faults are in /diagnostics"
_NO_CONVENTION: Final = "a value of {} is no message; expected a convention of its package"


@dataclass(frozen=True, slots=True)
class Publication:
    """One topic that is published."""

    topic: str
    """Below the node's namespace, such as `imu/data_raw`."""
    port: str
    """Path of the output port, such as `imu.sample`."""
    message: Outgoing
    convention: str
    """The name of its entry point; empty for a plain type."""
    options: Options
    frame: str
    """The header's, if the message has one."""
    rate_hz: float
    """At most; 0: every message."""


@dataclass(frozen=True, slots=True)
class Subscription:
    """One topic that is taken into the model."""

    topic: str
    port: str
    """An input port of the top model."""
    message: Incoming
    convention: str
    options: Options


@dataclass(frozen=True, slots=True)
class Topics:
    """Topics of a robot; `without` says why a port has none, `faults` what `[ros]` has wrong."""

    publications: Sequence[Publication] = ()
    subscriptions: Sequence[Subscription] = ()
    without: Mapping[str, str] = field(default_factory=dict)
    faults: Sequence[str] = ()


@dataclass(slots=True)
class _Port:
    """A port, what is said of it in the board file, and its convention."""

    path: str
    port: InPort[Any] | OutPort[Any]
    owner: Component
    stated: RosTopicSettings
    convention: Convention | None = None
    name: str = ""
    """The convention's."""
    options: Options = field(default_factory=dict)

    @property
    def messages(self) -> Sequence[Outgoing] | Sequence[Incoming]:
        """Messages that it is published as, or made of."""
        if self.convention is None:
            return ()
        return self.convention.into if isinstance(self.port, InPort) else self.convention.out


def topics_of(board: Board) -> Topics:
    """The topics of a board's robot. Raises ConfigError with every fault of its table `[ros]`."""
    found = topics(board.unconnected().model, board.settings.ros)
    if found.faults:
        raise ConfigError(str(board.source), found.faults)
    return found


def topics(model: Coupled, ros: RosSettings) -> Topics:
    """The topics of a robot's model; raises ConfigError for a package's broken convention."""
    stated = {each.port: each for each in ros.topics}
    shown = dict(_shown(model, set(stated)))
    faults = _unknown_ports(ros, shown)
    known: list[_Port] = []
    provided = conventions()
    without: dict[str, str] = {}
    for path, port in shown.items():
        each = _Port(path, port, _owner(model, port), stated.get(path, RosTopicSettings(path)))
        if each.stated.off:
            without[path] = "off in board.toml"
            faults += _said_of_none(each.stated)
            continue
        faults += _find_convention(each, provided)
        if each.messages:
            known.append(each)
        else:
            kind = port.type.__name__
            is_fault = issubclass(port.type, Fault)
            without[path] = _FAULTS_GO if is_fault else _NO_CONVENTION.format(kind)
    alone = Counter(map(_base, known))
    publications = [one for each in known for one in _publications(each, alone, ros)]
    subscriptions = [one for each in known for one in _subscriptions(each, alone)]
    faults += [fault for each in known for fault in _without_effect(each)]
    faults += _clashes(publications, subscriptions)
    return Topics(publications, subscriptions, without, faults)


# --------------------------------------------------------------------------------------------------


def _shown(
    model: Coupled, stated: set[str]
) -> Iterator[tuple[str, InPort[object] | OutPort[object]]]:
    yield from model.in_ports.items()
    yield from model.out_ports.items()
    for component in model.components.values():
        yield from _outputs(component, component.name, stated)


def _outputs(
    component: Component, path: str, stated: set[str], *, is_deep: bool = False
) -> Iterator[tuple[str, OutPort[object]]]:
    """Output ports of a component, and of those below it the ones that are stated."""
    for name, port in component.out_ports.items():
        if not is_deep or f"{path}.{name}" in stated:
            yield f"{path}.{name}", port
    if isinstance(component, Coupled):
        for child in component.components.values():
            yield from _outputs(child, f"{path}.{child.name}", stated, is_deep=True)


def _owner(model: Coupled, port: InPort[object] | OutPort[object]) -> Component:
    return port.owner if isinstance(port.owner, Component) else model


def _unknown_ports(ros: RosSettings, shown: Mapping[str, object]) -> list[str]:
    faults = []
    for number, each in enumerate(ros.topics):
        where = f"ros.topics[{number}].port: {each.port!r}"
        if each.port not in shown:
            like = did_you_mean(each.port, shown)
            expected = "expected an input port of the top model or a component's output port"
            faults.append(f"{where}: no such port; {expected}{like}")
        elif each.port in {other.port for other in ros.topics[:number]}:
            faults.append(f"{where}: stated before; expected each port once")
    return faults


def _find_convention(each: _Port, known: Mapping[str, Convention]) -> list[str]:
    """Note the port's convention and its options; return what the board file has wrong in it."""
    stated, where = each.stated, f"ros.topics of {each.path}"
    if stated.convention is not None and stated.convention not in known:
        expected = f"expected one of {', '.join(known) or 'none: no package provides any'}"
        like = did_you_mean(stated.convention, known)
        return [f"{where}: convention: {stated.convention!r}: {expected}{like}"]
    each.name = stated.convention or _registered(each, known)
    each.convention = known.get(each.name) or _plain(each.port.type)
    if each.convention is None:
        return []
    default = each.convention.options
    each.options = {**default, **each.convention.options_of(each.owner), **stated.options}
    return [
        f"{where}: options.{name}: has no effect; expected one of {', '.join(default) or 'none'}"
        for name in stated.options
        if name not in default
    ]


def _registered(each: _Port, known: Mapping[str, Convention]) -> str:
    """The name of the first convention that is for this port; empty if there is none."""
    kind = each.port.type
    return next(
        (name for name, one in known.items() if one.is_for(each.owner, each.port.name, kind)), ""
    )


def _plain(kind: type[object]) -> Convention | None:
    return None if issubclass(kind, Fault) else plain_convention(kind)


def _publications(each: _Port, alone: Counter[_Base], ros: RosSettings) -> Iterator[Publication]:
    if isinstance(each.port, InPort) or each.convention is None:
        return
    component, _, _ = each.path.rpartition(".")
    component = component or each.path
    base = each.convention.base
    if base is None or alone[_base(each)] > 1:
        base = _topic(component)
    below = each.stated.name or base
    for message in each.convention.out:
        topic = f"{below}/{message.leaf}".lstrip("/")
        usual_hz = 0.0 if message.is_event else ros.rate_hz
        frame = message.frame or f"{ros_name(base or component)}_link"
        yield Publication(
            topic=topic if message.leaf else each.stated.name or _topic(each.path),
            port=each.path,
            message=message,
            convention=each.name,
            options=each.options,
            frame=(each.stated.frame or frame) if message.is_stamped else "",
            rate_hz=usual_hz if each.stated.rate_hz is None else each.stated.rate_hz,
        )


def _subscriptions(each: _Port, alone: Counter[_Base]) -> Iterator[Subscription]:
    if isinstance(each.port, OutPort) or each.convention is None:
        return
    base = each.convention.base
    for message in each.convention.into:
        usual = base if base and alone[_base(each)] == 1 else _topic(each.path)
        topic = each.stated.name or usual
        yield Subscription(topic, each.path, message, each.name, each.options)


def _base(each: _Port) -> _Base:
    base = None if each.convention is None else each.convention.base
    return isinstance(each.port, InPort), base


def _topic(path: str) -> str:
    return "/".join(map(ros_name, path.split(".")))


def _said_of_none(stated: RosTopicSettings) -> list[str]:
    """Keys beside `off` in the table of a port."""
    silent = structs.asdict(RosTopicSettings(stated.port, off=True))
    said = structs.asdict(stated)
    where = f"ros.topics of {stated.port}"
    return [
        f"{where}: {key}: has no effect; off is true" for key in said if said[key] != silent[key]
    ]


def _without_effect(each: _Port) -> list[str]:
    """Keys of a port's table that change nothing."""
    stated, where = each.stated, f"ros.topics of {each.path}"
    is_input = isinstance(each.port, InPort)
    faults = []
    if is_input and stated.rate_hz is not None:
        faults.append(f"{where}: rate_hz: has no effect; an input port is not paced")
    stamped = any(message.is_stamped for message in each.messages)
    if stated.frame is not None and (is_input or not stamped):
        faults.append(f"{where}: frame: has no effect; its message has no header")
    return faults


def _clashes(
    publications: Sequence[Publication], subscriptions: Sequence[Subscription]
) -> list[str]:
    """Topics that two ports have; the messages that one input port takes may share theirs."""
    ports: dict[str, set[str]] = {}
    every: list[Publication | Subscription] = [*publications, *subscriptions]
    for each in every:
        ports.setdefault(each.topic, set()).add(each.port)
    return [
        f"ros.topics: {topic} is the topic of {' and of '.join(sorted(of))}; expected another name"
        for topic, of in ports.items()
        if len(of) > 1
    ]
