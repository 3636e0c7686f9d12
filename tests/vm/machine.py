"""The virtual machine: QEMU started, its lines read, and ended whatever happens."""

import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from select import select
from time import monotonic
from typing import IO, Final

from tests.vm.image import Image

QEMU: Final = "qemu-system-x86_64"
PROCESSORS, MEMORY_MB = 2, 1024
PROBE_S: Final = 15
BOOT_S: Final = 240.0
"""Longer than it takes to come up and carry out the first check."""
SILENCE_S: Final = 600.0
"""Longer than any check takes."""
KERNEL_LINE: Final = (
    "root=/dev/vda rw console=ttyS0 loglevel=4 systemd.show_status=no "
    "systemd.unit=vm-checks.target systemd.mask=serial-getty@ttyS0.service "
    "systemd.mask=serial-getty@hvc0.service systemd.mask=getty@tty1.service"
)


def accelerator(image: Image) -> str:
    """`kvm` if the guest's kernel comes up with it, else `tcg`, which is emulation.

    That KVM is there says little: nested in another machine it may run some kernels only.
    """
    probe = [*_machine("kvm", image), "-append", "rdinit=/probe"]
    try:
        done = subprocess.run(
            probe, stdin=subprocess.DEVNULL, capture_output=True, timeout=PROBE_S, check=False
        )
    except subprocess.TimeoutExpired:
        return "tcg"
    return "kvm" if done.returncode == 0 else "tcg"


@contextmanager
def booted(
    image: Image, carried: Sequence[Path], logs: Path, accel: str, limit_s: float
) -> Iterator[Iterator[str]]:
    """Boot the guest; yields the lines that its checks write, until it powers itself off.

    `carried` are disks that it only reads. Nothing the guest does reaches the image, but it
    outlives a reboot. The lines end early when `limit_s` is over or none came for SILENCE_S (the
    first: BOOT_S); the machine ends with the block.
    """
    with started(_command(image, carried, logs, accel), logs, limit_s) as lines:
        yield lines


@contextmanager
def started(
    command: Sequence[str], logs: Path, limit_s: float, read: int = subprocess.DEVNULL
) -> Iterator[Iterator[str]]:
    """Start QEMU; yields the lines it writes, as `booted`, and ends it with the block.

    `read` is the descriptor it reads, nothing by default.
    """
    with (logs / "qemu.log").open("wb") as errors:
        qemu = subprocess.Popen(
            command, stdin=read, stdout=subprocess.PIPE, stderr=errors, bufsize=0
        )
    try:
        assert qemu.stdout is not None
        yield _lines(qemu.stdout, monotonic() + limit_s)
    finally:
        qemu.kill()
        qemu.communicate()


def _lines(output: IO[bytes], give_up_at: float) -> Iterator[str]:
    silence_s = BOOT_S
    while True:
        patience_s = min(silence_s, give_up_at - monotonic())
        if not select([output], (), (), max(patience_s, 0))[0]:
            return
        line = output.readline()
        if not line:
            return
        silence_s = SILENCE_S
        yield line.decode(errors="replace").rstrip("\n")


def _command(image: Image, carried: Sequence[Path], logs: Path, accel: str) -> list[str]:
    drives = [f"if=virtio,format=raw,readonly=on,file={disk}" for disk in carried]
    return [
        *(*_machine(accel, image), "-append", KERNEL_LINE),
        *("-drive", f"if=virtio,format=raw,snapshot=on,file={image.disk}"),
        *(word for drive in drives for word in ("-drive", drive)),
        *("-serial", f"file:{logs / 'console.log'}"),
        *("-device", "virtio-serial"),
        *("-chardev", f"file,id=journal,path={logs / 'journal.log'}"),
        *("-device", "virtconsole,chardev=journal"),
        *("-chardev", "file,id=results,path=/dev/stdout"),
        *("-device", "virtserialport,chardev=results,name=results"),
    ]


def _machine(accel: str, image: Image) -> list[str]:
    """Processor, memory and kernel. Emulated, an older processor is a faster one."""
    acceleration, processor = {"kvm": ("kvm", "host"), "tcg": ("tcg,thread=multi", "Nehalem")}[
        accel
    ]
    return [
        *(QEMU, "-machine", "q35", "-accel", acceleration, "-cpu", processor),
        *("-smp", str(PROCESSORS), "-m", str(MEMORY_MB)),
        *("-nodefaults", "-display", "none", "-nic", "none"),
        *("-kernel", str(image.kernel), "-initrd", str(image.initrd)),
    ]
