"""What a model can do to be late: page faults, garbage, retries, computing, a disk.

Each does it for some 3 to 8 ms. The device hangs on an adapter that takes its time on the wire, as
a real one does: the thread sleeps meanwhile.
"""

import gc
import mmap
import os
import random
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from pathlib import Path
from time import monotonic_ns, sleep

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.hal.budget import framed_bits, wire_bytes, wire_ns
from firmware_runtime.hal.errors import NoAcknowledge
from firmware_runtime.hal.i2c import I2cBus, Message

DEVICE = 0x68
HZ = 100_000
_ANONYMOUS = 64 << 20
_PIECE = 4 << 20
_BLOCK, _LARGEST_BLOCK = 1 << 22, 1 << 24
_LONG_ENOUGH_MS = 3
_OBJECTS = 150_000


class SlowAdapter(I2cBus):
    """A bus of 100 kHz on which one device answers zeros, but for the next `silent` attempts."""

    def __init__(self) -> None:
        self.name = "i2c-bench"
        self.silent = 0

    def transaction(self, address: int, messages: Sequence[Message]) -> bytes:
        """Sleep for as long as the bits take. Raises NoAcknowledge while the device is silent."""
        bits = framed_bits(wire_bytes(messages), len(messages))
        sleep(wire_ns(bits, HZ) / SECOND)
        if self.silent > 0:
            self.silent -= 1
            raise NoAcknowledge(self.name, address)
        return bytes(sum(each for each in messages if isinstance(each, int)))


class Act(ABC):
    """Something that makes a step late when it is called; what it needs is made beforehand."""

    def prepare(self) -> None:  # noqa: B027 -- most need nothing
        """Do a part of what is needed, in each tick before it."""

    @abstractmethod
    def __call__(self) -> None:
        """Make this step late."""


class Faults(Act):
    """Memory that is not there, by turns: fresh pages of the process, and pages of a file.

    Each time has a piece of the file of its own, which no time before has fetched: dropping pages
    takes its time, too, and is no fault.
    """

    def __init__(self, folder: Path, rng: random.Random, times: int) -> None:
        self._rng = rng
        self._acts = 0
        self._memory = mmap.mmap(-1, _ANONYMOUS)
        self._memory.madvise(mmap.MADV_NOHUGEPAGE)
        path = folder / "pages"
        with path.open("wb") as file:
            for _ in range(times // 2 + 1):
                file.write(os.urandom(_PIECE))
        self._descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
        os.fsync(self._descriptor)
        os.posix_fadvise(self._descriptor, 0, 0, os.POSIX_FADV_DONTNEED)

    def __call__(self) -> None:
        """Touch them one by one until it has taken long enough."""
        until = monotonic_ns() + self._rng.randint(3, 8) * MILLISECOND
        piece, is_file = divmod(self._acts, 2)
        if is_file:
            at = piece * _PIECE
            with mmap.mmap(self._descriptor, _PIECE, prot=mmap.PROT_READ, offset=at) as pages:
                pages.madvise(mmap.MADV_RANDOM)  # or the kernel fetches many at a time
                _read(pages, until)
        else:
            self._memory.madvise(mmap.MADV_DONTNEED)
            _write(self._memory, until)
        self._acts += 1


def _read(pages: mmap.mmap, until: int) -> None:
    for at in range(0, len(pages), mmap.PAGESIZE):
        pages[at]
        if monotonic_ns() > until:
            return


def _write(memory: mmap.mmap, until: int) -> None:
    for at in range(0, len(memory), mmap.PAGESIZE):
        memory[at] = 1
        if monotonic_ns() > until:
            return


class Garbage(Act):
    """A collection that has many objects to look at, though it frees none of them."""

    def __init__(self) -> None:
        self._objects: list[list[object]] = []

    def prepare(self) -> None:
        """Make them, in the first tick: what is there before the run is left out of collections."""
        if not self._objects:
            self._objects = [[each] for each in range(_OBJECTS)]

    def __call__(self) -> None:
        """Collect."""
        gc.collect()


class Computing(Act):
    """A model whose own code takes long."""

    def __init__(self, rng: random.Random) -> None:
        self._rng = rng

    def __call__(self) -> None:
        """Compute."""
        until = monotonic_ns() + self._rng.randint(3, 8) * MILLISECOND
        while monotonic_ns() < until:
            pass


class Silence(Act):
    """A device that does not acknowledge, twice."""

    def __init__(self, adapter: SlowAdapter) -> None:
        self._adapter = adapter

    def __call__(self) -> None:
        """Have the next two attempts fail."""
        self._adapter.silent = 2


class Sync(Act):
    """A file that is written and has to be on the disk before it goes on.

    Past the cache where the file system can, so that it is the disk that takes the time and not the
    copying; in blocks so large that a quick disk, too, takes longer than the call does.
    """

    def __init__(self, folder: Path) -> None:
        flags = os.O_RDWR | os.O_CREAT | os.O_CLOEXEC
        path = folder / "synced"
        try:
            self._descriptor = os.open(path, flags | os.O_DIRECT)
        except OSError:  # a file system without it
            self._descriptor = os.open(path, flags)
        self._block = _random(_BLOCK)
        while len(self._block) < _LARGEST_BLOCK and self._written() < _LONG_ENOUGH_MS * MILLISECOND:
            self._block = _random(2 * len(self._block))

    def __call__(self) -> None:
        """Write and wait, until it has taken 6 ms."""
        until = monotonic_ns() + 6 * MILLISECOND
        while monotonic_ns() < until:
            self._written()

    def _written(self) -> int:
        """Write the block and wait for it; ns that it took."""
        began = monotonic_ns()
        os.pwrite(self._descriptor, self._block, 0)
        os.fsync(self._descriptor)
        return monotonic_ns() - began


def _random(size: int) -> mmap.mmap:
    """So many random bytes; direct writes want whole pages."""
    block = mmap.mmap(-1, size)
    block.write(os.urandom(size))
    return block


def act(cause: str, adapter: SlowAdapter, folder: Path, rng: random.Random, times: int) -> Act:
    """What makes a step late so many times, by the name of the cause."""
    made: dict[str, Callable[[], Act]] = {
        "faults": lambda: Faults(folder, rng, times),
        "garbage": Garbage,
        "retries": lambda: Silence(adapter),
        "slow-model": lambda: Computing(rng),
        "sync": lambda: Sync(folder),
    }
    return made[cause]()
