"""Values of a link are sent until they have arrived, a newer one has left, or they are too old.

And since when the other end may lack something, by what it says it has accepted.
"""

from collections.abc import Collection
from itertools import count

import pytest

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.links.cut.counts import Counts
from firmware_runtime.links.cut.cut import Terms
from firmware_runtime.links.cut.outbox import MOST_ORDERED, Message, Outbox
from firmware_runtime.links.cut.wire import NOTHING_MISSING, Frame, Kind, Missing

TIMEOUT = SECOND // 2
NUMBERS = {str(number): number for number in range(4)}


class Box(Outbox):
    """An outbox, of which each value that is put in is a step."""

    def __init__(
        self, keep: int = 1, retained: Collection[int] = (), ordered: Collection[int] = ()
    ) -> None:
        self.counts = Counts()
        self._steps = count(1)
        retain, in_order = (frozenset(map(str, each)) for each in (retained, ordered))
        terms = Terms(timeout=TIMEOUT, keep=keep, retain=retain, ordered=in_order)
        super().__init__(NUMBERS, terms, self.counts)

    def leave(self, port: int, at: int, body: bytes = b"") -> None:
        """A value leaves by a port at an instant."""
        self.put(next(self._steps), port, at, 1, body)

    def sent(self, now: int, counter: int) -> list[Message]:
        """What is sent now, in frames that count from here."""
        messages = []
        for number, step in enumerate(self.take(now, 0)):
            self.note_sent(step, counter + number, now)
            messages += step
        return messages

    @property
    def unsent(self) -> tuple[int, int]:
        """Values that were never sent: without another end, and given up."""
        return self.counts.unconnected, self.counts.given_up


def seen(highest: int, before: int = 0) -> Frame:
    return Frame(Kind.HEARTBEAT, 2, 1, 1, 0, seen=highest, seen_before=before)


def test_a_value_that_was_lost_is_sent_again() -> None:
    outbox = Box(1)
    outbox.leave(0, 0, b"a")
    assert [each.body for each in outbox.sent(0, 1)] == [b"a"]
    assert outbox.sent(1, 2) == []
    outbox.note(seen(2))
    again = outbox.sent(2, 3)
    assert [(each.body, each.sequence) for each in again] == [(b"a", 1)]
    outbox.note(seen(3))
    assert outbox.sent(TIMEOUT // 2, 4) == []


def test_a_value_that_arrived_is_not() -> None:
    outbox = Box(1)
    outbox.leave(0, 0, b"a")
    outbox.sent(0, 1)
    outbox.note(seen(2, 0b1))
    assert outbox.sent(TIMEOUT // 2, 3) == []


def test_a_value_without_any_answer_is_sent_again_after_a_while() -> None:
    outbox = Box(1)
    outbox.leave(0, 0, b"a")
    outbox.sent(0, 1)
    assert outbox.sent(50 * MILLISECOND, 2) == []
    assert len(outbox.sent(150 * MILLISECOND, 2)) == 1


def test_a_newer_value_of_the_port_takes_its_place() -> None:
    outbox = Box(1)
    outbox.leave(0, 0, b"a")
    outbox.sent(0, 1)
    outbox.leave(0, 1, b"b")
    outbox.note(seen(5))
    assert [each.body for each in outbox.sent(1, 6)] == [b"b"]


def test_of_more_than_are_kept_the_oldest_are_dropped() -> None:
    outbox = Box(2)
    for body in (b"a", b"b", b"c"):
        outbox.leave(0, 0, body)
    assert outbox.unsent == (1, 0), "there was no other end yet"
    assert [each.body for each in outbox.sent(0, 1)] == [b"b", b"c"]
    outbox.note(seen(2, 0b1))
    for body in (b"d", b"e", b"f"):
        outbox.leave(0, 1, body)
    assert [each.body for each in outbox.sent(1, 3)] == [b"e", b"f"]
    assert outbox.unsent == (1, 1)


def test_what_leaves_while_the_other_end_is_silent_is_not_given_up_but_unconnected() -> None:
    outbox = Box()
    assert outbox.sent(0, 1) == []
    outbox.expire(1)
    outbox.leave(0, 2, b"a")
    outbox.leave(0, 3, b"b")
    outbox.expire(3 + TIMEOUT + 1)
    assert outbox.unsent == (2, 0)
    assert outbox.sent(4 + TIMEOUT, 1) == []


def test_a_value_that_is_too_old_is_not_sent_unless_it_is_retained() -> None:
    outbox = Box(1, (1,))
    outbox.leave(0, 0, b"command")
    outbox.leave(1, 0, b"enabled")
    outbox.begin_again()
    assert [each.body for each in outbox.sent(2 * TIMEOUT, 1)] == [b"enabled"]


@pytest.mark.parametrize("ordered", [(), (0,)])
def test_the_last_value_that_was_lost_is_sent_as_long_as_the_peer_is_there(
    ordered: tuple[int, ...],
) -> None:
    outbox = Box(1, ordered=ordered)
    outbox.leave(0, 0, b"stop")
    outbox.sent(1, 1)
    outbox.note(seen(2))
    assert [each.body for each in outbox.sent(2 * TIMEOUT, 3)] == [b"stop"]
    outbox.note(seen(4))
    outbox.expire(3 * TIMEOUT)
    assert outbox.sent(3 * TIMEOUT, 5) == []


def test_another_peer_gets_what_the_first_one_had() -> None:
    outbox = Box(1)
    outbox.leave(0, 0, b"a")
    outbox.sent(0, 1)
    outbox.note(seen(1))
    outbox.begin_again()
    assert [each.body for each in outbox.sent(1, 2)] == [b"a"]


def test_what_left_in_a_step_is_sent_together_and_again_as_far_as_it_is_of_use() -> None:
    outbox = Box()
    for port in (0, 1):
        outbox.put(1, port, 0, 1, b"first")
    [step] = outbox.take(0, 0)
    assert [each.port for each in step] == [0, 1]
    outbox.note_sent(step, 1, 1)
    outbox.note(seen(2))
    outbox.put(2, 1, 5, 1, b"newer")
    again = [[(each.step, each.port) for each in step] for step in outbox.take(5, 0)]
    assert again == [[(1, 0)], [(2, 1)]]


def test_of_a_port_that_keeps_several_as_many_are_sent_again() -> None:
    outbox = Box(2)
    for at in range(3):
        outbox.leave(0, at, bytes([at]))
        outbox.sent(at, at + 1)
    outbox.note(seen(9))
    assert [each.body for each in outbox.sent(4, 10)] == [b"\x01", b"\x02"]
    outbox.note(seen(11))
    assert outbox.sent(5, 12) == [], "one that is older than the newest that arrived is of no use"


def test_all_of_an_ordered_port_is_sent_again_and_comes_after_what_was_before_it() -> None:
    outbox = Box(ordered=[0])
    for at in range(3):
        outbox.leave(0, at, bytes([at]))
    assert [(each.sequence, each.after) for each in outbox.sent(3, 1)] == [(1, 0), (2, 1), (3, 2)]
    outbox.note(seen(3, 0b00))
    assert [each.sequence for each in outbox.sent(4, 4)] == [1, 2]
    assert outbox.wants_answer
    outbox.note(seen(5, 0b1))
    assert not outbox.wants_answer


def test_what_comes_after_one_that_was_given_up_waits_for_none() -> None:
    outbox = Box(ordered=[0])
    assert outbox.sent(0, 1) == []
    outbox.leave(0, 0, b"lost")
    outbox.leave(0, TIMEOUT, b"kept")
    assert [(each.sequence, each.after) for each in outbox.sent(TIMEOUT + 1, 1)] == [(2, 0)]
    assert outbox.counts.given_up == 1
    outbox.note(seen(1))
    outbox.leave(0, TIMEOUT + 2, b"next")
    assert [(each.sequence, each.after) for each in outbox.sent(TIMEOUT + 2, 2)] == [(3, 2)]


def test_an_ordered_port_holds_so_many_and_gives_up_the_oldest() -> None:
    outbox = Box(ordered=[0])
    for number in range(MOST_ORDERED + 3):
        outbox.leave(0, number, b"")
    held = outbox.sent(0, 1)
    assert [held[0].sequence, held[-1].sequence, len(held)] == [4, MOST_ORDERED + 3, MOST_ORDERED]
    assert (held[0].after, outbox.counts.unconnected) == (0, 3)


def test_another_peer_counts_an_ordered_port_from_what_it_gets_first() -> None:
    outbox = Box(retained=[1], ordered=[0, 1])
    for port in (0, 1):
        outbox.leave(port, 0, b"a")
        outbox.leave(port, 0, b"b")
    outbox.sent(0, 1)
    outbox.note(seen(4, 0b111))
    outbox.begin_again()
    assert [(each.port, each.body, each.after) for each in outbox.sent(2 * TIMEOUT, 1)] == [
        (1, b"b", 0)
    ]
    outbox.leave(0, 2 * TIMEOUT, b"c")
    assert [each.after for each in outbox.sent(2 * TIMEOUT, 2)] == [0]


# What the other end may lack ----------------------------------------------------------------------


def test_nothing_is_missing_before_anything_left_and_after_it_was_accepted() -> None:
    outbox = Box()
    assert outbox.oldest == NOTHING_MISSING
    outbox.leave(3, 100)
    outbox.sent(100, 7)
    assert outbox.oldest == Missing(since=100, sequence=1, port=3)
    outbox.note(seen(7))
    assert outbox.oldest == NOTHING_MISSING


def test_a_stream_that_is_lost_is_missing_since_its_first_value() -> None:
    outbox = Box()
    for sequence in range(1, 50):
        outbox.leave(0, sequence * 10)
        outbox.sent(sequence * 10, sequence)
        outbox.note(seen(0))
    assert (outbox.oldest, outbox.waits_since) == (Missing(10, 1, 0), 10)
    outbox.note(seen(40))
    assert (outbox.oldest, outbox.waits_since) == (Missing(410, 41, 0), 410)
    outbox.note(seen(49, 0))
    assert (outbox.oldest, outbox.waits_since) == (NOTHING_MISSING, None)


def test_of_several_ports_what_left_longest_ago_counts() -> None:
    outbox = Box()
    outbox.leave(2, 100)
    outbox.sent(100, 1)
    outbox.leave(1, 200)
    assert outbox.oldest.port == 2
    outbox.note(seen(1))
    assert outbox.oldest.port == 1


def test_a_frame_that_was_overtaken_is_accepted_late() -> None:
    outbox = Box()
    for port in (1, 2):
        outbox.leave(port, port * 100)
        outbox.sent(port * 100, port)
    outbox.note(seen(2))
    assert outbox.oldest == Missing(100, 1, 1)
    outbox.note(seen(2, 0b1))
    assert outbox.oldest == NOTHING_MISSING
    assert outbox.sent(300, 3) == [], "it has arrived after all"


def test_what_is_sent_again_is_accepted_by_either_frame() -> None:
    outbox = Box()
    outbox.leave(1, 100)
    outbox.sent(100, 1)
    outbox.note(seen(100))
    outbox.sent(101, 101)
    outbox.note(seen(101))
    assert outbox.oldest == NOTHING_MISSING


def test_what_found_no_room_and_was_given_up_is_missing_for_as_long_again() -> None:
    outbox = Box()
    assert outbox.sent(0, 1) == []
    outbox.leave(0, 0)
    assert list(outbox.take(TIMEOUT + MILLISECOND, 0)) == []
    assert (outbox.counts.given_up, outbox.oldest.sequence) == (1, 1)
    list(outbox.take(2 * TIMEOUT, 0))
    assert outbox.oldest.sequence == 1
    list(outbox.take(2 * TIMEOUT + 1, 0))
    assert outbox.oldest == NOTHING_MISSING


def test_another_peer_lacks_what_is_sent_to_it_and_nothing_before_that() -> None:
    outbox = Box()
    for number in range(3):
        outbox.leave(0, number)
    assert outbox.oldest.sequence == 1
    outbox.begin_again()
    assert outbox.oldest == Missing(since=2, sequence=3, port=0)
