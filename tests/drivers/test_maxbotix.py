import math
from itertools import pairwise
from typing import get_args, get_type_hints

import pytest
from firmware_drivers.chips.maxbotix import BAUD, FAMILIES, FRAME_NS, FrameDecoder, Maxbotix
from firmware_drivers.tables.sonar import MaxbotixTable
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.errors import SettingError
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.hal.wire_errors import NotReady
from tests.support.wire import sentences

GARBAGE = st.binary(max_size=20)
COUNTS = st.lists(st.integers(0, 999), max_size=8)


class ScriptedPort(SerialPort):
    """Bytes put into `arrived` are read as they are, all at once."""

    name = "ttyS0"

    def __init__(self) -> None:
        self.arrived = b""

    def write(self, data: bytes) -> None:
        raise AssertionError(data)

    def read_available(self) -> bytes:
        data, self.arrived = self.arrived, b""
        return data

    def close(self) -> None:
        self.arrived = b""


@pytest.fixture
def port() -> ScriptedPort:
    return ScriptedPort()


@pytest.fixture
def sonar(port: ScriptedPort) -> Maxbotix:
    return Maxbotix(port, "xl")


def frame(count: int, digits: int = 3) -> bytes:
    return b"R%0*d\r" % (digits, count)


# The codec ----------------------------------------------------------------------------------------


@given(COUNTS, st.lists(st.integers(0, 60)))
def test_frames_are_found_however_the_stream_is_cut(counts: list[int], cuts: list[int]) -> None:
    stream = b"".join(map(frame, counts))
    decoder = FrameDecoder((3,))
    bounds = [0, *sorted(min(cut, len(stream)) for cut in cuts), len(stream)]
    found = []
    for begin, end in pairwise(bounds):
        found += decoder.feed(stream[begin:end])
    assert found == counts


@given(st.lists(st.tuples(GARBAGE, st.integers(0, 999))))
def test_what_stands_before_a_frame_never_costs_that_frame(parts: list[tuple[bytes, int]]) -> None:
    decoder = FrameDecoder((3,))
    for garbage, count in parts:
        assert decoder.feed(garbage + frame(count))[-1] == count


@given(st.binary())
def test_no_stream_makes_the_decoder_fail_or_give_a_count_of_other_digits(stream: bytes) -> None:
    assert all(0 <= count <= 9999 for count in FrameDecoder((3, 4)).feed(stream))


NO_FRAMES = ("R12\r", "R1234\r", "R12a\r", "R123", "R123\n", "123\r", "R 12\r", "R-12\r", "RR12\r")


@pytest.mark.parametrize("stream", [*NO_FRAMES, "r123\r"])
def test_what_is_not_quite_a_frame_is_none(stream: str) -> None:
    assert FrameDecoder((3,)).feed(stream.encode()) == []


def test_a_banner_is_skipped_and_a_frame_cut_in_two_by_a_restart_not_put_together() -> None:
    banner = b"XL-MaxSonar\rMB1200 RoHS 1.9b\rCopyright MaxBotix\rTempI\r"
    assert FrameDecoder((3,)).feed(banner + b"R042\rR043\r") == [42, 43]
    decoder = FrameDecoder((3,))
    decoder.feed(b"R1")
    decoder.restart()
    assert decoder.feed(b"23\rR456\r") == [456]


# The driver ---------------------------------------------------------------------------------------


FRAMES = {
    "lv": "R100=2.54 R255=inf R254=inf",
    "xl": "R764=7.64 R765=inf",
    "xl-10m": "R099=0.99 R1067=10.67 R1068=inf",
    "hrlv": "R4999=4.999 R5000=inf",
    "hrxl-5m": "R0500=0.5 R5000=inf",
    "hrxl-10m": "R9998=9.998 R9999=inf",
}


@pytest.mark.parametrize("family", FAMILIES)
def test_each_family_has_its_unit_and_its_word_for_nothing(port: ScriptedPort, family: str) -> None:
    sonar = Maxbotix(port, family)
    for each in FRAMES[family].split():
        arrived, metres = each.split("=")
        sonar.start_ranging()
        port.arrived = f"{arrived}\r".encode()
        distance_m = sonar.read_distance()
        assert distance_m == pytest.approx(float(metres))
        nearest_m, farthest_m = sonar.limits_m
        assert nearest_m <= min(distance_m, sonar.nearest_m)
        assert distance_m <= farthest_m or distance_m == math.inf


@sentences(
    {
        "what came before is never given": "R100~R1; 01~ -> no frame; R102~ -> 1.02",
        "of several frames the newest is given": "; R100~R101~R102~R1 -> 1.02",
        "a frame that comes in two readings is read": (
            "; R1 -> no frame in 52 31, expected R, 3 digits; 00~ -> 1.0"
        ),
        "a frame that says zero is no distance, and the next one still counts": (
            "; R000~ -> a frame says 0.*expected its least distance; R020~ -> 0.2"
        ),
        "a silent line is reported with what may be the reason": (
            ";  -> xl on ttyS0: nothing received, .*unplugged, unpowered or its RX pin; "
            "R020~ -> 0.2"
        ),
        "an inverted signal is found by its bytes": (
            f"; {100 * chr(0)}\x2b\x06 -> no frame in (00 ){{10}}2b 06, .*its signal is inverted; "
            "R020~ -> 0.2"
        ),
    }
)
def test_a_ranging_is_read_once_from_what_arrives_after_it(
    port: ScriptedPort, sonar: Maxbotix, lines: str
) -> None:
    """Each line is what arrives, `~` a carriage return, and the distance or why there is none."""
    before, *others = lines.replace("~", "\r").split("; ")
    port.arrived = before.encode()
    sonar.start_ranging()
    for line in others[:-1]:
        arrived, reason = line.split(" -> ")
        port.arrived = arrived.encode()
        with pytest.raises(NotReady, match=reason):
            sonar.read_distance()
    arrived, metres = others[-1].split(" -> ")
    port.arrived = arrived.encode()
    assert sonar.read_distance() == float(metres)
    port.arrived = b"R101\r"
    with pytest.raises(NotReady, match="no ranging to read"):
        sonar.read_distance()


def test_a_frame_that_began_before_a_ranging_does_not_count(
    port: ScriptedPort, sonar: Maxbotix
) -> None:
    for data in (b"R1", b"01\r"):
        sonar.start_ranging()
        port.arrived = data
        with pytest.raises(NotReady):
            sonar.read_distance()


def test_bring_up_listens_for_one_frame(port: ScriptedPort, sonar: Maxbotix) -> None:
    listen, identify = sonar.bring_up()
    listen.action()
    port.arrived = b"R100\r"
    identify.action()
    listen.action()
    with pytest.raises(NotReady, match="nothing received"):
        identify.action()


@pytest.mark.parametrize("family", FAMILIES)
def test_a_whole_frame_must_have_come_within_the_ranging_time_of_a_sonar_a_twentieth_slow(
    port: ScriptedPort, family: str
) -> None:
    sonar = Maxbotix(port, family)
    frame_ns = (max(sonar.family.digits) + 2) * 10 * 1_000_000_000 // 9600
    assert sonar.ranging_ns >= 1.05 * sonar.family.cycle_ns + frame_ns
    assert sonar.interval_ns >= sonar.ranging_ns


def test_each_family_measures_from_where_its_data_sheet_says(port: ScriptedPort) -> None:
    nearest_m = {family: round(Maxbotix(port, family).nearest_m, 4) for family in FAMILIES}
    assert list(nearest_m.values()) == [0.1524, 0.2, 0.2, 0.3, 0.3, 0.5], "of lv: six inches"


def test_an_unknown_family_is_refused_with_the_known_ones(port: ScriptedPort) -> None:
    with pytest.raises(SettingError, match="MaxBotix ez on ttyS0: expected one of lv, xl, xl-10m"):
        Maxbotix(port, "ez")


def test_the_longest_frame_takes_its_time_and_a_table_knows_every_family() -> None:
    """R, four digits, carriage return, with a start and a stop bit each."""
    longest = 1 + max(max(family.digits) for family in FAMILIES.values()) + 1
    assert FRAME_NS == longest * 10 * 1_000_000_000 // BAUD == 6_250_000
    assert BAUD == 9600
    assert get_args(get_type_hints(MaxbotixTable)["family"]) == tuple(FAMILIES)
