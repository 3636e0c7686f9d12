"""Since when the other end may lack something, by what it says it has accepted."""

import pytest

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.links.cut.outbox import Outbox
from firmware_runtime.links.cut.unaccepted import Unaccepted
from firmware_runtime.links.cut.wire import NOTHING_MISSING, Frame, Kind, Missing

TIMEOUT = SECOND // 2


@pytest.fixture
def left() -> Unaccepted:
    return Unaccepted()


def seen(highest: int, before: int = 0) -> Frame:
    return Frame(Kind.HEARTBEAT, 2, 1, 1, 0, seen=highest, seen_before=before)


def test_nothing_is_missing_before_anything_left_and_after_it_was_accepted(
    left: Unaccepted,
) -> None:
    assert left.oldest == NOTHING_MISSING
    left.put(3, 1, 100)
    left.note_sent(7, 7, [(3, 1)])
    assert left.oldest == Missing(since=100, sequence=1, port=3)
    left.note(seen(7))
    assert left.oldest == NOTHING_MISSING


def test_a_stream_that_is_lost_is_missing_since_its_first_value(left: Unaccepted) -> None:
    for sequence in range(1, 50):
        left.put(0, sequence, sequence * 10)
        left.note_sent(sequence, sequence, [(0, sequence)])
        left.note(seen(0))
    assert left.oldest == Missing(10, 1, 0)
    assert left.waits_since == 1
    left.note(seen(40))
    assert (left.oldest, left.waits_since) == (Missing(410, 41, 0), 41)
    left.note(seen(49, 0))
    assert left.oldest == NOTHING_MISSING
    assert left.waits_since is None


def test_of_several_ports_what_left_longest_ago_counts(left: Unaccepted) -> None:
    left.put(1, 5, 200)
    left.put(2, 9, 100)
    assert left.oldest.port == 2
    left.note_sent(1, 1, [(2, 9)])
    left.note(seen(1))
    assert left.oldest.port == 1


def test_a_frame_that_was_overtaken_is_accepted_late(left: Unaccepted) -> None:
    left.put(1, 1, 100)
    left.note_sent(1, 1, [(1, 1)])
    left.put(2, 1, 200)
    left.note_sent(2, 2, [(2, 1)])
    left.note(seen(2))
    assert left.oldest == Missing(100, 1, 1)
    left.note(seen(2, 0b1))
    assert left.oldest == NOTHING_MISSING


def test_what_is_sent_again_is_accepted_by_either_frame(left: Unaccepted) -> None:
    left.put(1, 1, 100)
    left.note_sent(1, 1, [(1, 1)])
    left.note(seen(100))
    left.note_sent(101, 101, [(1, 1)])
    left.note(seen(101))
    assert left.oldest == NOTHING_MISSING


def test_what_found_no_room_and_was_given_up_is_missing_for_as_long_again() -> None:
    outbox = Outbox(1, (), (), TIMEOUT)
    assert list(outbox.take(0, 0)) == []
    outbox.put(1, 0, 0, 1, b"a")
    assert list(outbox.take(TIMEOUT + MILLISECOND, 0)) == []
    assert (outbox.given_up, outbox.unaccepted.oldest.sequence) == (1, 1)
    list(outbox.take(2 * TIMEOUT, 0))
    assert outbox.unaccepted.oldest.sequence == 1
    list(outbox.take(2 * TIMEOUT + 1, 0))
    assert outbox.unaccepted.oldest == NOTHING_MISSING


def test_another_peer_lacks_what_is_sent_to_it_and_nothing_before_that() -> None:
    outbox = Outbox(1, (), (), TIMEOUT)
    for number in range(3):
        outbox.put(number, 0, number, 1, b"a")
    assert outbox.unaccepted.oldest.sequence == 1
    outbox.begin_again()
    assert outbox.unaccepted.oldest == Missing(since=2, sequence=3, port=0)
