"""What a replay is given of a section, and what it says of what was asked for otherwise."""

from typing import Any

import msgspec
import pytest
from msgspec.structs import replace

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.functions import Wrapped
from firmware_runtime.devs.time import SECOND
from firmware_runtime.recording.blackbox.ring_file import Header
from firmware_runtime.recording.blackbox.section import DISCARD, READ, Kind, Section, Transfer
from firmware_runtime.recording.replay.difference import NOTHING, Difference
from firmware_runtime.recording.replay.feed import Feed, OpenFeed
from firmware_runtime.recording.replay.rebuilt_robot import PlayedWorld

AT = 3 * SECOND
HEADER = Header(
    board="tachobot",
    kind="tachobot",
    fingerprint="",
    source="",
    table={},
    clock="MonotonicClock",
    code={},
    code_sha256="",
    versions={},
    run="",
    role=None,
    has_world=False,
    speed=1.0,
    lines=["i2c1", "sonar"],
    early=[],
    ports=[],
    world=[],
)
WHO = Transfer(0, 0x68, [b"\x75", 1], b"\x71", AT)
SAMPLE = Transfer(0, 0x68, [b"\x3b", 6], b"sample", AT)
DUTY = Transfer(0, 0x40, [b"\x06\x00"], b"", AT)
RANGE = Transfer(1, READ, b"", b"R042", AT)


def section(
    *transfers: Transfer,
    readings: tuple[int, ...] = (),
    times: tuple[int, ...] = (),
    enabled: tuple[bool, ...] = (),
    sent: tuple[object, ...] = (),
) -> Section:
    pairs = msgspec.Raw(msgspec.msgpack.encode(sent))
    world: list[int] = []
    return Section(Kind.STEP, AT, [*readings], [*times], [*enabled], world, pairs, [*transfers], [])


@pytest.fixture
def found() -> list[Difference]:
    return []


@pytest.fixture
def feed(found: list[Difference]) -> Feed:
    return Feed(HEADER, found.append)


@pytest.fixture
def open_feed(found: list[Difference]) -> OpenFeed:
    return OpenFeed(HEADER, found.append)


def ask(feed: Feed, asked: Transfer) -> Transfer | None:
    return feed.transfer(asked.line, asked.address, asked.messages)


def written(model: str, recorded: object, asked: object) -> Difference:
    return Difference(AT, "write", model, "transfer", recorded, asked)


def test_what_is_asked_for_as_it_was_is_no_difference(feed: Feed, found: list[Difference]) -> None:
    feed.load(section(WHO, DUTY, RANGE, readings=(7, 8), times=(5,), enabled=(True,)))
    assert [ask(feed, each) for each in (WHO, DUTY, RANGE)] == [WHO, DUTY, RANGE]
    assert (feed.reading(), feed.reading(), feed.elapsed(), feed.enabled()) == (7, 8, 5, True)
    feed.check_all_taken()
    assert found == []


def test_what_is_written_otherwise_or_in_another_order_is_a_difference(
    feed: Feed, found: list[Difference]
) -> None:
    feed.load(section(DUTY, WHO, SAMPLE))
    assert feed.transfer(0, 0x40, [b"\x06\x10"]) == DUTY
    assert ask(feed, SAMPLE) == SAMPLE
    assert found == [
        written("i2c1 0x40", DUTY.messages, [b"\x06\x10"]),
        written("i2c1 0x68", WHO.messages, SAMPLE.messages),
    ]


def test_what_was_not_written_is_a_difference(feed: Feed, found: list[Difference]) -> None:
    feed.load(section(WHO, Transfer(0, 0x68, [b"\x75", b"\x01\x02"], b"", AT)))
    assert feed.transfer(0, 0x68, [b"\x75", 2]) is None  # another length, and no write
    assert feed.transfer(0, 0, WHO.messages) is None
    assert feed.transfer(2, 0x68, WHO.messages) is None
    assert ask(feed, RANGE) is None
    models = ["i2c1 0x68", "i2c1 0x00", "line 2 0x68", "sonar"]
    assert [each.model for each in found] == models
    assert {each.recorded for each in found} == {NOTHING}


def test_what_is_not_asked_for_is_a_difference(feed: Feed, found: list[Difference]) -> None:
    feed.load(section(WHO, DUTY, readings=(7, 8, 9), times=(5, 6), enabled=(True,)))
    assert feed.reading() == 7
    feed.check_all_taken()
    assert found == [
        written("i2c1 0x68", WHO.messages, NOTHING),
        written("i2c1 0x40", DUTY.messages, NOTHING),
        Difference(AT, "asked", "", "clock", "2 more answers", NOTHING),
        Difference(AT, "asked", "", "line time", "2 more answers", NOTHING),
        Difference(AT, "asked", "", "interlock", "1 more answers", NOTHING),
    ]


def test_what_is_asked_for_beyond_is_one_difference_and_the_last_answer_holds(
    feed: Feed, found: list[Difference]
) -> None:
    feed.load(section(readings=(7,), times=(5,), enabled=(True,)))
    assert [feed.reading() for _ in range(3)] == [7, 7, 7]
    assert [feed.enabled() for _ in range(2)] == [True, True]
    assert (feed.world(4), feed.time()) == (4, 5)
    assert feed.time() == 0
    feed.check_all_taken()
    assert found == [Difference(AT, "asked", "", "clock", NOTHING, "one more answer")]
    feed.load(section())
    assert not feed.enabled()
    assert len(found) == 2


def test_in_virtual_time_the_clock_stands_still_within_a_section(
    found: list[Difference],
) -> None:
    feed = Feed(replace(HEADER, clock="VirtualClock"), found.append)
    feed.load(section(readings=(7,)))
    assert [feed.reading(), feed.reading()] == [7, 7]
    feed.load(section())
    assert feed.reading() == AT
    feed.check_all_taken()
    assert found == []


def test_what_the_world_sent_is_found_by_its_place_and_its_ports(feed: Feed) -> None:
    feed.load(section(sent=(3, 0.5, 4, "on")))
    assert feed.world_sent(0, {3}) == (3, 0.5)
    assert feed.world_sent(0, {4}) is None
    assert feed.world_sent(1, {3, 4}) == (4, "on")
    assert feed.world_sent(2, {3, 4}) is None


def test_what_a_world_sent_that_is_no_value_of_its_port_is_sent_as_it_was_written(
    feed: Feed,
) -> None:
    world, sent = Atomic("world"), list[Any]()
    world.out_port("place", float).record(3, sent)
    loaded = section(sent=(3, {"unknown": "robot:Place"}, 3, 1))
    loaded.world = [2]
    feed.load(loaded)
    own = Wrapped(world, world.output, world.internal, world.external, None)
    PlayedWorld(frozenset(), feed, sent).instrument(world, own).output()
    assert sent == [3, {"unknown": "robot:Place"}, 3, 1.0]


# A feed of other code ----------------------------------------------------------------------------


def test_other_code_is_given_the_answer_to_its_request_whatever_came_before_it(
    open_feed: OpenFeed, found: list[Difference]
) -> None:
    other = Transfer(0, 0x68, [b"\x76", 1], b"\x70", AT)
    open_feed.load(section(other, WHO, DUTY))
    assert ask(open_feed, WHO) == WHO
    assert open_feed.transfer(0, 0x40, [bytearray(DUTY.messages[0])]) == DUTY
    assert open_feed.transfer(0, 0x68, [b"\x77", 1]) == other  # of the same shape
    assert found == [written("i2c1 0x68", other.messages, [b"\x77", 1])]
    asked = [each.messages for each in open_feed.asked]
    assert asked == [WHO.messages, DUTY.messages, [b"\x77", 1]]
    open_feed.load(section())
    assert open_feed.asked == []


def test_other_code_is_given_the_last_answer_again_also_one_that_it_did_not_ask_for(
    open_feed: OpenFeed, found: list[Difference]
) -> None:
    later = Transfer(0, 0x68, SAMPLE.messages, b"later!", AT)
    open_feed.load(section(WHO, SAMPLE, later, DUTY))
    open_feed.check_all_taken()
    found.clear()
    open_feed.load(section(DUTY))
    assert ask(open_feed, WHO) == WHO
    assert ask(open_feed, SAMPLE) == later
    assert open_feed.transfer(0, 0x68, [b"\x3c", 6]) == later
    open_feed.load(section())
    assert ask(open_feed, DUTY) is None  # which reads nothing
    assert [each.recorded for each in found] == [NOTHING] * 4


def test_a_request_whose_answer_is_held_takes_no_other_of_the_section(
    open_feed: OpenFeed, found: list[Difference]
) -> None:
    other = Transfer(0, 0x68, [b"\x76", 1], b"\x70", AT)
    for each in (WHO, WHO, other):
        assert found == []
        open_feed.load(section(each))
        assert ask(open_feed, WHO) == WHO
    assert ask(open_feed, other) == other


def test_other_code_that_asks_for_more_is_no_difference_where_nothing_was_recorded(
    open_feed: OpenFeed, found: list[Difference]
) -> None:
    open_feed.load_nothing(AT)
    assert (open_feed.time(), open_feed.elapsed(), open_feed.reading()) == (AT, 0, AT)
    open_feed.check_all_taken()
    assert found == []


def test_an_instant_is_not_taken_for_how_far_lines_ran_ahead(open_feed: OpenFeed) -> None:
    open_feed.load(section(times=(SECOND, SECOND + 1)))
    assert (open_feed.elapsed(), open_feed.elapsed(), open_feed.elapsed()) == (SECOND, 0, 0)


def test_other_code_is_given_what_the_world_sent_in_the_order_of_its_ports(
    open_feed: OpenFeed,
) -> None:
    open_feed.load(section(sent=(3, 0.5, 4, "on", 3, 0.6)))
    assert open_feed.world_sent(0, {4}) == (4, "on")
    assert open_feed.world_sent(0, {3}) == (3, 0.5)
    assert open_feed.world_sent(0, {4}) is None
    assert open_feed.world_sent(9, {3}) == (3, 0.6)
    open_feed.load(section(sent=(3, 0.7)))
    assert open_feed.world_sent(0, {3}) == (3, 0.7)


def test_each_kind_of_section_has_the_number_that_it_has_in_files() -> None:
    assert list(Kind.__members__.values()) == list(range(15))


@pytest.mark.parametrize(
    "of", [(0, 0x68, [b"", 0, 1 << 16]), (0, 0, []), (0, 0x7F, []), (1, DISCARD, b"")]
)
def test_what_a_line_can_have_had_is_a_transfer(of: tuple[int, int, Any]) -> None:
    line, address, messages = of
    assert Transfer(line, address, messages, b"", AT).is_one


@pytest.mark.parametrize(
    "of",
    [
        *((-1, 0x68, []), (0, DISCARD - 1, b""), (0, 0x80, []), (0, 0x68, b""), (0, READ, [])),
        *((0, 0x68, [each]) for each in (-1, True, (1 << 16) + 1, "a")),
    ],
)
def test_what_no_line_can_have_had_is_none(of: tuple[int, int, Any]) -> None:
    line, address, messages = of
    assert not Transfer(line, address, messages, b"", AT).is_one
