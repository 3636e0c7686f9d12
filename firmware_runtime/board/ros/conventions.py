"""A convention: which ROS 2 messages the values of a Python type become, and are made of.

Without ROS: a message's fields are plain dictionaries, lists and numbers, and a message that came
is anything with its fields as attributes. What a type of a driver or of a robot's own is, its
package says by an entry point of the group `firmware_runtime.ros_messages` that names a
`Convention`; types of numbers, texts and records of numbers need none (`plain_types`).

Values are as a trace shows them (`statistics/trace_file`): records are dictionaries, and numbers
that are not finite are the texts `nan`, `inf` and `-inf`, which `float` reads.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final, TypeAlias

from firmware_runtime.devs.component import Component
from firmware_runtime.errors import ConfigError, SettingError, text_of
from firmware_runtime.system.packages import installed

GROUP: Final = "firmware_runtime.ros_messages"

Fields: TypeAlias = dict[str, Any]
"""A message's fields by name, at any depth; those left out keep their defaults."""
Options: TypeAlias = Mapping[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Outgoing:
    """One topic that an output port of the type is published on."""

    type: str
    """Of the message, such as `sensor_msgs/msg/Imu`."""
    fields: Callable[[Any, Options], Fields | None]
    """The fields of a value's message, without its header; None if there is nothing to publish.

    Raises TypeError, ValueError, KeyError or IndexError for a value that it cannot be made of.
    """
    leaf: str = ""
    """Last part of the topic's name, below the name of the port's component or `Convention.base`;
    empty: the topic is named as the port is."""
    is_stamped: bool = False
    """Whether the message has a header, which bears the instant of the value."""
    is_event: bool = False
    """Whether each value counts, so that none is left out unless the board file states a rate."""
    frame: str = ""
    """The header's frame; empty: that of the port's component, such as `imu_link`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Incoming:
    """One type of message that an input port of the type takes."""

    type: str
    value: Callable[[Any, Options], object]
    """The value that a message stands for, in JSON's types, its numbers finite or not.

    Raises ValueError with a sentence for a message that cannot be obeyed.
    """
    is_stamped: bool = False
    """Whether the message has a header; one that is too old is refused then."""
    is_sensor: bool = False
    """Whether it is what a sensor measures: taken with the best-effort QoS of sensor data."""
    record: Mapping[str, bool] = field(default_factory=dict)
    """Of an array: the fields that its numbers are, and whether they are whole numbers."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Convention:
    """Messages of ROS 2 for values of a type, or for one port of a kind of component."""

    of: type[object]
    """The type of the value; with `port`, the component's class."""
    port: str = ""
    out: tuple[Outgoing, ...] = ()
    into: tuple[Incoming, ...] = ()
    base: str | None = None
    """Name that the topics stand below where one port alone has such a convention: `imu`, or empty:
    right below the namespace. Where several have, and for None, the component's name."""
    options: Options = field(default_factory=dict)
    """Numbers that a board file may state, with their defaults; NaN where there is none."""
    options_of: Callable[[Component], Options] = lambda _component: {}
    """Those of them that the component itself knows."""

    def is_for(self, component: Component, port: str, kind: type[object]) -> bool:
        """Return whether it is the convention of a port of this component and type."""
        if self.port:
            return isinstance(component, self.of) and port == self.port
        return issubclass(kind, self.of)


def conventions() -> Mapping[str, Convention]:
    """Return the conventions that packages provide, by the names of their entry points.

    The ones of a component's port come first: they say more than a type does. Raises ConfigError.
    """
    found = {each.name: _loaded(each.name, each.load) for each in installed(GROUP)}
    return dict(sorted(found.items(), key=lambda item: not item[1].port))


def _loaded(name: str, load: Callable[[], object]) -> Convention:
    where = f"entry point {name} of the group {GROUP}"
    try:
        loaded = load()
    except Exception as error:
        raise ConfigError.of_one(where, f"{type(error).__name__}: {text_of(error)}") from error
    if not isinstance(loaded, Convention):
        raise ConfigError.of_one(where, f"{loaded!r}: expected a Convention")
    return loaded


def finite(number: float, what: str) -> float:
    """The number. Raises SettingError if it is not finite."""
    if not abs(number) < float("inf"):
        raise SettingError(number, where=what, expected="a finite number")
    return number
