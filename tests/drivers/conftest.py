"""A bus of bare registers: each address has 256 bytes and a pointer, and no chip's behaviour.

For tests of what a driver sends and how it reads an answer; behaviour is the doubles' part.
"""

from collections.abc import Sequence
from typing import TypeAlias

import pytest

from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.wire_errors import NoAcknowledge

Wire: TypeAlias = list[tuple[int, tuple[Message, ...]]]


class RegisterBus(I2cBus):
    name = "i2c-1"

    def __init__(self, registers: dict[int, bytearray], wire: Wire) -> None:
        self.registers = registers
        self.wire = wire
        self.pointer = 0

    def transaction(self, address: int, messages: Sequence[Message]) -> bytes:
        self.wire.append((address, tuple(messages)))
        if address not in self.registers:
            raise NoAcknowledge(f"{self.name} address 0x{address:02x}: not acknowledged")
        memory = self.registers[address]
        answer = b""
        for message in messages:
            if isinstance(message, int):
                answer += memory[self.pointer : self.pointer + message]
            else:
                self.pointer = message[0]
                memory[self.pointer : self.pointer + len(message) - 1] = message[1:]
        return answer


@pytest.fixture
def registers() -> dict[int, bytearray]:
    """What each address holds; an address without an entry does not acknowledge."""
    return {}


@pytest.fixture
def wire() -> Wire:
    """Every transaction sent, in order."""
    return []


@pytest.fixture
def register_bus(registers: dict[int, bytearray], wire: Wire) -> I2cBus:
    return RegisterBus(registers, wire)
