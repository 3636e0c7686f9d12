"""How large a recording has to be for so many minutes of a board, by what it asks of its buses.

An estimate: a transaction that recurs brings a step or two, each with a few readings of the clock
and the values that its models send; a model that computes alone is not seen in it.
"""

import os
from collections.abc import Iterable
from typing import Final

from msgspec import Struct

from firmware_runtime.devs.time import SECOND
from firmware_runtime.hal.budget import BusLoad, wire_bytes
from firmware_runtime.recording.blackbox.layout import LARGEST_CHUNK, PREFIX_SIZE, SMALLEST_CHUNK

BYTES_PER_TRANSACTION: Final = 250
"""What comes with a transaction, beside its own bytes."""
BYTES_PER_SECOND: Final = 8_000
"""What comes without any: keyframes, and models that touch no bus."""
LEAST: Final = 2 << 20
MOST: Final = 256 << 20
MOST_OF_MEMORY: Final = 1 / 16
"""The share of the machine's memory that one recording may take."""
CHUNKS: Final = 32


class Size(Struct, frozen=True):
    """The chunks of a recording."""

    chunk_bytes: int
    chunks: int

    @property
    def bytes(self) -> int:
        """The whole file."""
        return PREFIX_SIZE + self.chunk_bytes * self.chunks


def most() -> int:
    """Bytes of a recording on this machine at most."""
    memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    return min(max(round(memory * MOST_OF_MEMORY), LEAST), MOST)


def size_for(loads: Iterable[BusLoad], minutes: float) -> Size:
    """Room for so many minutes, from 2 to 256 MiB, or to what this machine's memory allows."""
    wanted = min(max(round(bytes_per_second(loads) * 60 * minutes), LEAST), most())
    chunk = min(max(-(-wanted // CHUNKS), SMALLEST_CHUNK), LARGEST_CHUNK)
    return Size(chunk, -(-wanted // chunk) + 1)  # the oldest is given up while another is begun


def seconds_held(loads: Iterable[BusLoad], minutes: float) -> float:
    """How much of a run is in it, s: what was asked for, or less where that takes too much."""
    loads = list(loads)
    return min(minutes * 60, most() / bytes_per_second(loads))


def bytes_per_second(loads: Iterable[BusLoad]) -> float:
    """What these buses bring."""
    return BYTES_PER_SECOND + sum(
        (wire_bytes(each.messages) + BYTES_PER_TRANSACTION) * SECOND / each.period_ns
        for load in loads
        for each in load.transactions
    )
