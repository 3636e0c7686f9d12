from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.time import MICROSECOND, MILLISECOND, SECOND
from firmware_runtime.ecdpp.event_file import Event, parse_events, read_events
from firmware_runtime.ecdpp.file_text import Warnings, format_time, parse_time
from firmware_runtime.errors import ConfigError


def model() -> Component:
    component = Component("model")
    component.in_port("In1", float)
    component.in_port("count", int)
    component.in_port("Count", int)
    component.in_port("flag", bool)
    component.in_port("words", str)
    return component


def parse(text: str) -> list[Event]:
    return parse_events(text, "test.ev", model())


def faults(text: str) -> tuple[str, ...]:
    with pytest.raises(ConfigError) as caught:
        parse(text)
    assert caught.value.where == "test.ev"
    return caught.value.faults


def test_the_last_field_of_a_time_is_a_number_of_milliseconds() -> None:
    times = ["00:00:09:5", "00:00:09:50", "00:00:09:500", "00:01:00:00", "123:59:59:999"]
    assert [parse_time(text) for text in times] == [
        9 * SECOND + 5 * MILLISECOND,
        9 * SECOND + 50 * MILLISECOND,
        9 * SECOND + 500 * MILLISECOND,
        60 * SECOND,
        446_399_999 * MILLISECOND,
    ]


@settings(deadline=None)
@given(st.integers(0, 3_600_000_000))
def test_a_time_written_is_read_back(milliseconds: int) -> None:
    at = milliseconds * MILLISECOND
    assert parse_time(format_time(at)) == at


def test_events_are_read_in_order() -> None:
    assert parse("00:00:02:00 In1 1\n00:00:02:00 count 3\n00:00:09:50 In1 -2.5") == [
        Event(2 * SECOND, "In1", 1.0),
        Event(2 * SECOND, "count", 3),
        Event(9 * SECOND + 50 * MILLISECOND, "In1", -2.5),
    ]


def test_comments_blank_lines_crlf_tabs_and_spaces_do_not_matter() -> None:
    text = "# begin\r\n\r\n  // then\n% and\n\t00:00:01:000\tIn1   1  \r\n00:00:02:000 In1 2 # 2"
    assert [event.value for event in parse(text)] == [1.0, 2.0]


def test_an_empty_file_has_no_events() -> None:
    assert parse("") == []


def test_a_value_arrives_as_its_ports_type() -> None:
    values = [
        event.value
        for event in parse(
            "00:00:00:000 In1 7\n00:00:00:000 In1 .5\n00:00:00:000 In1 +3.\n"
            "00:00:00:000 count 4.0\n00:00:00:000 flag 1\n00:00:00:000 flag 0"
        )
    ]
    assert values == [7.0, 0.5, 3.0, 4, True, False]
    assert [type(value) for value in values] == [float, float, float, int, bool, bool]


def test_ports_are_found_without_regard_to_case_but_an_exact_name_comes_first() -> None:
    events = parse("00:00:01:000 in1 1\n00:00:01:000 IN1 1\n00:00:01:000 Count 1")
    assert [event.port for event in events] == ["In1", "In1", "Count"]


@pytest.mark.parametrize(
    ("time", "at"),
    [
        ("00:00:01", SECOND),
        ("00:00:75", 75 * SECOND),
        ("00:00:01:002:003", SECOND + 2 * MILLISECOND + 3 * MICROSECOND),
    ],
)
def test_a_time_may_end_with_its_seconds_or_go_on_to_microseconds(time: str, at: int) -> None:
    assert [event.at for event in parse(f"{time} In1 1")] == [at]


@pytest.mark.parametrize(("value", "number"), [("1e3", 1000.0), ("-2.5E-3", -0.0025)])
def test_a_value_may_have_an_exponent(value: str, number: float) -> None:
    assert [event.value for event in parse(f"00:00:01:000 In1 {value}")] == [number]


@pytest.mark.parametrize(
    ("line", "fault"),
    [
        ("00:00:01:000 In1", "expected HH:MM:SS:ms Port Value"),
        ("00:00:01:000 In1 1 2", "expected HH:MM:SS:ms Port Value"),
        ("In1 00:00:01:000 1", "time 'In1': expected HH:MM:SS:ms"),
        ("00:01 In1 1", "time '00:01'"),
        ("00:00:01.500 In1 1", "time '00:00:01.500'"),
        ("-0:00:01:000 In1 1", "time '-0:00:01:000'"),
        ("00:00:01:000 In9 1", "unknown port 'In9'; expected one of In1, count"),
        ("00:00:01:000 In1 one", "value 'one': expected a number"),
        ("00:00:01:000 In1 nan", "value 'nan': expected a number"),
        ("00:00:01:000 In1 inf", "value 'inf': expected a number"),
        ("00:00:01:000 In1 1e999", "value '1e999': expected a number"),
        ("00:00:01:000 In1 1_000", "value '1_000': expected a number"),
        ("00:00:01:000 In1 " + "9" * 400, "expected a number"),
        ("00:00:01:000 count 1.5", "port 'count' carries int"),
        ("00:00:01:000 flag 2", "port 'flag' carries bool"),
        ("00:00:01:000 words 1", "port 'words' carries str"),
        ("end", "expected HH:MM:SS:ms Port Value"),
    ],
)
def test_a_line_that_is_no_event_is_a_fault_with_its_number(line: str, fault: str) -> None:
    [found] = faults(f"# first\n{line}\n")
    assert found.startswith("line 2: ")
    assert fault in found


def test_events_are_sorted_by_time_and_those_of_one_instant_keep_their_order() -> None:
    text = "00:00:02:000 In1 1\n00:00:01:999 count 9\n00:00:02:000 count 2\n00:00:02:000 In1 3"
    assert [(event.at // MILLISECOND, event.port, event.value) for event in parse(text)] == [
        (1999, "count", 9),
        (2000, "In1", 1.0),
        (2000, "count", 2),
        (2000, "In1", 3.0),
    ]


def test_several_events_may_stand_on_a_line_and_each_has_its_own_faults() -> None:
    events = parse("00:00:02:000 In1 1  00:00:01:000 count 3\t00:00:02:000 flag 0 # three")
    assert [(event.at // SECOND, event.port) for event in events] == [
        (1, "count"),
        (2, "In1"),
        (2, "flag"),
    ]
    first, second = faults("00:00:02:000 In9 1 00:00:01:000 count 3 00:00:01:000 flag x")
    assert "In9" in first
    assert "'x'" in second


def test_all_faults_of_a_file_are_listed_at_once() -> None:
    found = faults("00:00:02:000 In1 x\n\n00:00:01:000 In1 1\noops\n00:00:03:000 In7 1")
    assert [fault.split(":")[0] for fault in found] == ["line 1", "line 4", "line 5"]


def test_a_file_is_read_and_named_in_its_faults(tmp_path: Path) -> None:
    path = tmp_path / "mission.ev"
    path.write_bytes(b"\xef\xbb\xbf00:00:02:00 In1 1\r\n00:00:03:00 In1 2\r\n")
    assert [event.at for event in read_events(path, model())] == [2 * SECOND, 3 * SECOND]
    path.write_text("00:00:02:00 In1 x\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"mission\.ev: 1 fault\n  - line 1: value 'x'"):
        read_events(path, model())


@pytest.mark.parametrize("content", [None, b"\xff\xfe\x00"])
def test_a_file_that_cannot_be_read_is_a_fault(tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "mission.ev"
    if content is not None:
        path.write_bytes(content)
    expected = "No such file" if content is None else "not UTF-8 in line 1; expected text"
    with pytest.raises(ConfigError, match=f"cannot be read: {expected}"):
        read_events(path, model())


def test_what_is_above_59_is_carried_over_as_cdpp_does() -> None:
    warnings = Warnings()
    text = "00:00:75:00 In1 1\n00:01:10:00 In1 2\n00:90:00:1500 In1 3\n"
    assert parse_events(text, "test.ev", model(), warnings) == [
        Event(70 * SECOND, "In1", 2.0),
        Event(75 * SECOND, "In1", 1.0),
        Event(5401 * SECOND + 500 * MILLISECOND, "In1", 3.0),
    ]
    assert warnings.sentences() == [
        "line 1: time 00:00:75:00: what is above 59 is carried over (and 1 more)"
    ]


def test_an_undefined_value_is_no_event() -> None:
    warnings = Warnings()
    text = "00:00:01:00 In1 ?\n00:00:02:00 count ?\n00:00:03:00 In1 1"
    assert parse_events(text, "test.ev", model(), warnings) == [Event(3 * SECOND, "In1", 1.0)]
    assert warnings.sentences() == ["line 1: In1 ?: undefined; nothing arrives (and 1 more)"]
    assert "unknown port" in faults("00:00:01:00 nowhere ?")[0]


def test_a_comment_may_be_in_another_encoding_but_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "latin1.ev"
    path.write_bytes("# \xe1ngulo\n00:00:01:00 In1 1 % se\xf1al\n".encode("latin-1"))
    assert read_events(path, model()) == [Event(SECOND, "In1", 1.0)]
    path.write_bytes("00:00:01:00 In1 1\n00:00:01:00 \xe1 1\n".encode("latin-1"))
    with pytest.raises(ConfigError, match="not UTF-8 in line 2; expected text"):
        read_events(path, model())
