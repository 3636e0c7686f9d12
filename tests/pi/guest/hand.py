"""The host's hand: writes into memories, and sends on a serial line, what the host says.

A line is an address and a message, in hex: `40 fd00`. One that begins with `body` is what a device
sends at /dev/body, which is a pseudo-terminal. Before it stands its checksum: a console loses bytes
while its computer is busy.
"""

import os
import sys
import tty
from contextlib import suppress
from pathlib import Path
from typing import Final
from zlib import crc32

from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.linux import open_i2c
from firmware_runtime.hal.wire_errors import HalError, NoAcknowledge
from tests.pi.guest.emulated import BUS
from tests.vm.guest.report import PORT

BODY: Final = Path("/dev/body")
PRIORITY: Final = 70
"""Above any run: a chip does not wait for one."""


def with_checksum(line: bytes) -> bytes:
    """Return a line as it is sent here."""
    return b"%08x %s" % (crc32(line), line)


def main(timeout_ms: int) -> None:
    """Do what each line says, until it is ended."""
    line, end = os.openpty()
    tty.setraw(end)
    os.set_blocking(line, False)
    BODY.symlink_to(os.ttyname(end))
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    memories = open_i2c("memories", BUS, timeout_ms=timeout_ms)
    with Path(PORT).open("rb") as lines:
        for each in lines:
            said = each.strip().partition(b" ")[2]
            if each.strip() != with_checksum(said):
                continue
            where, _, content = said.decode("ascii").partition(" ")
            if where != "body":
                _write(memories, int(where, 16), bytes.fromhex(content))
                continue
            with suppress(BlockingIOError):  # the device is not read
                os.write(line, bytes.fromhex(content))


def _write(memories: I2cBus, address: int, message: bytes) -> None:
    """Write until it is written; into a chip that has vanished nothing is."""
    while True:
        try:
            return memories.write(address, message)
        except NoAcknowledge:
            return None
        except HalError as error:
            print(error, flush=True)  # noqa: T201 -- its log


if __name__ == "__main__":
    main(int(sys.argv[1]))
