"""The guard's own file: whole at any instant, bounded, and no trap for who reads it."""

from pathlib import Path

import pytest
from msgspec.structs import replace

from firmware_runtime.statistics.paths import Companion
from firmware_runtime.statistics.takeovers import (
    KEPT,
    Takeover,
    note_takeover,
    read_takeovers,
    takeovers_of,
)
from firmware_runtime.system.this_process import ProcessIdentity

WRITER = ProcessIdentity(4711, 12, "a")


@pytest.fixture
def statistics(tmp_path: Path) -> Path:
    return tmp_path / "tachobot.stats"


def takeover(at_ns: int, off_after_ns: int | None = 2_500_000) -> Takeover:
    return Takeover(at_ns, WRITER, 1, "process 4711 has ended", off_after_ns)


def test_what_was_written_is_read_by_the_next_guard_too(statistics: Path) -> None:
    note_takeover(statistics, takeover(1))
    note_takeover(statistics, takeover(2))
    assert read_takeovers(statistics) == [takeover(1), takeover(2)]


def test_the_same_takeover_is_replaced_by_how_it_went_on(statistics: Path) -> None:
    note_takeover(statistics, takeover(1, None))
    note_takeover(statistics, takeover(2, None))  # another guard's
    note_takeover(statistics, takeover(1))
    assert read_takeovers(statistics) == [takeover(1), takeover(2, None)]


def test_only_the_last_are_kept(statistics: Path) -> None:
    for at in range(KEPT + 5):
        note_takeover(statistics, takeover(at))
    assert [each.at_ns for each in read_takeovers(statistics)] == list(range(5, KEPT + 5))


def test_another_process_has_its_own(statistics: Path) -> None:
    note_takeover(statistics, takeover(1))
    assert takeovers_of(statistics, WRITER) == [takeover(1)]
    assert takeovers_of(statistics, replace(WRITER, started_ticks=13)) == []


DEEP = b'{"at_ns": 1, "writer": ' + b'{"a":' * 3000 + b"1" + b"}" * 3001


@pytest.mark.parametrize("content", [None, b"", b"{", b"[1]\n", b"\xff\xfe\n", DEEP])
def test_a_file_of_another_format_holds_none_and_is_replaced(
    statistics: Path, content: bytes | None
) -> None:
    if content is not None:
        Companion.TAKEOVERS.beside(statistics).write_bytes(content)
    assert read_takeovers(statistics) == []
    note_takeover(statistics, takeover(1))
    assert read_takeovers(statistics) == [takeover(1)]


def test_a_takeover_reads_as_a_sentence() -> None:
    assert takeover(1).text() == "process 4711 has ended; all outputs off after 2.5 ms"
    failing = takeover(1, None)
    failing.failed = ["i2c1 0x40: not acknowledged"]
    assert failing.text() == (
        "process 4711 has ended; outputs not off: i2c1 0x40: not acknowledged"
    )
