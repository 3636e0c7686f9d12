"""The kernel's virtual USB host controller, `vhci_hcd`: plugs a device in, pulls it out.

The kernel wants a stream socket and speaks USB/IP on it from then on; the process at the other end
is the device. Needs root, and the modules vhci-hcd, i2c-tiny-usb and i2c-dev.
Source: Linux 6.1 drivers/usb/usbip/vhci_sysfs.c.
"""

from contextlib import suppress
from pathlib import Path
from socket import socket
from typing import Final

from firmware_runtime.system.programs import ProgramFailed, run_program
from sim_doubles.usbip.packets import NotAttached

CONTROLLER: Final = Path("/sys/devices/platform/vhci_hcd.0")
MODULES: Final = ("vhci-hcd", "i2c-tiny-usb", "i2c-dev")
FREE: Final = "004"
FULL_SPEED: Final = 2
_HIGH_SPEED_HUB: Final = "hs"


def load_modules() -> None:
    """Load what a virtual adapter needs. Raises NotAttached if the kernel has not got it."""
    try:
        ended = run_program(["/sbin/modprobe", "--all", *MODULES])
    except ProgramFailed as error:
        raise NotAttached(f"{error} (Debian: package kmod)") from error
    if ended.status != 0:
        expected = f"expected root, and a kernel with the modules {', '.join(MODULES)}"
        raise NotAttached(f"{ended.reason}; {expected}")


class HostController:
    """The controller whose files in sysfs are at `path`."""

    def __init__(self, path: Path = CONTROLLER) -> None:
        self._path = path

    def attach(self, device: socket, number: int) -> int:
        """Plug in the device at the other end of a stream socket; return the port it has.

        `number` is the device's own, for USB/IP. Raises NotAttached.
        """
        try:
            port = self._free_port()
            line = f"{port} {device.fileno()} {number} {FULL_SPEED}"
            (self._path / "attach").write_text(line, encoding="ascii")
        except OSError as error:
            raise NotAttached(
                f"{self._path}: {error.strerror}, expected root and the module vhci-hcd"
            ) from error
        return port

    def detach(self, port: int) -> None:
        """Pull a device out; one that has gone is gone."""
        with suppress(OSError):
            (self._path / "detach").write_text(str(port), encoding="ascii")

    def i2c_device(self, port: int) -> Path | None:
        """The device node of the adapter at a port, None until there is one."""
        for adapter in self._path.glob(f"usb*/*-{port + 1}/*/i2c-*/i2c-dev/i2c-*"):
            return Path("/dev", adapter.name)
        return None

    def _free_port(self) -> int:
        """The first free port of the slower hub. Raises NotAttached if all are taken."""
        lines = (self._path / "status").read_text(encoding="ascii").splitlines()
        for hub, port, state, *_ in (line.split() for line in lines[1:]):
            if hub == _HIGH_SPEED_HUB and state == FREE:
                return int(port)
        raise NotAttached(f"{self._path}: no port is free, expected one of {len(lines) - 1}")
