"""The ways of a link that lead out of a run: what finds no room, and the last frames."""

from pathlib import Path
from threading import Thread

import pytest

from firmware_runtime.links.cut.channel import PathChannel


def test_a_send_finds_no_room_at_an_end_that_is_slow_but_the_last_ones_wait_for_some(
    tmp_path: Path,
) -> None:
    own = PathChannel(tmp_path / "a", tmp_path / "b")
    other = PathChannel(tmp_path / "b", tmp_path / "a")
    sent = _fill(own)
    own.linger()
    with pytest.raises(BlockingIOError):  # they wait 0.2 s at most
        own.send(b"bye")
    found: list[bytes] = []
    reader = Thread(target=_read, args=(other, sent + 1, found))
    reader.start()
    own.send(b"bye")
    reader.join()
    assert found[-1] == b"bye"
    own.close()
    other.close()


def _fill(channel: PathChannel) -> int:
    """How many frames find room."""
    sent = 0
    while _finds_room(channel):
        sent += 1
    return sent


def _finds_room(channel: PathChannel) -> bool:
    try:
        channel.send(b"frame")
    except BlockingIOError:
        return False
    return True


def _read(channel: PathChannel, most: int, found: list[bytes]) -> None:
    while len(found) < most:
        if (frame := channel.receive()) is not None:
            found.append(frame)
