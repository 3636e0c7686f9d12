"""Values of a link are sent until they have arrived, a newer one has left, or they are too old."""

from collections.abc import Callable, Collection
from itertools import count
from typing import TypeAlias

import pytest

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.links.cut.outbox import MOST_ORDERED, Message, Outbox
from firmware_runtime.links.cut.wire import Frame, Kind

TIMEOUT = SECOND // 2
Put: TypeAlias = Callable[[int, int, bytes], None]


def sent(outbox: Outbox, now: int, counter: int) -> list[Message]:
    """What is sent now, in frames that count from here."""
    messages = []
    for number, step in enumerate(outbox.take(now, 0)):
        for message in step:
            message.counter, message.sent_at = counter + number, now
            messages.append(message)
    return messages


def box(
    keep: int = 1, retained: Collection[int] = (), ordered: Collection[int] = ()
) -> "tuple[Outbox, Put]":
    """An outbox, and what puts one value into it: by port, instant and body, each a step."""
    outbox, steps = Outbox(keep, retained, ordered, TIMEOUT), count(1)
    return outbox, lambda port, at, body: outbox.put(next(steps), port, at, 1, body)


def seen(highest: int, before: int = 0) -> Frame:
    return Frame(Kind.HEARTBEAT, 2, 1, 1, 0, seen=highest, seen_before=before)


def test_a_value_that_was_lost_is_sent_again() -> None:
    outbox, put = box(1)
    put(0, 0, b"a")
    assert [each.body for each in sent(outbox, 0, 1)] == [b"a"]
    assert sent(outbox, 1, 2) == []
    outbox.note(seen(2))
    again = sent(outbox, 2, 3)
    assert [(each.body, each.sequence) for each in again] == [(b"a", 1)]
    outbox.note(seen(3))
    assert sent(outbox, TIMEOUT // 2, 4) == []


def test_a_value_that_arrived_is_not() -> None:
    outbox, put = box(1)
    put(0, 0, b"a")
    sent(outbox, 0, 1)
    outbox.note(seen(2, 0b1))
    assert sent(outbox, TIMEOUT // 2, 3) == []


def test_a_value_without_any_answer_is_sent_again_after_a_while() -> None:
    outbox, put = box(1)
    put(0, 0, b"a")
    sent(outbox, 0, 1)
    assert sent(outbox, 50 * MILLISECOND, 2) == []
    assert len(sent(outbox, 150 * MILLISECOND, 2)) == 1


def test_a_newer_value_of_the_port_takes_its_place() -> None:
    outbox, put = box(1)
    put(0, 0, b"a")
    sent(outbox, 0, 1)
    put(0, 1, b"b")
    outbox.note(seen(5))
    assert [each.body for each in sent(outbox, 1, 6)] == [b"b"]


def test_of_more_than_are_kept_the_oldest_are_dropped() -> None:
    outbox, put = box(2)
    for body in (b"a", b"b", b"c"):
        put(0, 0, body)
    assert (outbox.unconnected, outbox.given_up) == (1, 0), "there was no other end yet"
    assert [each.body for each in sent(outbox, 0, 1)] == [b"b", b"c"]
    outbox.note(seen(2, 0b1))
    for body in (b"d", b"e", b"f"):
        put(0, 1, body)
    assert [each.body for each in sent(outbox, 1, 3)] == [b"e", b"f"]
    assert (outbox.unconnected, outbox.given_up) == (1, 1)


def test_what_leaves_while_the_other_end_is_silent_is_not_given_up_but_unconnected() -> None:
    outbox, put = box()
    assert sent(outbox, 0, 1) == []
    outbox.expire(1)
    put(0, 2, b"a")
    put(0, 3, b"b")
    outbox.expire(3 + TIMEOUT + 1)
    assert (outbox.unconnected, outbox.given_up) == (2, 0)
    assert sent(outbox, 4 + TIMEOUT, 1) == []


def test_a_value_that_is_too_old_is_not_sent_unless_it_is_retained() -> None:
    outbox, put = box(1, (1,))
    put(0, 0, b"command")
    put(1, 0, b"enabled")
    outbox.begin_again()
    assert [each.body for each in sent(outbox, 2 * TIMEOUT, 1)] == [b"enabled"]


@pytest.mark.parametrize("ordered", [(), (0,)])
def test_the_last_value_that_was_lost_is_sent_as_long_as_the_peer_is_there(
    ordered: tuple[int, ...],
) -> None:
    outbox, put = box(1, ordered=ordered)
    put(0, 0, b"stop")
    sent(outbox, 1, 1)
    outbox.note(seen(2))
    assert [each.body for each in sent(outbox, 2 * TIMEOUT, 3)] == [b"stop"]
    outbox.note(seen(4))
    outbox.expire(3 * TIMEOUT)
    assert sent(outbox, 3 * TIMEOUT, 5) == []


def test_another_peer_gets_what_the_first_one_had() -> None:
    outbox, put = box(1)
    put(0, 0, b"a")
    sent(outbox, 0, 1)
    outbox.note(seen(1))
    outbox.begin_again()
    assert [each.body for each in sent(outbox, 1, 2)] == [b"a"]


def test_what_left_in_a_step_is_sent_together_and_again_as_far_as_it_is_of_use() -> None:
    outbox, _ = box()
    for port in (0, 1):
        outbox.put(1, port, 0, 1, b"first")
    [step] = outbox.take(0, 0)
    assert [each.port for each in step] == [0, 1]
    for message in step:
        message.counter, message.sent_at = 1, 1
    outbox.note(seen(2))
    outbox.put(2, 1, 5, 1, b"newer")
    again = [[(each.step, each.port) for each in step] for step in outbox.take(5, 0)]
    assert again == [[(1, 0)], [(2, 1)]]


def test_of_a_port_that_keeps_several_as_many_are_sent_again() -> None:
    outbox, put = box(2)
    for at in range(3):
        put(0, at, bytes([at]))
        sent(outbox, at, at + 1)
    outbox.note(seen(9))
    assert [each.body for each in sent(outbox, 4, 10)] == [b"\x01", b"\x02"]
    outbox.note(seen(11))
    assert sent(outbox, 5, 12) == [], "one that is older than the newest that arrived is of no use"


def test_all_of_an_ordered_port_is_sent_again_and_comes_after_what_was_before_it() -> None:
    outbox, put = box(ordered=[0])
    for at in range(3):
        put(0, at, bytes([at]))
    assert [(each.sequence, each.after) for each in sent(outbox, 3, 1)] == [(1, 0), (2, 1), (3, 2)]
    outbox.note(seen(3, 0b00))
    assert [each.sequence for each in sent(outbox, 4, 4)] == [1, 2]
    assert outbox.wants_answer
    outbox.note(seen(5, 0b1))
    assert not outbox.wants_answer


def test_what_comes_after_one_that_was_given_up_waits_for_none() -> None:
    outbox, put = box(ordered=[0])
    assert sent(outbox, 0, 1) == []
    put(0, 0, b"lost")
    put(0, TIMEOUT, b"kept")
    assert [(each.sequence, each.after) for each in sent(outbox, TIMEOUT + 1, 1)] == [(2, 0)]
    assert outbox.given_up == 1
    outbox.note(seen(1))
    put(0, TIMEOUT + 2, b"next")
    assert [(each.sequence, each.after) for each in sent(outbox, TIMEOUT + 2, 2)] == [(3, 2)]


def test_an_ordered_port_holds_so_many_and_gives_up_the_oldest() -> None:
    outbox, put = box(ordered=[0])
    for number in range(MOST_ORDERED + 3):
        put(0, number, b"")
    held = sent(outbox, 0, 1)
    assert [held[0].sequence, held[-1].sequence, len(held)] == [4, MOST_ORDERED + 3, MOST_ORDERED]
    assert (held[0].after, outbox.unconnected) == (0, 3)


def test_another_peer_counts_an_ordered_port_from_what_it_gets_first() -> None:
    outbox, put = box(retained=[1], ordered=[0, 1])
    for port in (0, 1):
        put(port, 0, b"a")
        put(port, 0, b"b")
    sent(outbox, 0, 1)
    outbox.note(seen(4, 0b111))
    outbox.begin_again()
    assert [(each.port, each.body, each.after) for each in sent(outbox, 2 * TIMEOUT, 1)] == [
        (1, b"b", 0)
    ]
    put(0, 2 * TIMEOUT, b"c")
    assert [each.after for each in sent(outbox, 2 * TIMEOUT, 2)] == [0]
