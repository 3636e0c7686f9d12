from dataclasses import replace

import pytest

from firmware_runtime.host.deployment.target import ROOM_KIB, Platform, Target

RASPBERRY_PI = """\
machine aarch64
python 3.11.2
bits 64
venv yes
glibc 2.36
rsync /usr/bin/rsync
free_kib 25269534
superuser sudo
writable
systemd yes
foreign
settings /etc/firmware-runtime/tachobot.toml
lacking
"""


@pytest.fixture
def pi() -> Target:
    return Target.read(RASPBERRY_PI)


def test_a_target_that_has_everything_has_no_faults(pi: Target) -> None:
    assert pi.faults("python3", "") == []
    assert pi.platform == Platform("aarch64", (3, 11))
    assert pi.text() == "aarch64, Python 3.11.2, glibc 2.36, 24.1 GiB free, root by sudo"
    assert pi.settings == "/etc/firmware-runtime/tachobot.toml"


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("machine", "armv7l", "processor armv7l; expected one of aarch64, x86_64"),
        (
            "python",
            "",
            "python3: not found; expected Python 3.11 or later (Debian package python3)",
        ),
        (
            "python",
            "3.9.2",
            "python3 is 3.9.2; expected 3.11 or later; --python PATH names another",
        ),
        ("python", "2.7.18", "python3 is 2.7.18; expected 3.11 or later"),
        ("bits", "32", "python3 is a 32-bit program; expected a 64-bit system"),
        ("venv", "", "install Debian package python3-venv"),
        ("glibc", "2.27", "glibc: 2.27; expected 2.28 or newer"),
        ("glibc", "", "glibc: none; expected 2.28 or newer"),
        ("rsync", "", "rsync: not found; install Debian package rsync"),
        ("free_kib", str(ROOM_KIB - 1), "499 MiB free for /opt/firmware-runtime; expected 500"),
        ("superuser", "", "neither root nor sudo without a password"),
        ("systemd", "", "systemd does not run it"),
        ("lacking", "/dev/i2c-1", "/dev/i2c-1: not there; expected the board's device"),
        ("foreign", "/opt/firmware-runtime/venv", "no link that a deployment made"),
    ],
)
def test_what_is_missing_is_said_in_one_sentence(
    pi: Target, key: str, value: str, said: str
) -> None:
    faults = replace(pi, **{key: value}).faults("python3", "")
    assert len(faults) == 1
    assert said in faults[0]


def test_below_a_root_neither_systemd_nor_a_superuser_is_needed(pi: Target) -> None:
    plain = replace(pi, superuser="", systemd="", writable="yes")
    assert plain.faults("python3", "/home/pi/trial") == []
    assert replace(plain, writable="").faults("python3", "/srv") == [
        "/srv: this user may not write there"
    ]
