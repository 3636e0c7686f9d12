"""Linux reality: a GPIO line as an output, through libgpiod's Python binding.

The kernel gives a line to one process and frees it when that process ends, whatever ends it. What
the pin does then is the pin controller's: on a Raspberry Pi it keeps its level unless
`dtparam=strict_gpiod` (or `pinctrl_bcm2835.persist_gpio_outputs=n`) is set; the doctor looks.
The binding is the extra `gpio` and is imported only for a board that has such a line.
Source: libgpiod 2, gpiod 2.5 for Python.
"""

import errno
from importlib import import_module
from typing import TYPE_CHECKING, Any

from firmware_runtime.hal.interlock import EnableLine
from firmware_runtime.hal.wire_errors import BusAbsent, BusFault, BusInUse, PortClosed
from firmware_runtime.system.packages import install_command

if TYPE_CHECKING:
    from gpiod.line_request import LineRequest

CONSUMER = "firmware-runtime"


def open_enable_line(
    name: str, chip: str, line: int, *, active_low: bool = True
) -> "LinuxEnableLine":
    """Take a line of a GPIO chip (`/dev/gpiochip0`) as an output at its disabling level.

    Raises BusAbsent if chip, line or binding is not there, BusInUse if another process has it.
    """
    gpiod = binding(name, chip)
    settings = gpiod.LineSettings(
        direction=gpiod.line.Direction.OUTPUT,
        active_low=active_low,
        output_value=gpiod.line.Value.INACTIVE,
    )
    try:
        request = gpiod.request_lines(chip, {line: settings}, consumer=CONSUMER)
    except (OSError, ValueError) as error:
        raise _absent(f"{name}: {chip} line {line}", error) from error
    return LinuxEnableLine(name, request, line)


def binding(name: str, chip: str) -> Any:  # noqa: ANN401 -- a module that may not be installed
    """Import libgpiod's Python binding. Raises BusAbsent without one, or for one of libgpiod 1."""
    found = ""
    try:
        gpiod = import_module("gpiod")
    except ImportError:
        pass
    else:
        if hasattr(gpiod, "request_lines"):
            return gpiod
        found = ", and the one here is that of libgpiod 1"
    raise BusAbsent(
        f"{chip} needs libgpiod's Python binding{found}",
        where=name,
        expected=f"the extra gpio: {install_command('gpio')}",
    )


class LinuxEnableLine(EnableLine):
    """A line of the Linux kernel, this process's alone while it is open."""

    def __init__(self, name: str, request: "LineRequest", line: int) -> None:
        self.name = name
        self._values = import_module("gpiod").line.Value
        self._request = request
        self._line = line
        self._closed = False

    def set(self, enabled: bool) -> None:  # noqa: FBT001 -- a line has two levels
        """Let outputs through or not. Raises BusFault if the line fails, PortClosed after close."""
        if self._closed:
            raise PortClosed("the line was used after it was closed", where=self.name)
        value = self._values.ACTIVE if enabled else self._values.INACTIVE
        try:
            self._request.set_value(self._line, value)
        except OSError as error:
            raise BusFault(
                f"line {self._line} cannot be set ({error.strerror})", where=self.name
            ) from error

    def close(self) -> None:
        """Disable the outputs and give the line up; closing twice is harmless."""
        if not self._closed:
            try:
                self.set(False)
            finally:
                self._closed = True
                self._request.release()


def _absent(where: str, error: OSError | ValueError) -> BusAbsent:
    """Return what is wrong with a line, and its fix, as one sentence."""
    number = error.errno if isinstance(error, OSError) else errno.EINVAL
    if number == errno.EBUSY:
        return BusInUse(f"{where} is held by another process, expected it free; end that one")
    if number in (errno.EACCES, errno.EPERM):
        return BusAbsent(f"{where} may not be opened by this user; add the user to its group, gpio")
    if number in (errno.ENOENT, errno.ENODEV):
        return BusAbsent(f"{where} does not exist", expected="a chip that `gpiodetect` shows")
    if number == errno.EINVAL:
        return BusAbsent(f"{where} does not exist on this chip", expected="one `gpioinfo` shows")
    return BusAbsent(f"{where} cannot be taken ({error})")
