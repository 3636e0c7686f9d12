"""The emulated computer: what is on its buses and lines, and chips that can be taken off them.

Chips are memories of 256 bytes with an address, and every byte that is sent to one is in the trace.
One more is on a bus of its own: what the checks write there tells the watch whether outputs may be
on (`tests.pi.watch`).
"""

import json
import struct
from pathlib import Path
from socket import AF_UNIX, socket
from typing import Final

from tests.pi.image import Image

TRACE: Final = "i2c.trace"
MONITOR: Final = "monitor.socket"
TREE: Final = "device-tree.dtb"
"""What a computer leaves, or listens at, in the folder of its logs."""
PWM, IMU = 0x40, 0x68
CHIPS: Final = (PWM, IMU, 0x58, 0x61, 0x62)
"""PCA9685, MPU-9250, MD25 and two CMPS12: addresses on the first bus of the header."""
NOTE: Final = 0x50
"""Address of what the watch is told, on another bus."""
NOWHERE: Final = 0x33
"""Where a chip answers that has vanished from its own address."""

BEGIN_NODE, END_NODE, PROPERTY, NOP = 1, 2, 3, 4
"""Tokens of a flattened device tree."""


def command(image: Image, kind: str, logs: Path, words: str, uart: str) -> list[str]:
    """Return what starts it; its checks write to its console.

    `words` go to its kernel; `uart` is the pseudo-terminal at the pins of its own UART, which the
    kernel would give to Bluetooth.
    """
    tree = logs / TREE
    tree.write_bytes(without(image.device_tree(kind).read_bytes(), "bluetooth"))
    memories = [f"i2c-bus.1,address=0x{address:02x},id=chip{address:02x}" for address in CHIPS]
    memories.append(f"i2c-bus.2,address=0x{NOTE:02x}")
    return [
        *(*image.qemu, "-M", "raspi3b", "-smp", "4", "-m", "1G", "-accel", "tcg,thread=multi"),
        *("-kernel", str(image.kernel(kind)), "-dtb", str(tree)),
        *("-initrd", str(image.initrd(kind)), "-no-reboot", "-display", "none"),
        *("-append", f"console=ttyS1,115200 quiet rdinit=/init panic=-1 {words}"),
        *("-serial", uart, "-serial", "stdio"),
        *("-qmp", f"unix:{logs / MONITOR},server=on,wait=off"),
        *("-D", str(logs / TRACE), "-trace", "i2c_event", "-trace", "i2c_send"),
        *(
            word
            for memory in memories
            for word in ("-device", f"at24c-eeprom,bus={memory},rom-size=256,address-size=1")
        ),
    ]


def without(tree: bytes, node: str) -> bytes:
    """Return a flattened device tree with nothing where its first node of that name was."""
    begin = tree.index(struct.pack(">I", BEGIN_NODE) + node.encode() + b"\0")
    at, depth = begin, 0
    while at == begin or depth:
        token, length = struct.unpack_from(">II", tree, at)
        at += 4
        if token == BEGIN_NODE:
            depth += 1
            at = tree.index(b"\0", at) // 4 * 4 + 4
        elif token == END_NODE:
            depth -= 1
        elif token == PROPERTY:
            at += 8 + -(-length // 4) * 4
    return tree[:begin] + struct.pack(">I", NOP) * ((at - begin) // 4) + tree[at:]


class Monitor:
    """QEMU's own control."""

    def __init__(self, path: Path) -> None:
        with socket(AF_UNIX) as connection:
            connection.settimeout(60)
            connection.connect(str(path))
            self._lines = connection.makefile("rw", encoding="utf-8")
        self._lines.readline()
        self._ask("qmp_capabilities")

    def place(self, address: int, new: int) -> None:
        """Let the chip of an address answer at another one, with its memory empty."""
        for name, value in (("realized", False), ("address", new), ("realized", True)):
            path = f"/machine/peripheral/chip{address:02x}"
            self._ask("qom-set", path=path, property=name, value=value)

    def freeze(self, drive: str, onward: Path) -> None:
        """Let what is on a drive stay as it is at this instant; the rest goes to another file."""
        self._ask("blockdev-snapshot-sync", **{"device": drive, "snapshot-file": str(onward)})

    def _ask(self, name: str, **arguments: object) -> None:
        self._lines.write(json.dumps({"execute": name, "arguments": arguments}) + "\n")
        self._lines.flush()
        while "return" not in (answer := json.loads(self._lines.readline())):
            if "error" in answer:
                raise ValueError(f"QEMU refuses {name}: {answer['error']['desc']}")
