"""Clock source and time of day."""

import ctypes

from firmware_runtime.host.doctor.check import (
    Check,
    Finding,
    Machine,
    not_applicable,
    note,
    ok,
    warning,
)
from firmware_runtime.system.kernel_files import clock_source, clock_sources

_SLOW = {"hpet", "acpi_pm", "jiffies", "refined-jiffies"}
_UNSYNCHRONISED = 5
"""TIME_ERROR, adjtimex(2)."""
_ROOM_FOR_TIMEX = 512
"""More than a struct timex has on any machine; all zero asks for nothing to be set."""


def _source(machine: Machine) -> Finding:
    source = clock_source(machine.files)
    if source is None:
        return not_applicable("the clock source is not shown")
    others = [each for each in clock_sources(machine.files) if each != source]
    seen = f"{source} (of {', '.join([source, *others])})"
    if source not in _SLOW:
        return ok(seen)
    better = next((each for each in others if each not in _SLOW), None)
    return warning(seen, None if better is None else _choose(better))


def _choose(source: str) -> str:
    places = "/sys/devices/system/clocksource/clocksource0/current_clocksource"
    return f"echo {source} | sudo tee {places}"


def _wall_clock(_machine: Machine) -> Finding:
    try:
        synchronised = is_synchronised()
    except OSError as error:
        return not_applicable(f"adjtimex: {error.strerror}")
    return ok("synchronised") if synchronised else note("nothing sets it")


def is_synchronised() -> bool:
    """Return whether the time of day is right, says the kernel. Raises OSError if it does not."""
    library = ctypes.CDLL(None, use_errno=True)
    state = library.adjtimex(ctypes.create_string_buffer(_ROOM_FOR_TIMEX))
    if state < 0:
        raise OSError(ctypes.get_errno(), "the kernel refuses to say")
    return bool(state != _UNSYNCHRONISED)


CHECKS = (
    Check(
        "clock-source",
        "A slow clock source makes every reading of the time a system call of about a microsecond, "
        "and the loop reads it several times a step.",
        _choose("tsc"),
        _source,
    ),
    Check(
        "wall-clock",
        "The loop does not use the time of day, but logs and recordings of several computers "
        "compare only if theirs agree.",
        "sudo timedatectl set-ntp true",
        _wall_clock,
    ),
)
