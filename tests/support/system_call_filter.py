"""Runs a command under the system call filter of a unit, without systemd as the service manager.

    python system_call_filter.py UNIT-FILE COMMAND...

What the groups hold is asked of `systemd-analyze syscall-filter`, numbers come from the kernel's
header. As SystemCallErrorNumber=EPERM says, what is not allowed fails with EPERM. Memory that is
writable and executable is refused by the kernel's own means (prctl PR_SET_MDWE, Linux 6.3), where
it has them. Sources: systemd.exec(5), seccomp(2).
"""

import ctypes
import os
import re
import struct
import subprocess
import sys
from pathlib import Path

HEADER = Path("/usr/include/x86_64-linux-gnu/asm/unistd_64.h")
"""Of the Debian package linux-libc-dev."""
_SET_NO_NEW_PRIVILEGES, _SET_SECCOMP, _SET_MDWE = 38, 22, 65
_LOAD, _JUMP_IF_EQUAL, _RETURN = 0x20, 0x15, 0x06
_ALLOW, _FAIL_WITH_EPERM = 0x7FFF0000, 0x00050001


class _Program(ctypes.Structure):
    _fields_ = (("length", ctypes.c_ushort), ("instructions", ctypes.c_void_p))


def allowed_calls(unit: str) -> set[str]:
    """The system calls that a unit's SystemCallFilter= lines leave."""
    groups = _groups()

    def spelled_out(words: str) -> set[str]:
        return {call for word in words.split() for call in _members(word, groups)}

    allowed = spelled_out("@default")
    for line in re.findall(r"^SystemCallFilter=(.*)$", unit, re.MULTILINE):
        if line.startswith("~"):
            allowed -= spelled_out(line[1:]) - spelled_out("@default")
        else:
            allowed |= spelled_out(line)
    return allowed


def _groups() -> dict[str, list[str]]:
    words = ["systemd-analyze", "syscall-filter", "--no-pager"]
    listed = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    groups: dict[str, list[str]] = {}
    for line in listed.splitlines():
        if line.startswith("@"):
            members = groups.setdefault(line.strip(), [])
        elif line.startswith(" ") and not line.strip().startswith("#"):
            members.append(line.strip())
    return groups


def _members(word: str, groups: dict[str, list[str]]) -> set[str]:
    if not word.startswith("@"):
        return {word}
    return {call for each in groups[word] for call in _members(each, groups)}


def _restrict(allowed: set[str]) -> None:
    """Let this process, and whatever it becomes, make these system calls only."""
    numbers = dict(re.findall(r"#define __NR_(\w+)\s+(\d+)", HEADER.read_text()))
    program = [struct.pack("=HBBI", _LOAD, 0, 0, 0)]
    for number in sorted(int(numbers[call]) for call in allowed & numbers.keys()):
        program.append(struct.pack("=HBBI", _JUMP_IF_EQUAL, 0, 1, number))
        program.append(struct.pack("=HBBI", _RETURN, 0, 0, _ALLOW))
    program.append(struct.pack("=HBBI", _RETURN, 0, 0, _FAIL_WITH_EPERM))
    instructions = ctypes.create_string_buffer(b"".join(program))
    whole = _Program(len(program), ctypes.addressof(instructions))
    library = ctypes.CDLL(None, use_errno=True)
    library.prctl(_SET_MDWE, 1, 0, 0, 0)
    for setting in ((_SET_NO_NEW_PRIVILEGES, 1), (_SET_SECCOMP, 2, ctypes.byref(whole))):
        if library.prctl(*setting, *[0] * (5 - len(setting))) != 0:
            raise OSError(ctypes.get_errno(), "the filter was refused")


if __name__ == "__main__":
    _restrict(allowed_calls(Path(sys.argv[1]).read_text()))
    os.execv(sys.argv[2], sys.argv[2:])  # noqa: S606 -- no shell is meant
