"""Whether Python and the libraries of the bus are those this project needs."""

import platform
import sys

from firmware_runtime.host.doctor.check import Check
from firmware_runtime.host.doctor.finding import Finding, failure, ok, warning
from firmware_runtime.host.doctor.machine import Machine
from firmware_runtime.system.conditions import version_of

_LEAST, _NOT_YET = (3, 11), (3, 14)
"""The first that it runs on, and the first that its whole suite has not been run on."""
_BUS_PACKAGES = ("smbus2", "pyserial")


def _python(_machine: Machine) -> Finding:
    seen = f"{platform.python_implementation()} {platform.python_version()}"
    release = sys.version_info[:2]
    if release < _LEAST:
        return failure(f"{seen}, expected 3.11 or later")
    if release >= _NOT_YET or sys.implementation.name != "cpython":
        return warning(f"{seen}, tested with CPython 3.11 and 3.13")
    return ok(seen)


def _packages(_machine: Machine) -> Finding:
    found = {name: version_of(name) for name in _BUS_PACKAGES}
    missing = [name for name, release in found.items() if release is None]
    if missing:
        return failure(f"{', '.join(missing)} missing from {sys.prefix}")
    return ok(", ".join(f"{name} {release}" for name, release in found.items()))


CHECKS = (
    Check(
        "python-version",
        "The whole test suite has been run on CPython 3.11 and 3.13, on nothing else.",
        "sudo apt install python3-venv on Debian 12 or later, and install into a new environment",
        _python,
    ),
    Check(
        "bus-packages",
        "smbus2 and pyserial carry every byte to the chips.",
        "python -m pip install smbus2 pyserial, in the environment of firmware-runtime",
        _packages,
    ),
)
