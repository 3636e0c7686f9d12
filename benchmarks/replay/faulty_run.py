"""A run on doubles that fail by a seed: `python -m benchmarks.replay.faulty_run SEED WORD...`.

The words are those of the command `firmware-runtime`. NACKs, lost arbitration, a stuck line, wrong
bits and brown-outs of single chips strike at random transactions of every bus.
"""

import errno
import sys
from random import Random

from firmware_runtime.board import rigs
from firmware_runtime.board.registry import Board
from firmware_runtime.board.rig import Rig
from firmware_runtime.cli.main import main
from firmware_runtime.hal.budget import WireClock
from firmware_runtime.runs import hardware
from sim_doubles.faults import (
    AdapterError,
    BrownOut,
    Fault,
    FaultScript,
    FlippedBit,
    NackAddress,
    NackByte,
)
from sim_doubles.i2c_bus import I2cBusDouble

TRANSACTIONS = 400
"""Within which the faults strike; the first are those that bring chips up."""


def run(seed: int, words: list[str]) -> int:
    """Carry out the command with failing doubles; return its exit status."""
    random = Random(seed)  # noqa: S311 -- repeatable, not secret

    def failing_rig(board: Board, clock: WireClock) -> Rig:
        rig = rigs.rig_for(board, clock)
        for bus in rig.buses.values():
            if isinstance(bus, I2cBusDouble):
                bus.faults = FaultScript(_faults(random, bus))
        return rig

    setattr(hardware, "rig_for", failing_rig)  # noqa: B010 -- the run makes its doubles by it
    return main(words)


def _faults(random: Random, bus: I2cBusDouble) -> list[Fault]:
    found: list[Fault] = []
    for _ in range(random.randint(3, 12)):
        first, times = random.randint(8, TRANSACTIONS), random.choice((1, 1, 2, 5))
        found.append(
            random.choice(
                [
                    NackAddress(first=first, times=times),
                    NackByte(first=first, times=times, index=random.randint(0, 3)),
                    AdapterError(first=first, times=times, errno=errno.EAGAIN),
                    AdapterError(first=first, times=times, errno=errno.ETIMEDOUT),
                    FlippedBit(first=first, times=times, index=0, bit=random.randint(0, 7)),
                    BrownOut(first=first, target=random.choice(list(bus.targets))),
                ]
            )
        )
    return found


if __name__ == "__main__":
    sys.exit(run(int(sys.argv[1]), sys.argv[2:]))
