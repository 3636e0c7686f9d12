"""What atomic and coupled models have in common: a name, a parent, ports."""

from typing import TypeVar

from firmware_runtime.devs.model_errors import CouplingError
from firmware_runtime.devs.ports import InPort, OutPort, Owner, Takes
from firmware_runtime.errors import legible

T = TypeVar("T")

_NO_NAME = "a name is a text, not empty, and holds no dot"


class Component(Owner):
    """A named model with typed ports; names are unique among its siblings and hold no dot."""

    def __init__(self, name: str) -> None:
        if not _is_name(name):
            raise CouplingError(f"component {name!r}: {_NO_NAME}")
        super().__init__(name)

    def in_port(self, name: str, type_: type[T], *, takes: Takes = "finite") -> InPort[T]:
        """Declare an input port that carries values of one type.

        A value with NaN or an infinity is withheld, and counted as a fault of this model. With
        `takes="infinities"` only NaN is; with "any" nothing is, and the model checks for itself.
        """
        check_constructed(self)
        if not _is_name(name) or name in self.in_ports or not isinstance(type_, type):
            raise CouplingError(self._misdeclared(name, type_))
        port = self.in_ports[name] = InPort(self, name, type_, takes=takes)
        return port

    def out_port(self, name: str, type_: type[T]) -> OutPort[T]:
        """Declare an output port that carries values of one type."""
        check_constructed(self)
        if not _is_name(name) or name in self.out_ports or not isinstance(type_, type):
            raise CouplingError(self._misdeclared(name, type_))
        port = self.out_ports[name] = OutPort(self, name, type_)
        return port

    def __repr__(self) -> str:
        kind = type(self).__name__
        return f"<{kind} {below_root(self.path)}>" if hasattr(self, "name") else f"<{kind}>"

    def _misdeclared(self, name: str, type_: object) -> str:
        where = f"{self.path}: port {name!r}"
        if not _is_name(name):
            return f"{where}: {_NO_NAME}"
        if not isinstance(type_, type):
            return f"{where}: a port's type is a class, not {type_!r}"
        return f"{where} is declared twice"


def below_root(path: str) -> str:
    """A path without the name of the root model."""
    return path.partition(".")[2] or path


def check_constructed(model: object) -> None:
    """Raise CouplingError for what is no model, or one whose `__init__` skipped `Component`'s."""
    if not isinstance(model, Component):
        raise CouplingError("expected a model, Atomic or Coupled", where=f"{model!r}")
    if not hasattr(model, "in_ports"):  # `vars` would make each access to the model slower
        missing = "its __init__ has not called super().__init__(name)"
        raise CouplingError(missing, where=type(model).__name__, expected="that call first")


def _is_name(name: object) -> bool:
    if not isinstance(name, str) or name == "" or "." in name:
        return False
    return name == legible(name)  # no file has a place for another
