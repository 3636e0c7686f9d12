"""Output lines: do they fall back when a program dies, and may this user use them."""

from firmware_runtime.hal.linux_gpio import binding
from firmware_runtime.hal.wire_errors import BusAbsent
from firmware_runtime.host.doctor.check import (
    Check,
    Finding,
    Machine,
    failure,
    nodes_usable,
    not_applicable,
    note,
    ok,
    warning,
)

_PERSIST = "/sys/module/pinctrl_*/parameters/persist_gpio_outputs"


def _persistence(machine: Machine) -> Finding:
    found = machine.files.matching(_PERSIST)
    if not found:
        return not_applicable("no pin controller with persist_gpio_outputs is shown")
    value = machine.files.text(found[0])
    if value is None:
        return not_applicable(f"{found[0]} may not be read by this user")
    module = found[0].split("/")[3]
    seen = f"{module}.persist_gpio_outputs={value}"
    return warning(seen) if value in {"Y", "1"} else ok(seen)


def _usable(machine: Machine) -> Finding:
    chips = machine.files.matching("/dev/gpiochip*")
    if not chips:
        return not_applicable("no /dev/gpiochip*")
    found = nodes_usable(machine, chips)
    # No board drives a line itself, so this keeps none of them from running.
    return note(found.seen, found.fix) if found.status.needs_attention else found


def _library(machine: Machine) -> Finding:
    try:
        release: str = binding("output_enable", "an enable line").__version__
    except BusAbsent as error:
        wanted = machine.demands is not None and machine.demands.has_enable_line
        return (failure if wanted else note)(f"{error.what}")
    return ok(f"gpiod {release} for Python, of libgpiod 2")


CHECKS = (
    Check(
        "gpio-persistence",
        "The kernel of a Raspberry Pi lets an output line keep its level when the program that "
        "drove it dies: an enable line then stays on.",
        "dtparam=strict_gpiod in /boot/firmware/config.txt, or "
        "pinctrl_bcm2835.persist_gpio_outputs=n on the kernel's command line; restart",
        _persistence,
    ),
    Check(
        "gpio-access",
        "A program that drives an enable line opens the GPIO chip as the user it is started by.",
        "sudo usermod -aG gpio $USER, then log in again; SupplementaryGroups=gpio in the unit",
        _usable,
    ),
    Check(
        "gpio-library",
        "An enable line is driven by libgpiod 2, as Debian has it from 13 (trixie) on; its binding "
        "for Python brings the library with it, so on 12 it works beside the system's libgpiod 1.",
        "python -m pip install 'gpiod>=2.2', in the environment of firmware-runtime; Debian's "
        "python3-libgpiod before 13 is that of libgpiod 1",
        _library,
    ),
)
