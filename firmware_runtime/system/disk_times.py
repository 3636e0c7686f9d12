"""How long the requests to the machine's disks took: read as a whole, taken apart later.

The kernel counts it for each disk, in ms of all requests together, from being made to being done.
Whether a thread that was asleep can have waited for a disk follows: not if no disk did anything.

Source: Linux Documentation/admin-guide/iostats.rst.
"""

DISKS = "/proc/diskstats"
_NAME = 2
_TIMES = (6, 10, 17, 19)
"""Fields, from 0: ms of reads, writes, discards (from Linux 4.18 on) and flushes (5.5)."""
_MILLISECOND = 1_000_000


def disks_ns(before: bytes | None, after: bytes | None) -> int | None:
    """Ns that the requests to one disk took in between, of the one that had most.

    None where no disk was ever counted: a machine without any, or with the counting switched off.
    """
    earlier, later = _times(before), _times(after)
    if not any(later.values()):
        return None
    return max(ms - earlier.get(name, ms) for name, ms in later.items()) * _MILLISECOND


def _times(content: bytes | None) -> dict[bytes, int]:
    """The ms of each disk and partition, by name."""
    rows = [line.split() for line in (content or b"").splitlines()]
    return {row[_NAME]: sum(map(_number, _fields(row))) for row in rows if len(row) > _TIMES[1]}


def _fields(row: list[bytes]) -> list[bytes]:
    return [row[at] for at in _TIMES if at < len(row)]


def _number(word: bytes) -> int:
    return int(word) if word.isdigit() else 0
