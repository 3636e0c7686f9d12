"""Values of ports for viewers that speak Foxglove's protocol: a channel a port, JSON by its type.

A viewer connects to `ws://127.0.0.1:PORT`; it may look and nothing else. The protocol has no
password: every process of this machine may look.
Source: docs.foxglove.dev, Foxglove SDK; github.com/foxglove/ws-protocol.
"""

from collections.abc import Callable, Mapping
from typing import Any, Final

import msgspec
from msgspec import inspect

from firmware_runtime.board.ros.names import ros_name
from firmware_runtime.devs.ports import OutPort
from firmware_runtime.errors import ConfigError
from firmware_runtime.statistics.json_values import plain
from firmware_runtime.system.packages import module_of_extra
from firmware_runtime.system.resources import Closing

LOOPBACK: Final = "127.0.0.1"
USUAL_PORT: Final = 8766
"""The one beside the page's."""
ALONE: Final = "value"
"""The field of a value that has none of its own."""
_BACKLOG: Final = 1024
"""Messages that are kept for a viewer that is slow; then the oldest is dropped."""


class FoxgloveChannels(Closing):
    """Serves the values of these ports, by path, until it is closed; `port` 0 is any free one.

    Raises ConfigError without the extra, and where nothing can be served.
    """

    def __init__(
        self, board: str, ports: Mapping[str, OutPort[Any]], port: int = USUAL_PORT
    ) -> None:
        self._foxglove = foxglove = module_of_extra("foxglove", "foxglove")
        self._board = board
        self._last: dict[str, tuple[Any, int, object]] = {}
        """Channel, date and value that were sent last, by topic."""
        self._context = context = foxglove.Context()  # the server itself does not keep it
        try:
            self._server = foxglove.start_server(
                name=board,
                host=LOOPBACK,
                port=port,
                context=context,
                server_listener=_Subscriptions(self._send_last),
                message_backlog_size=_BACKLOG,
            )
        except (RuntimeError, OSError, OverflowError) as error:
            fault = f"{LOOPBACK}:{port} cannot be served ({error})"
            raise ConfigError.of_one("--foxglove", fault, expected="a free port") from error
        self._channels = {
            path: self._channel(path, schema_of(each.type)) for path, each in ports.items()
        }

    @property
    def port(self) -> int:
        """The port that it is served at."""
        port: int = self._server.port
        return port

    def send(self, path: str, at_ns: int, value: object) -> None:
        """Send a value that a port had at a date, ns since 1970.

        A port that was not named, such as one of a world, gets a channel without a schema.
        """
        channel = self._channels.get(path)
        if channel is None:
            channel = self._channels[path] = self._channel(path, None)
        self._last[channel.topic()] = channel, at_ns, value
        if channel.has_sinks():
            _log(channel, at_ns, value)

    def _send_last(self, topic: str) -> None:
        """Send what a port had last to a viewer that begins to look; others get the same again."""
        if (last := self._last.get(topic)) is not None:
            _log(*last)

    def _channel(self, path: str, schema: dict[str, Any] | None) -> Any:  # noqa: ANN401 -- an extra
        topic = topic_of(self._board, path)
        return self._foxglove.Channel(
            topic, schema=schema, message_encoding="json", context=self._context
        )

    def close(self) -> None:
        """Send the viewers away. Again does nothing."""
        for channel in self._channels.values():
            channel.close()
        self._channels = {}
        self._server.stop()


class _Subscriptions:
    """Calls a function with the topic, in a thread of the SDK's, when a viewer begins to look."""

    def __init__(self, began: Callable[[str], None]) -> None:
        self._began = began

    def on_subscribe(self, _client: object, channel: Any) -> None:  # noqa: ANN401 -- an extra
        """A viewer looks at a channel."""
        self._began(channel.topic)

    def on_unsubscribe(self, _client: object, _channel: object) -> None:
        """A viewer looks at it no more."""


def _log(channel: Any, at_ns: int, value: object) -> None:  # noqa: ANN401 -- an extra
    said = plain(value)
    message = said if isinstance(said, dict) else {ALONE: said}
    channel.log(msgspec.json.encode(message), log_time=at_ns)


def topic_of(board: str, path: str) -> str:
    """The topic of a port, as an exported MCAP calls it: `/tachobot/ports/controller/yaw/...`."""
    return "/".join(("", ros_name(board), "ports", *map(ros_name, path.split("."))))


def schema_of(kind: type) -> dict[str, Any]:
    """The JSON schema of what `send` makes of values of a type: an object at the top."""
    found = _schema(inspect.type_info(kind))
    if found.get("type") != "object":
        found = {"type": "object", "properties": {ALONE: found}}
    return {"title": kind.__name__, **found}


_NAMES: Final[Mapping[type[inspect.Type], str]] = {
    inspect.BoolType: "boolean",
    inspect.IntType: "integer",
    inspect.FloatType: "number",
    inspect.StrType: "string",
    inspect.EnumType: "string",  # of a member its name
}


def _schema(of: inspect.Type) -> dict[str, Any]:
    """The schema of a type; empty for one that can be anything."""
    if (name := _NAMES.get(type(of))) is not None:
        return {"type": name}
    found: dict[str, Any] = {}
    match of:
        case inspect.VarTupleType() | inspect.ListType():
            found = {"type": "array", "items": _schema(of.item_type)}
        case inspect.TupleType():
            found = {"type": "array", "items": _of_union([*map(_schema, of.item_types)])}
        case inspect.NamedTupleType() | inspect.DataclassType() | inspect.StructType():
            fields = {each.name: _schema(each.type) for each in of.fields}
            found = {"type": "object", "properties": fields}
        case inspect.UnionType():
            known = (each for each in of.types if not isinstance(each, inspect.NoneType))
            found = _of_union([*map(_schema, known)])
    return found


def _of_union(schemas: list[dict[str, Any]]) -> dict[str, Any]:
    """The schema of what is one of these; empty where they differ."""
    return schemas[0] if schemas and schemas.count(schemas[0]) == len(schemas) else {}
