"""Processors: awake, at full speed, and the loop's own."""

from collections.abc import Sequence

from firmware_runtime.host.doctor.check import (
    Check,
    Finding,
    Machine,
    failure,
    may_write,
    not_applicable,
    note,
    ok,
    warning,
)
from firmware_runtime.system.kernel_files import (
    cpu_list,
    governors,
    isolated,
    kernel_log,
    online,
    status,
    tickless,
    virtualised,
)

_LATENCY = "/dev/cpu_dma_latency"
_THROTTLED = "/sys/devices/platform/soc*/*firmware/get_throttled"
_UNDERVOLTAGE = "/sys/class/hwmon/hwmon*/in0_lcrit_alarm"
_LOGGED_UNDERVOLTAGE = "Undervoltage detected!"
_FIRMWARE_BITS = {
    0: "the voltage is too low",
    1: "the frequency is capped",
    2: "it is throttled",
    3: "it is at its soft temperature limit",
    16: "the voltage has been too low since the start",
    17: "the frequency has been capped since the start",
    18: "it has been throttled since the start",
    19: "it has been at its soft temperature limit since the start",
}
"""What the firmware of a Raspberry Pi answers to `vcgencmd get_throttled`, by bit."""
_NOW = 0xF
_NO_PRESSURE = "the kernel does not count who waits (PSI is off)"
_ASK_PRESSURE = (
    "psi=1 on the kernel's command line, on a Raspberry Pi in /boot/firmware/cmdline.txt; restart"
)


def _governor(machine: Machine) -> Finding:
    found = governors(machine.files)
    if not found:
        return not_applicable("no frequency scaling is shown")
    seen = ", ".join(found)
    return ok(seen) if found == ["performance"] else warning(seen)


def _throttling(machine: Machine) -> Finding:
    if not machine.is_raspberry_pi:
        return not_applicable("no Raspberry Pi")
    shown = map(machine.files.text, machine.files.matching(_THROTTLED))
    bits = [_hexadecimal(text) for text in shown if text]
    if bits and bits[0] is not None:
        return _of_firmware(bits[0])
    return _of_voltage_monitor(machine)


def _hexadecimal(text: str) -> int | None:
    try:
        return int(text, 16)
    except ValueError:
        return None


def _of_firmware(bits: int) -> Finding:
    said = "; ".join(words for bit, words in _FIRMWARE_BITS.items() if bits >> bit & 1)
    if not said:
        return ok("the firmware reports none (0)")
    return failure(f"{said} (0x{bits:x})") if bits & _NOW else warning(f"{said} (0x{bits:x})")


def _of_voltage_monitor(machine: Machine) -> Finding:
    """The kernel's own monitor, which knows the voltage only; what was is in the log."""
    alarms = [
        machine.files.integer(path)
        for path in machine.files.matching(_UNDERVOLTAGE)
        if machine.files.text(f"{path.rpartition('/')[0]}/name") == "rpi_volt"
    ]
    if 1 in alarms:
        return failure("the voltage is too low")
    times = sum(_LOGGED_UNDERVOLTAGE in line for line in kernel_log(machine.files) or ())
    if times:
        return warning(f"the voltage has been too low {times} times since the start, says the log")
    if alarms:
        return ok("the voltage is high enough")
    return not_applicable("neither get_throttled nor the voltage monitor is shown")


def _latency_request(machine: Machine) -> Finding:
    if not machine.files.exists(_LATENCY):
        return not_applicable(f"no {_LATENCY}")
    if may_write(machine.files.path(_LATENCY)):
        return ok(f"{_LATENCY} may be written")
    seen = f"{_LATENCY} may not be written by this user"
    asked = machine.demands is not None and machine.demands.keep_cpu_awake
    return warning(f"{seen}; the board asks for it") if asked else note(seen)


def _allowed(machine: Machine) -> Finding:
    wanted = machine.demands.cpus if machine.demands else ()
    if not wanted:
        return not_applicable("no board, or one that names no processors")
    allowed = cpu_list(status(machine.files, "Cpus_allowed_list"))
    if allowed is None:
        return not_applicable("/proc/self/status is not shown")
    missing = sorted(set(wanted) - set(allowed))
    seen = f"{list(wanted)} wanted, {allowed} allowed"
    return failure(seen) if missing else ok(seen)


def _isolated(machine: Machine) -> Finding:
    cpus = isolated(machine.files)
    if cpus is None:
        return not_applicable("/sys/devices/system/cpu/isolated is not shown")
    seen = f"isolated: {cpus or 'none'}, without a tick: {tickless(machine.files) or 'none'}"
    wanted = machine.demands.cpus if machine.demands else ()
    if wanted and not set(wanted) <= set(cpus):
        return note(f"{seen}; the board runs on {list(wanted)}", _isolating(wanted))
    if cpus and machine.demands and not wanted:
        return note(f"{seen}; the board does not use them", f"cpus = {cpus} under [executive]")
    return ok(seen) if cpus else note(seen)


def _isolating(cpus: Sequence[int]) -> str:
    listed = ",".join(map(str, cpus))
    return f"add isolcpus={listed} nohz_full={listed} to the kernel's command line"


def _virtual(machine: Machine) -> Finding:
    answer = virtualised(machine.files)
    if answer is None:
        return not_applicable("neither processor, device tree nor DMI shows it")
    return note("a virtual machine") if answer else ok("a real one, as far as can be seen")


def _load(machine: Machine) -> Finding:
    words = (machine.files.text("/proc/loadavg") or "").split()
    cpus = online(machine.files)
    if not words or cpus is None:
        return not_applicable("the load or the number of processors is not shown")
    seen = f"{words[0]} runnable in the last minute on {cpus} processors"
    pressure = _pressure(machine)
    if pressure is not None:
        seen += f", something waited for one {pressure:g} % of the last 10 s"
    if float(words[0]) >= cpus or (pressure or 0.0) >= 10:
        return warning(seen)
    return ok(seen) if pressure is not None else note(f"{seen}; {_NO_PRESSURE}", _ASK_PRESSURE)


def _pressure(machine: Machine) -> float | None:
    """Share of the last ten seconds in which something waited for a processor, in percent."""
    words = (machine.files.text("/proc/pressure/cpu") or "").replace("=", " ").split()
    return float(words[2]) if words[:2] == ["some", "avg10"] else None


CHECKS = (
    Check(
        "governor",
        "A governor that saves power lowers the clock while the loop waits; the next step then "
        "begins slow and takes longer.",
        "echo performance | sudo tee /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor; for "
        "good: cpufreq.default_governor=performance on the kernel's command line (Raspberry Pi OS "
        "starts with ondemand)",
        _governor,
    ),
    Check(
        "undervoltage-throttling",
        "A Raspberry Pi with too weak a supply, or too hot, slows its processor down without "
        "a word to any program.",
        "a supply of 5.1 V and 3 A (5 A for a Pi 5) with a short cable, a heat sink or a fan; "
        "vcgencmd get_throttled must say 0x0 after a restart",
        _throttling,
    ),
    Check(
        "cpu-latency-request",
        "keep_cpu_awake holds this file open with a zero in it, so that no processor sleeps so "
        "deeply that waking takes long.",
        'echo \'KERNEL=="cpu_dma_latency", GROUP="i2c", MODE="0660"\' | sudo tee '
        "/etc/udev/rules.d/60-cpu-latency.rules && sudo udevadm control --reload && "
        "sudo udevadm trigger --name-match=cpu_dma_latency",
        _latency_request,
    ),
    Check(
        "allowed-processors",
        "A board that names processors it may not use runs on others.",
        "AllowedCPUs= of the unit, or cpus under [executive] in board.toml",
        _allowed,
    ),
    Check(
        "isolated-processors",
        "On a processor that the scheduler leaves alone nothing else delays the loop.",
        "add isolcpus=3 nohz_full=3 to the kernel's command line, and cpus = [3] under "
        "[executive] in board.toml",
        _isolated,
    ),
    Check(
        "virtual-machine",
        "The host of a virtual machine stops it whenever it likes; its figures say nothing about "
        "a robot.",
        "measure on the robot's own computer: firmware-runtime doctor BOARD there",
        _virtual,
    ),
    Check(
        "load",
        "Other busy processes take the caches and the memory bus, and without SCHED_FIFO the "
        "processor itself.",
        "find them with top -o %CPU and end them",
        _load,
    ),
)
