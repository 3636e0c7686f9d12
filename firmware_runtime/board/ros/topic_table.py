"""Topics as a table for another process, which knows the project but not the robot's package.

A convention goes by the name of its entry point: a process that is to use one of a robot's own has
that package installed as well.
"""

from collections.abc import Iterable, Mapping
from typing import TypeVar

import msgspec
from msgspec import Struct
from msgspec.structs import replace

from firmware_runtime.board.ros.conventions import Convention, Incoming, Options, Outgoing
from firmware_runtime.board.ros.plain_types import plain_incoming, plain_outgoing
from firmware_runtime.board.ros.topics import Publication, Subscription, Topics
from firmware_runtime.errors import ConfigError

M = TypeVar("M", Outgoing, Incoming)


class _Row(Struct, frozen=True, kw_only=True):
    topic: str
    port: str
    type: str
    convention: str
    """Empty for a plain type."""
    options: dict[str, str]
    """As texts: JSON has no word for numbers that are not finite."""
    frame: str = ""
    rate_hz: float = 0.0
    record: dict[str, bool] = {}
    """Of a topic that is taken: the fields of a record, and whether they are whole numbers."""


class _Table(Struct, frozen=True):
    published: tuple[_Row, ...]
    taken: tuple[_Row, ...]
    without: dict[str, str]


def table_of(topics: Topics) -> dict[str, object]:
    """Return the topics in JSON's types."""
    table = _Table(
        tuple(
            replace(_row(each), frame=each.frame, rate_hz=each.rate_hz)
            for each in topics.publications
        ),
        tuple(
            replace(_row(each), record=dict(each.message.record)) for each in topics.subscriptions
        ),
        dict(topics.without),
    )
    built: dict[str, object] = msgspec.to_builtins(table)
    return built


def topics_in(table: object, provided: Mapping[str, Convention]) -> Topics:
    """Return the topics of a `table_of`; raises ConfigError if a convention is missing."""
    read = msgspec.convert(table, _Table)
    missing = {each.convention for each in (*read.published, *read.taken)} - {*provided, ""}
    if missing:
        fault = "no such convention here; expected its package in the environment of ROS 2"
        raise ConfigError("topics", [f"{name}: {fault}" for name in sorted(missing)])
    return Topics(
        [_publication(each, provided.get(each.convention)) for each in read.published],
        [_subscription(each, provided.get(each.convention)) for each in read.taken],
        read.without,
    )


def _row(each: Publication | Subscription) -> _Row:
    return _Row(
        topic=each.topic,
        port=each.port,
        type=each.message.type,
        convention=each.convention,
        options={name: str(value) for name, value in each.options.items()},
    )


def _publication(row: _Row, convention: Convention | None) -> Publication:
    message = plain_outgoing(row.type) if convention is None else _of(convention.out, row.type)
    stated = row.topic, row.port, message, row.convention, _options(row)
    return Publication(*stated, row.frame, row.rate_hz)


def _subscription(row: _Row, convention: Convention | None) -> Subscription:
    if convention is None:
        message = plain_incoming(row.type, row.record)
    else:
        message = _of(convention.into, row.type)
    return Subscription(row.topic, row.port, message, row.convention, _options(row))


def _of(messages: Iterable[M], kind: str) -> M:
    return next(each for each in messages if each.type == kind)


def _options(row: _Row) -> Options:
    return {name: float(text) for name, text in row.options.items()}
