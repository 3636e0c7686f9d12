"""What atomic and coupled models have in common: a name, a parent, ports."""

from typing import TYPE_CHECKING, TypeVar

from firmware_runtime.devs.errors import CouplingError
from firmware_runtime.devs.ports import InPort, OutPort

if TYPE_CHECKING:
    from firmware_runtime.devs.coupled import Coupled

T = TypeVar("T")


class Component:
    """A named model with typed ports; names are unique among its siblings and hold no dot."""

    def __init__(self, name: str) -> None:
        if not name or "." in name:
            raise CouplingError(f"component {name!r}: a name is not empty and holds no dot")
        self.name = name
        self.parent: Coupled | None = None
        self.in_ports: dict[str, InPort[object]] = {}
        self.out_ports: dict[str, OutPort[object]] = {}

    @property
    def path(self) -> str:
        """Names from the root to this model, joined by dots: `tachobot.controller.yaw`."""
        return self.name if self.parent is None else f"{self.parent.path}.{self.name}"

    def in_port(self, name: str, type_: type[T]) -> InPort[T]:
        """Declare an input port that carries values of one type."""
        self._refuse_taken(name, self.in_ports)
        port = InPort(self, name, type_)
        self.in_ports[name] = port  # type: ignore[assignment]
        return port

    def out_port(self, name: str, type_: type[T]) -> OutPort[T]:
        """Declare an output port that carries values of one type."""
        self._refuse_taken(name, self.out_ports)
        port = OutPort(self, name, type_)
        self.out_ports[name] = port  # type: ignore[assignment]
        return port

    def _refuse_taken(self, name: str, ports: object) -> None:
        if not name or "." in name:
            raise CouplingError(f"{self.path}: port {name!r}: a name is not empty and holds no dot")
        if name in ports:  # type: ignore[operator]
            raise CouplingError(f"{self.path}: port {name!r} is declared twice")
