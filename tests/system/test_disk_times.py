from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.system.machine_counters import disks_ns
from tests.support.kernel_text import DISKS, disk_worked

OLD = b"   8       0 sda 1 2 3 {read} 5 6 7 {write} 9 10 11\n"
"""Before Linux 4.18 there are eleven fields after the name."""


def content(**worked: int) -> bytes:
    return disk_worked(**worked)[DISKS].encode()


def test_reads_writes_and_flushes_of_the_busiest_add_up() -> None:
    worked = content(read_ms=3, write_ms=4, flush_ms=5)
    assert disks_ns(content(), worked) == 12 * MILLISECOND
    assert disks_ns(worked, worked) == 0


def test_an_old_kernel_counts_no_flushes() -> None:
    before = OLD.replace(b"{read}", b"4").replace(b"{write}", b"8")
    after = OLD.replace(b"{read}", b"5").replace(b"{write}", b"10")
    assert disks_ns(before, after) == 3 * MILLISECOND


def test_a_disk_that_has_just_come_has_done_nothing_yet() -> None:
    assert disks_ns(OLD.replace(b"{read}", b"4").replace(b"{write}", b"8"), content()) == 0


def test_without_a_disk_or_its_account_nothing_is_measured() -> None:
    assert disks_ns(None, None) is None
    assert disks_ns(b"", b"   7       0 loop0 0 0 0 0 0 0 0 0 0 0 0\n") is None
