"""Topics as a table for another process, which knows the project but not the robot's package.

A convention goes by the name of its entry point: a process that is to use one of a robot's own has
that package installed as well.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import msgspec
from msgspec import Struct

from firmware_runtime.board.ros.conventions import Convention, Incoming, Options, Outgoing
from firmware_runtime.board.ros.plain_types import plain_incoming, plain_outgoing
from firmware_runtime.board.ros.topics import Publication, Subscription, Topics
from firmware_runtime.errors import ConfigError


class _Topic(Struct, frozen=True, kw_only=True):
    topic: str
    port: str
    type: str
    convention: str
    """Empty for a plain type."""
    options: dict[str, str]
    """As texts: JSON has no word for numbers that are not finite."""


class _Published(_Topic, frozen=True, kw_only=True):
    frame: str
    rate_hz: float


class _Taken(_Topic, frozen=True, kw_only=True):
    record: dict[str, bool]
    """The fields of a record, and whether they are whole numbers."""


class _Table(Struct, frozen=True):
    published: tuple[_Published, ...]
    taken: tuple[_Taken, ...]
    without: dict[str, str]


def table_of(topics: Topics) -> dict[str, Any]:
    """The topics in JSON's types."""
    table = _Table(
        tuple(map(_published, topics.publications)),
        tuple(map(_taken, topics.subscriptions)),
        dict(topics.without),
    )
    built: dict[str, Any] = msgspec.to_builtins(table)
    return built


def topics_in(table: object, provided: Mapping[str, Convention]) -> Topics:
    """The topics of a `table_of`, with these conventions; raises ConfigError if one is missing."""
    read = msgspec.convert(table, _Table)
    every: Sequence[_Topic] = [*read.published, *read.taken]
    missing = {each.convention for each in every if each.convention not in {*provided, ""}}
    if missing:
        fault = "no such convention here; expected its package in the environment of ROS 2"
        raise ConfigError("topics", [f"{name}: {fault}" for name in sorted(missing)])
    return Topics(
        [_publication(each, provided.get(each.convention)) for each in read.published],
        [_subscription(each, provided.get(each.convention)) for each in read.taken],
        read.without,
    )


def _published(each: Publication) -> _Published:
    return _Published(
        topic=each.topic,
        port=each.port,
        type=each.message.type,
        convention=each.convention,
        options=_texts(each.options),
        frame=each.frame,
        rate_hz=each.rate_hz,
    )


def _taken(each: Subscription) -> _Taken:
    return _Taken(
        topic=each.topic,
        port=each.port,
        type=each.message.type,
        convention=each.convention,
        options=_texts(each.options),
        record=dict(each.message.record),
    )


def _publication(each: _Published, convention: Convention | None) -> Publication:
    message = plain_outgoing(each.type) if convention is None else _out(convention, each.type)
    return Publication(
        each.topic,
        each.port,
        message,
        each.convention,
        _numbers(each.options),
        each.frame,
        each.rate_hz,
    )


def _subscription(each: _Taken, convention: Convention | None) -> Subscription:
    if convention is None:
        message = plain_incoming(each.type, each.record)
    else:
        message = _into(convention, each.type)
    return Subscription(each.topic, each.port, message, each.convention, _numbers(each.options))


def _out(convention: Convention, kind: str) -> Outgoing:
    return next(each for each in convention.out if each.type == kind)


def _into(convention: Convention, kind: str) -> Incoming:
    return next(each for each in convention.into if each.type == kind)


def _texts(options: Options) -> dict[str, str]:
    return {name: str(value) for name, value in options.items()}


def _numbers(texts: Mapping[str, str]) -> Options:
    return {name: float(text) for name, text in texts.items()}
