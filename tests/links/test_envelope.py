"""Signed datagrams as docs/bridge.md shows them."""

import re
from pathlib import Path

import pytest

from firmware_runtime.links.bridge.envelope import (
    UNKNOWN,
    Direction,
    Envelope,
    Refused,
    opened,
    sealed,
)

DOCUMENT = Path(__file__).parents[2] / "docs" / "bridge.md"
KEY = bytes(range(32))
SENDER, BRIDGE = "0011223344556677", "8899aabbccddeeff"
EXAMPLES: list[tuple[Direction, Envelope]] = [
    ("ask", Envelope(SENDER, UNKNOWN, 1, 0, b"")),
    ("answer", Envelope(BRIDGE, SENDER, 1, 1_200_000_000, b'{"answers":1}')),
    (
        "ask",
        Envelope(SENDER, BRIDGE, 2, 1_230_000_000, b'{"port": "yaw_reference", "value": 0.5}'),
    ),
]


def test_the_datagrams_of_the_document_are_those_of_the_bridge() -> None:
    (shown,) = re.findall(
        r"<!-- checked by tests/links -->\n```text\n(.*?)```", DOCUMENT.read_text(), re.DOTALL
    )
    made = [sealed(KEY, direction, envelope) for direction, envelope in EXAMPLES]
    assert shown.encode() == b"".join(datagram + b"\n" for datagram in made)
    for (direction, envelope), datagram in zip(EXAMPLES, made, strict=True):
        assert opened(KEY, direction, datagram) == envelope


@pytest.mark.parametrize(
    ("was", "written"), [(b" 2 ", b" 02 "), (b" 2 ", b" +2 "), (b"\n", b"\r\n")]
)
def test_nothing_can_be_written_in_two_ways(was: bytes, written: bytes) -> None:
    datagram = sealed(KEY, *EXAMPLES[2])
    with pytest.raises(Refused):
        opened(KEY, "ask", datagram.replace(was, written, 1))


def test_a_number_of_more_than_63_bits_is_refused() -> None:
    datagram = sealed(KEY, "ask", EXAMPLES[2][1]._replace(counter=1 << 63))
    with pytest.raises(Refused, match="malformed"):
        opened(KEY, "ask", datagram)
