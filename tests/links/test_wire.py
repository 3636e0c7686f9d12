"""The frame of a link, and that docs/wire.md has it as it is."""

import re
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.links.cut.refusal import Reason, Refused
from firmware_runtime.links.cut.wire import (
    HEAD,
    HEADER,
    LONGEST,
    Entry,
    Farewell,
    Frame,
    Greeting,
    Kind,
    Missing,
    body_of,
    decoded,
    encode,
    encoded,
    entries_of,
    farewell_of,
    greeting_of,
    opened,
)

KEY = bytes(range(32))
PAGE = Path(__file__).parents[2] / "docs/wire.md"
VECTORS = {
    "hello": (
        Frame(
            Kind.HELLO,
            0x1111111111111111,
            0,
            1,
            1_000_000_000,
            body=encode(Greeting(bytes(32), (1,), "tachobot", "robot", "boot", 0)),
        ),
        None,
    ),
    "step": (
        Frame(
            Kind.STEP,
            0x1111111111111111,
            0x2222222222222222,
            7,
            1_500_000_000,
            1_400_000_000,
            250_000,
            9,
            0b11,
            2,
            1_499_900_000,
            3,
            Missing(1_499_800_000, 2, 1),
            body_of(
                [
                    Entry(1, 3, 0, encode([[0.5, -1.25]])),
                    Entry(4, 2, 1, encode(["stop", "turn"])),
                ]
            ),
        ),
        None,
    ),
    "step, signed": (
        Frame(
            Kind.STEP,
            0x1111111111111111,
            0x2222222222222222,
            8,
            1_600_000_000,
            ports=1,
            origin=1_600_000_000,
            step=4,
            body=body_of([Entry(0, 1, 0, encode([1.0]))]),
        ),
        KEY,
    ),
    "bye": (
        Frame(
            Kind.BYE,
            0x1111111111111111,
            0x2222222222222222,
            9,
            1_700_000_000,
            body=encode(Farewell("SIGTERM", is_over=False, failed=False)),
        ),
        None,
    ),
}

words = st.integers(0, 2**64 - 1)
instants = st.integers(-(2**63), 2**63 - 1)
frames = st.builds(
    Frame,
    st.sampled_from(Kind),
    st.integers(1, 2**64 - 1),
    words,
    st.integers(1, 2**64 - 1),
    instants,
    instants,
    instants,
    words,
    words,
    st.integers(0, 2**16 - 1),
    instants,
    words,
    st.builds(Missing, instants, words, st.integers(0, 2**16 - 1)),
    st.binary(max_size=200),
)


def reason_of(function: Callable[..., object], *arguments: object) -> Reason:
    with pytest.raises(Refused) as refused:
        function(*arguments)
    return refused.value.reason


@given(frames)
def test_a_frame_comes_out_as_it_went_in(frame: Frame) -> None:
    assert decoded(encoded(frame)) == frame
    assert decoded(opened(encoded(frame, KEY), KEY)) == frame


@given(st.binary(max_size=300))
def test_any_bytes_are_a_frame_or_refused(datagram: bytes) -> None:
    for function, arguments in ((decoded, ()), (opened, (KEY,))):
        with pytest.raises(Refused):
            function(datagram, *arguments)


@given(frames, st.data())
def test_one_bit_more_or_less_is_forged(frame: Frame, data: st.DataObject) -> None:
    sound = encoded(frame, KEY)
    at = data.draw(st.integers(0, 8 * len(sound) - 1))
    broken = bytearray(sound)
    broken[at // 8] ^= 1 << at % 8
    assert reason_of(opened, bytes(broken), KEY) is Reason.FORGED


def test_what_is_no_frame_is_named() -> None:
    sound = encoded(Frame(Kind.HEARTBEAT, 1, 0, 1, 0))
    assert reason_of(decoded, bytes(LONGEST + 1)) is Reason.OVERSIZED
    assert reason_of(opened, bytes(LONGEST + 1), KEY) is Reason.OVERSIZED
    assert reason_of(decoded, sound[:-1]) is Reason.MALFORMED
    assert reason_of(decoded, b"FWL1" + sound[4:]) is Reason.MALFORMED
    assert reason_of(decoded, sound[:4] + b"\x06" + sound[5:]) is Reason.MALFORMED
    assert reason_of(decoded, encoded(Frame(Kind.HEARTBEAT, 0, 0, 1, 0))) is Reason.MALFORMED
    assert len(sound) == HEADER


@pytest.mark.parametrize("read", [greeting_of, farewell_of])
@given(st.binary(max_size=100))
def test_any_body_is_read_or_refused(read: Callable[[bytes], object], body: bytes) -> None:
    with suppress(Refused):
        assert isinstance(read(body), Greeting | Farewell)


entries = st.lists(
    st.builds(
        Entry,
        st.integers(0, 2**16 - 1),
        st.integers(2**32, 2**64 - 1),
        st.integers(0, 2**32 - 1),
        st.binary(max_size=40),
    ),
    min_size=1,
    max_size=5,
    unique_by=lambda entry: entry.port,
)


def step(body: bytes, ports: int) -> Frame:
    return Frame(Kind.STEP, 1, 2, 1, 0, ports=ports, body=body)


@given(entries)
def test_what_left_in_a_step_comes_out_as_it_went_in(left: list[Entry]) -> None:
    assert entries_of(step(body_of(left), len(left))) == left


@given(st.binary(max_size=80), st.integers(0, 4))
def test_any_body_of_a_step_is_read_or_refused(body: bytes, ports: int) -> None:
    with suppress(Refused):
        assert sum(HEAD + len(entry.body) for entry in entries_of(step(body, ports))) == len(body)


def test_a_step_that_is_none_is_malformed() -> None:
    sound = body_of([Entry(1, 1, 0, b"a"), Entry(2, 5, 4, b"b")])
    assert len(entries_of(step(sound, 2))) == 2
    for body, ports in (
        (sound, 1),
        (sound[:-1], 2),
        (sound + b"x", 2),
        (b"", 0),
        (body_of([Entry(1, 1, 0, b""), Entry(1, 2, 0, b"")]), 2),
        (body_of([Entry(1, 1, 1, b"")]), 1),
        (body_of([Entry(1, 0, 0, b"")]), 1),
    ):
        assert reason_of(entries_of, step(body, ports)) is Reason.MALFORMED


def on_the_page(datagram: bytes) -> str:
    """As docs/wire.md has it: words of four bytes, eight in a line."""
    words = [datagram[at : at + 4].hex() for at in range(0, len(datagram), 4)]
    lines = (" ".join(words[at : at + 8]) for at in range(0, len(words), 8))
    return "".join(f"    {line}\n" for line in lines)


@pytest.mark.parametrize("name", VECTORS)
def test_the_page_has_the_vectors(name: str) -> None:
    expected = on_the_page(encoded(*VECTORS[name]))
    page = dict(re.findall(r"^(.+):\n\n((?:    [0-9a-f ]+\n)+)", PAGE.read_text(), re.MULTILINE))
    assert page.get(name) == expected, f"{PAGE}: expected\n{name}:\n\n{expected}"
