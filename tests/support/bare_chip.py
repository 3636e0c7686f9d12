"""A driver on a bus of bare registers: each address has 256 bytes and a pointer, and no behaviour.

For tests of what a driver sends and how it reads an answer; behaviour is the doubles' part.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Generic, Protocol, TypeAlias, TypeVar

from firmware_drivers.chips.step import Step

from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.wire_errors import NoAcknowledge

Content: TypeAlias = Mapping[int, bytes]


class RegisterBus(I2cBus):
    """Keeps every transaction in `wire`; an address without memory does not acknowledge."""

    name = "i2c-1"

    def __init__(self) -> None:
        self.memory: dict[int, bytearray] = {}
        self.wire: list[tuple[int, tuple[Message, ...]]] = []
        self.pointer = 0

    def transaction(self, address: int, messages: Sequence[Message]) -> bytes:
        self.wire.append((address, tuple(messages)))
        if address not in self.memory:
            raise NoAcknowledge(f"{self.name} address 0x{address:02x}: not acknowledged")
        memory = self.memory[address]
        answer = b""
        for message in messages:
            if isinstance(message, int):
                answer += memory[self.pointer : self.pointer + message]
            else:
                self.pointer = message[0]
                memory[self.pointer : self.pointer + len(message) - 1] = message[1:]
        return answer


class BringsUp(Protocol):
    """A driver of a chip."""

    def bring_up(self) -> Iterable[Step]:
        """Give the steps from any state to ready."""


D = TypeVar("D", bound=BringsUp)


class BareChip(Generic[D]):
    """A driver at an address; what its registers hold is set by `hold`."""

    def __init__(self, make: Callable[[I2cBus], D], address: int, content: Content) -> None:
        self.address = address
        self.bus = RegisterBus()
        self.hold(content)
        self.driver = make(self.bus)

    def hold(self, content: Content, address: int | None = None) -> None:
        """Put bytes into registers."""
        at = self.address if address is None else address
        memory = self.bus.memory.setdefault(at, bytearray(256))
        for register, data in content.items():
            memory[register : register + len(data)] = data

    @property
    def memory(self) -> bytearray:
        return self.bus.memory[self.address]

    def bring_up(self) -> None:
        for step in self.driver.bring_up():
            step.action()
            self.after_step()

    def after_step(self) -> None:
        """Do what the chip would have done by then."""

    @property
    def sent(self) -> list[tuple[Message, ...]]:
        """The messages to this address, by transaction."""
        return [messages for address, messages in self.bus.wire if address == self.address]

    @property
    def written(self) -> list[Message]:
        """What was written to this address and not read, by transaction."""
        return [messages[0] for messages in self.sent if len(messages) == 1]

    @contextmanager
    def silent(self, address: int | None = None) -> Iterator[None]:
        """Take the chip, or another one, off the bus for a while."""
        gone = self.bus.memory.pop(address or self.address)
        yield
        self.bus.memory[address or self.address] = gone
