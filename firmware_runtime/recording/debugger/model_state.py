"""The models of a robot by their paths below the root, and what they hold."""

from collections.abc import Callable, Iterator, Mapping
from typing import Final

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.ports import InPort, OutPort
from firmware_runtime.devs.senders import Senders
from firmware_runtime.errors import ConfigError, did_you_mean

FUNCTIONS: Final = ("output", "internal", "external", "confluent")
_PLUMBING: Final = ("name", "parent", "in_ports", "out_ports", "path", "components", "couplings")


class Models:
    """All components of a model, by path: `controller.yaw`."""

    def __init__(self, root: Component) -> None:
        self.by_path: dict[str, Component] = {}
        self._senders = Senders(root)
        self.update(root)

    def update(self, root: Component) -> None:
        """Be those of another robot, built in the same way."""
        self.by_path.clear()
        self.by_path.update(_below(root, ""))

    def component(self, path: str) -> Component:
        """The one of that path. Raises ConfigError."""
        if path not in self.by_path:
            raise unknown(path, self.by_path)
        return self.by_path[path]

    def sender(self, name: str, port: str) -> str:
        """The port whose values leave this one; a coupled model only passes them on.

        Raises ConfigError where several do: which of their values was the last is not known.
        """
        path = f"{name}.{port}"
        sender, *others = self._senders.of(path)
        if others:
            names = ", ".join((sender, *others))
            raise ConfigError.of_one(path, "several send through it", expected=f"one of {names}")
        return sender

    def split(self, path: str) -> tuple[str, list[str]]:
        """The longest path that a dotted name begins with, and the rest. Raises ConfigError."""
        words = path.split(".")
        for count in range(len(words), 0, -1):
            if (name := ".".join(words[:count])) in self.by_path:
                return name, words[count:]
        raise unknown(path, self.by_path)

    def function(self, path: str) -> tuple[Atomic, str]:
        """Model and function of a name such as `controller.yaw.internal`. Raises likewise."""
        name, rest = self.split(path)
        model = self.by_path[name]
        if len(rest) != 1 or rest[0] not in FUNCTIONS or not isinstance(model, Atomic):
            expected = f"expected an atomic model and one of {', '.join(FUNCTIONS)}"
            raise ConfigError.of_one(path, f"no function of a model; {expected}")
        return model, rest[0]

    def atomics(self, path: str) -> Iterator[tuple[str, Atomic]]:
        """The atomic of that path, or all below it. Raises ConfigError."""
        self.component(path)
        for name, each in self.by_path.items():
            if (name == path or name.startswith(f"{path}.")) and isinstance(each, Atomic):
                yield name, each


def unknown(path: str, known: Mapping[str, object]) -> ConfigError:
    """The error of a name that no model has."""
    hint = did_you_mean(path, list(known)) or "; expected one that `models` lists"
    return ConfigError.of_one(path, f"no such model{hint}")


def state_of(atomic: Atomic) -> dict[str, object]:
    """Its attributes, ports and functions left out; phase and sigma first."""
    held = dict(vars(atomic))
    for kind in type(atomic).__mro__:
        for name in getattr(kind, "__slots__", ()):
            if hasattr(atomic, name):
                held.setdefault(name, getattr(atomic, name))
    first = {name: held.pop(name) for name in ("phase", "sigma") if name in held}
    return first | {
        name: value
        for name, value in held.items()
        if name not in _PLUMBING and not _is_plumbing(value)
    }


def _is_plumbing(value: object) -> bool:
    return isinstance(value, InPort | OutPort | Component | Callable)


def _below(component: Component, path: str) -> Iterator[tuple[str, Component]]:
    if not isinstance(component, Coupled):
        return
    for name, each in component.components.items():
        inner = f"{path}.{name}" if path else name
        yield inner, each
        yield from _below(each, inner)


def value_of(start: object, words: list[str], path: str) -> object:
    """An attribute of an attribute. Raises ConfigError where there is none."""
    found = start
    for word in words:
        if isinstance(found, dict) and word in found:
            found = found[word]
        elif not word.startswith("__") and hasattr(found, word):
            found = getattr(found, word)
        else:
            names = [each for each in dir(found) if not each.startswith("__")]
            hint = did_you_mean(word, names) or "; expected a port or an attribute"
            raise ConfigError.of_one(path, f"{type(found).__name__} has no {word}{hint}")
    return found
