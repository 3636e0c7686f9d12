"""What a machine computes with: processor, C library, interpreter, packages."""

import hashlib
import math
import os
import platform
import struct
from itertools import chain
from typing import Final

from msgspec import Struct

from firmware_runtime.system.conditions import system_conditions

_ARGUMENTS: Final = tuple(n / 64 for n in range(1, 4096))
_TUNABLES: Final = "GLIBC_TUNABLES"


class Machine(Struct, frozen=True, kw_only=True):
    """A machine and the interpreter on it."""

    name: str
    """Interpreter, architecture and C library, in short."""
    python: str
    compiler: str
    machine: str
    kernel: str
    c_library: str
    tunables: str | None = None
    """Settings of the C library, which may choose its functions for another processor."""
    library_sha256: str
    """Of what its sine, cosine, arc tangent and exponential give: machines differ in the last bit,
    and these words show which."""
    packages: dict[str, str | None]


def this_machine() -> Machine:
    """The one that this process runs on."""
    conditions = system_conditions()
    library = " ".join(filter(None, platform.libc_ver())) or "unknown"
    tunables = os.environ.get(_TUNABLES)
    shown = (conditions["python"], conditions["machine"], library, _TUNABLES if tunables else None)
    return Machine(
        name=", ".join(filter(None, shown)),
        python=conditions["python"],
        compiler=platform.python_compiler(),
        machine=conditions["machine"],
        kernel=conditions["kernel"],
        c_library=library,
        tunables=tunables,
        library_sha256=_library_sha256(),
        packages=conditions["versions"],
    )


def _library_sha256() -> str:
    """SHA-256 of some thousand values of the C library's functions."""
    values = chain.from_iterable(
        (math.sin(x), math.cos(x), math.atan2(x, 3.0), math.exp(-x)) for x in _ARGUMENTS
    )
    return hashlib.sha256(b"".join(map(struct.Struct("<d").pack, values))).hexdigest()
