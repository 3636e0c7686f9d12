"""What atomic and coupled models have in common: a name, a parent, ports."""

from typing import TypeVar

from firmware_runtime.devs.errors import CouplingError
from firmware_runtime.devs.ports import InPort, OutPort, Owner

T = TypeVar("T")


class Component(Owner):
    """A named model with typed ports; names are unique among its siblings and hold no dot."""

    def __init__(self, name: str) -> None:
        if not name or "." in name:
            raise CouplingError(f"component {name!r}: a name is not empty and holds no dot")
        super().__init__(name)

    def in_port(self, name: str, type_: type[T]) -> InPort[T]:
        """Declare an input port that carries values of one type."""
        if not name or "." in name or name in self.in_ports or not isinstance(type_, type):
            raise CouplingError(self._misdeclared(name, type_))
        port = self.in_ports[name] = InPort(self, name, type_)
        return port

    def out_port(self, name: str, type_: type[T]) -> OutPort[T]:
        """Declare an output port that carries values of one type."""
        if not name or "." in name or name in self.out_ports or not isinstance(type_, type):
            raise CouplingError(self._misdeclared(name, type_))
        port = self.out_ports[name] = OutPort(self, name, type_)
        return port

    def _misdeclared(self, name: str, type_: object) -> str:
        where = f"{self.path}: port {name!r}"
        if not name or "." in name:
            return f"{where}: a name is not empty and holds no dot"
        if not isinstance(type_, type):
            return f"{where}: a port's type is a class, not {type_!r}"
        return f"{where} is declared twice"
