"""Python and the libraries of the bus, against those this project needs."""

import platform
import sys
import sysconfig

from firmware_runtime.host.doctor.check import Check, Finding, Machine, failure, note, ok, warning
from firmware_runtime.system.packages import version_of

_LEAST = (3, 11)
_WHOLE_SUITE = ((3, 11), (3, 13))
_FAST_TESTS = ((3, 14),)
"""On which the test suite has been run: all of it, or without slow and real-time tests."""
_BUS_PACKAGES = ("smbus2", "pyserial")


def _python(_machine: Machine) -> Finding:
    seen = f"{platform.python_implementation()} {platform.python_version()}"
    release = sys.version_info[:2]
    if release < _LEAST:
        return failure(f"{seen}, expected 3.11 or later")
    if release not in _WHOLE_SUITE + _FAST_TESTS or sys.implementation.name != "cpython":
        return warning(f"{seen}, tested with CPython 3.11, 3.13 and 3.14")
    return ok(f"{seen}, fast tests only" if release in _FAST_TESTS else seen)


def _packages(_machine: Machine) -> Finding:
    found = {name: version_of(name) for name in _BUS_PACKAGES}
    missing = [name for name, release in found.items() if release is None]
    if missing:
        return failure(f"{', '.join(missing)} missing from {sys.prefix}")
    return ok(", ".join(f"{name} {release}" for name, release in found.items()))


def _environment(machine: Machine) -> Finding:
    if sys.prefix != sys.base_prefix:
        return ok(f"{sys.prefix}, an environment of its own")
    marker = f"{sysconfig.get_path('stdlib')}/EXTERNALLY-MANAGED"
    if machine.files.exists(marker):
        return note(f"{sys.prefix}, the system's, where pip refuses to install (PEP 668)")
    return ok(f"{sys.prefix}, in which pip may install")


CHECKS = (
    Check(
        "python-version",
        "The whole test suite has been run on CPython 3.11 and 3.13; on 3.14 the fast tests.",
        "sudo apt install python3-venv on Debian 12 or later, and install into a new environment",
        _python,
    ),
    Check(
        "bus-packages",
        "smbus2 and pyserial carry every byte to the chips.",
        "python -m pip install smbus2 pyserial, in the environment of firmware-runtime",
        _packages,
    ),
    Check(
        "python-environment",
        "pip calls the Python of Debian 12 and later, and of Raspberry Pi OS, externally managed "
        "and installs nothing there: what it would install could break the system's own programs.",
        "python3 -m venv .venv, and .venv/bin/python -m pip install in it; --system-site-packages "
        "where it is to see the system's packages",
        _environment,
    ),
)
