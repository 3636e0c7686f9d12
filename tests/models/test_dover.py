"""The paper's sndDOVER and rcvDOVER as atomic models: numbers to text, and back."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.errors import ConfigError
from firmware_runtime.hal.wire_errors import Fault
from firmware_runtime.models.dover import (
    LONGEST_RECEIVED,
    RcvDover,
    Refused,
    SndDover,
    number_of_text,
    text_of_number,
)
from tests.support.atomic_bench import AtomicBench


def sent(*values: float) -> tuple[list[str], list[Fault]]:
    """What a sender says to these values, all of one instant."""
    block = SndDover("snd", 62002)
    bench = AtomicBench(block)
    for value in values:
        bench.simulator.inject(block.value, value)
    bench.run(1)
    assert block.phase == "waiting"
    return bench.values("text"), bench.faults


def received(*texts: str) -> tuple[list[float], list[Fault]]:
    """What a receiver makes of these texts, one after the other."""
    bench = AtomicBench(RcvDover("rcv", 62001))
    for at_ms, text in enumerate(texts):
        bench.meet(at_ms, text=text)
    return bench.values("value"), bench.faults


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1.0, "1.000000"),
        (-0.5, "-0.500000"),
        (math.pi, "3.141593"),
        (0.0000004, "0.000000"),
        (-0.0000004, "-0.000000"),
        (2.5e-6, "0.000003"),
        (9_999_999_999.25, "9999999999.250000"),
        (-9_999_999_999.25, "-9999999999.250000"),
    ],
)
def test_a_value_is_sent_as_percent_f_prints_it(value: float, text: str) -> None:
    assert sent(value) == ([text], [])


def test_values_of_one_instant_are_sent_in_their_order() -> None:
    assert sent(1, 2.5, -3)[0] == ["1.000000", "2.500000", "-3.000000"]


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_what_is_not_finite_is_a_fault_and_never_a_text(value: float) -> None:
    texts, faults = sent(1.0, value, 2.0)
    assert texts == ["1.000000", "2.000000"]
    assert [(fault.kind, fault.consecutive) for fault in faults] == [("NotFinite", 1)]


def test_a_number_that_the_peer_would_read_cut_off_is_not_sent() -> None:
    texts, faults = sent(1e10, -1e10)
    assert texts == ["10000000000.000000"]
    assert [fault.kind for fault in faults] == ["TooLong"]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("0.523599", 0.523599),
        ("-0.000000", 0.0),
        ("1", 1.0),
        ("+1.5e-3", 1.5e-3),
        (".5", 0.5),
        ("5.", 5.0),
        (" 2.0\n", 2.0),
        ("2.000000\0", 2.0),
    ],
)
def test_a_decimal_number_arrives(text: str, value: float) -> None:
    assert received(text) == ([value], [])


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("", "Malformed"),
        ("yaw", "Malformed"),
        ("1,5", "Malformed"),
        ("1.0 2.0", "Malformed"),
        ("0x10", "Malformed"),
        ("1_000", "Malformed"),
        ("--1", "Malformed"),
        ("\u0661", "Malformed"),
        ("\ufffd\xff\0", "Malformed"),
        ("nan", "NotFinite"),
        ("-nan", "NotFinite"),
        ("inf", "NotFinite"),
        ("-Infinity", "NotFinite"),
        ("1e999", "NotFinite"),
        ("1" * 201, "TooLong"),
    ],
)
def test_what_is_no_number_is_a_fault_and_never_a_value(text: str, kind: str) -> None:
    values, faults = received(text)
    assert values == []
    assert [fault.kind for fault in faults] == [kind]


def test_the_longest_text_that_is_received_is_a_number() -> None:
    assert received("1".zfill(LONGEST_RECEIVED)) == ([1.0], [])


def test_refusals_in_a_row_are_counted_until_a_number_comes() -> None:
    values, faults = received("a", "b", "1.0", "c")
    assert values == [1.0]
    assert [fault.consecutive for fault in faults] == [1, 2, 1]


@given(st.floats(min_value=-9e9, max_value=9e9))
def test_what_is_sent_arrives_to_six_decimals(value: float) -> None:
    assert number_of_text(text_of_number(value)) == pytest.approx(value, rel=1e-15, abs=5e-7)


@pytest.mark.slow
@given(st.text())
def test_any_text_is_a_finite_number_or_refused(text: str) -> None:
    try:
        kind = "" if math.isfinite(number_of_text(text)) else "accepted"
    except Refused as why:
        kind = why.kind
    assert kind in {"", "Malformed", "NotFinite", "TooLong"}


@pytest.mark.parametrize("udp_port", [1, 65535])
def test_the_least_and_the_highest_port_of_udp_are_ports(udp_port: int) -> None:
    assert SndDover("snd", udp_port).udp_port == udp_port


@pytest.mark.parametrize("udp_port", [0, -1, 65536, True])
def test_a_block_has_a_port_of_udp(udp_port: int) -> None:
    with pytest.raises(ConfigError):
        SndDover("snd", udp_port)
