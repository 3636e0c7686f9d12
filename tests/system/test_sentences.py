"""Sentences for people never wait: what finds no room is dropped and counted."""

import io
import os
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from firmware_runtime.system.messages import Sentences


class Pipe:
    """Both ends of a pipe that others may have open too."""

    def __init__(self) -> None:
        self.reading, writing = os.pipe()
        self.stream = os.fdopen(writing, "w")

    def fill(self) -> None:
        os.set_blocking(self.stream.fileno(), False)
        try:
            while True:
                os.write(self.stream.fileno(), bytes(4096))
        except BlockingIOError:
            os.set_blocking(self.stream.fileno(), True)

    def empty(self) -> bytes:
        os.set_blocking(self.reading, False)
        found = b""
        try:
            while more := os.read(self.reading, 65536):
                found += more
        except BlockingIOError:
            pass
        return found


@pytest.fixture
def pipe() -> Iterator[Pipe]:
    pipe = Pipe()
    yield pipe
    pipe.stream.close()
    os.close(pipe.reading)


@pytest.fixture(params=["opened once more", "may not be opened"])
def to_pipe(
    request: pytest.FixtureRequest, pipe: Pipe, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Sentences]:
    def refuse(*_: object) -> int:
        raise PermissionError

    if request.param == "may not be opened":
        with monkeypatch.context() as patched:
            patched.setattr(os, "open", refuse)
            made = Sentences(pipe.stream)
    else:
        made = Sentences(pipe.stream)
    yield made
    made.close()


def test_a_pipe_with_room_takes_a_line(pipe: Pipe, to_pipe: Sentences) -> None:
    to_pipe.say("all outputs off")
    assert pipe.empty() == b"all outputs off\n"


def test_a_full_pipe_is_not_waited_for_and_what_is_dropped_is_counted(
    pipe: Pipe, to_pipe: Sentences
) -> None:
    pipe.fill()
    to_pipe.say("one")
    to_pipe.say("two")
    assert to_pipe.dropped == 2
    assert pipe.empty().strip(b"\0") == b""
    to_pipe.say("three")
    assert pipe.empty() == b"(2 dropped: no room for them)\nthree\n"
    assert to_pipe.dropped == 0
    to_pipe.say("four")
    assert pipe.empty() == b"four\n"


def test_the_flags_that_others_share_stay_as_they_are(pipe: Pipe, to_pipe: Sentences) -> None:
    to_pipe.say("one")
    assert os.get_blocking(pipe.stream.fileno())


def test_a_line_that_is_longer_than_the_room_is_finished_before_the_next(pipe: Pipe) -> None:
    made = Sentences(pipe.stream)
    made.say("a" * 100_000)
    first = pipe.empty()
    made.say("b")
    assert 0 < len(first) < 100_000
    assert first + pipe.empty() == b"a" * 100_000 + b"\nb\n"
    made.close()


def test_a_reader_that_has_gone_is_no_error(pipe: Pipe, to_pipe: Sentences) -> None:
    with Path(os.devnull).open() as nowhere:
        os.dup2(nowhere.fileno(), pipe.reading)
    to_pipe.say("one")
    assert to_pipe.dropped == 1


def test_a_socket_whose_other_end_does_not_read_is_not_waited_for() -> None:
    here, there = socket.socketpair()
    with here, there, here.makefile("w") as stream:
        made = Sentences(stream)
        while not made.dropped:
            made.say("x" * 10_000)
        assert here.gettimeout() is None
        made.close()


def test_a_file_takes_everything(tmp_path: Path) -> None:
    with (tmp_path / "log").open("w") as stream:
        Sentences(stream).say("bytes \udc80 that are no text")
    assert (tmp_path / "log").read_text() == "bytes \\udc80 that are no text\n"


def test_a_full_disk_drops() -> None:
    with Path("/dev/full").open("w") as stream:
        made = Sentences(stream)
        made.say("one")
        assert made.dropped == 1
        made.close()


def test_a_stream_in_memory_takes_everything_and_no_stream_nothing() -> None:
    stream = io.StringIO()
    made = Sentences(stream)
    made.say("one")
    assert stream.getvalue() == "one\n"
    made.close()
    made.say("two")
    Sentences(None).say("three")
    assert stream.getvalue() == "one\n"
