import re
from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.hal.budget import (
    BusLoad,
    PeriodicTransaction,
    bits,
    transaction_ns,
    wire_bytes,
)
from firmware_runtime.hal.i2c import Message

MILLISECOND = 1_000_000
DUTY_BURST: tuple[Message, ...] = (bytes(33),)
SAMPLE_BURST: tuple[Message, ...] = (b"\x3a", 23)

# Operation, messages, bytes with addresses, bits, microseconds at 400 kHz: counted by hand.
COUNTED: list[tuple[str, tuple[Message, ...], int, int, float]] = [
    ("eight duties", DUTY_BURST, 34, 308, 770),
    ("sixteen duties", (bytes(65),), 66, 596, 1490),
    ("stop all", (b"\xfd\x10",), 3, 29, 72.5),
    ("nine axes through the auxiliary master", SAMPLE_BURST, 26, 237, 592.5),
    ("compass bearing, pitch and roll", (b"\x02", 4), 7, 66, 165),
]


@pytest.mark.parametrize(("operation", "messages", "size", "bit_count", "us"), COUNTED)
def test_cost_equals_the_count_by_hand(
    operation: str, messages: Sequence[Message], size: int, bit_count: int, us: float
) -> None:
    assert wire_bytes(messages) == size, operation
    assert bits(messages) == bit_count, operation
    assert transaction_ns(messages, 400_000) == us * 1000, operation


@pytest.mark.parametrize(
    ("messages", "bus_hz", "overhead_ns", "ns"),
    [
        pytest.param((b"",), 300_000, 0, 36_667, id="rounded up to a whole nanosecond"),
        pytest.param(SAMPLE_BURST, 400_000, 30_000, 622_500, id="with the adapter's overhead"),
    ],
)
def test_bus_time(messages: Sequence[Message], bus_hz: int, overhead_ns: int, ns: int) -> None:
    assert transaction_ns(messages, bus_hz, overhead_ns) == ns


def test_the_overhead_is_part_of_a_bus_load_and_an_idle_bus_has_none() -> None:
    asked = [PeriodicTransaction("sample", SAMPLE_BURST, 1 * MILLISECOND)]
    assert BusLoad("i2c1", 400_000, asked, overhead_ns=100_000).utilisation == 0.6925
    assert BusLoad("i2c-1", 400_000, []).utilisation == 0


@given(st.lists(st.one_of(st.binary(max_size=40), st.integers(1, 40)), min_size=1, max_size=4))
def test_a_message_more_costs_its_bytes_its_address_and_one_start(messages: list[Message]) -> None:
    longer = [*messages, b"abc"]
    assert bits(longer) - bits(messages) == 9 * 4 + 1


def tachobot(bus_hz: int) -> BusLoad:
    period = 10 * MILLISECOND
    return BusLoad(
        "i2c-1",
        bus_hz,
        [
            PeriodicTransaction("imu", SAMPLE_BURST, period),
            PeriodicTransaction("thrust pairs", DUTY_BURST, period),
        ],
    )


def numbers(sentence: str | None) -> list[float]:
    """The shares in per cent and the frequency, in order of the sentence."""
    return [float(each) for each in re.findall(r"[\d.]+(?= ?%| Hz)", sentence or "")]


@pytest.mark.parametrize(
    ("bus_hz", "warned", "refused"),
    [
        (400_000, [], []),
        (100_000, [54.5, 100000, 50, 23.7, 30.8], []),
        (60_000, [], [90.8, 60000, 80, 39.5, 51.3]),
    ],
)
def test_a_sample_and_eight_duties_at_100_hz_are_warned_of_or_refused_with_each_share(
    bus_hz: int, warned: list[float], refused: list[float]
) -> None:
    load = tachobot(bus_hz)
    assert load.utilisation == pytest.approx(0.13625 * 400_000 / bus_hz)
    assert (numbers(load.warning()), numbers(load.fault())) == (warned, refused)


@pytest.mark.parametrize(
    ("periods", "refused", "warned"),
    [((2,), False, False), ((2, 1000), False, True), ((5,) * 4, False, True), ((1,), True, False)],
)
def test_limits_are_exact_and_only_what_exceeds_them_counts(
    periods: tuple[int, ...], *, refused: bool, warned: bool
) -> None:
    one_ms = (bytes(10),)  # 101 bits at 101 kHz: exactly one millisecond
    load = BusLoad(
        "i2c-1",
        101_000,
        [PeriodicTransaction("it", one_ms, period * MILLISECOND) for period in periods],
    )
    assert (load.fault() is not None) == refused
    assert (load.warning() is not None) == warned
