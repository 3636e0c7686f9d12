"""Values of a link are sent until they have arrived, a newer one has left, or they are too old."""

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.links.cut.outbox import Message, Outbox
from firmware_runtime.links.cut.wire import Frame, Kind

TIMEOUT = SECOND // 2


def sent(outbox: Outbox, now: int, counter: int) -> list[Message]:
    """What is sent now, in frames that count from here."""
    messages = []
    for number, message in enumerate(outbox.take(now, 0)):
        message.counter, message.sent_at = counter + number, now
        messages.append(message)
    return messages


def seen(highest: int, before: int = 0) -> Frame:
    return Frame(Kind.HEARTBEAT, 2, 1, 1, 0, seen=highest, seen_before=before)


def test_a_value_that_was_lost_is_sent_again() -> None:
    outbox = Outbox(1, (), TIMEOUT)
    outbox.put(0, 0, b"a")
    assert [each.body for each in sent(outbox, 0, 1)] == [b"a"]
    assert sent(outbox, 1, 2) == []
    outbox.note(seen(2))
    again = sent(outbox, 2, 3)
    assert [(each.body, each.sequence) for each in again] == [(b"a", 1)]
    outbox.note(seen(3))
    assert sent(outbox, TIMEOUT // 2, 4) == []


def test_a_value_that_arrived_is_not() -> None:
    outbox = Outbox(1, (), TIMEOUT)
    outbox.put(0, 0, b"a")
    sent(outbox, 0, 1)
    outbox.note(seen(2, 0b1))
    assert sent(outbox, TIMEOUT // 2, 3) == []


def test_a_value_without_any_answer_is_sent_again_after_a_while() -> None:
    outbox = Outbox(1, (), TIMEOUT)
    outbox.put(0, 0, b"a")
    sent(outbox, 0, 1)
    assert sent(outbox, 50 * MILLISECOND, 2) == []
    assert len(sent(outbox, 150 * MILLISECOND, 2)) == 1


def test_a_newer_value_of_the_port_takes_its_place() -> None:
    outbox = Outbox(1, (), TIMEOUT)
    outbox.put(0, 0, b"a")
    sent(outbox, 0, 1)
    outbox.put(0, 1, b"b")
    outbox.note(seen(5))
    assert [each.body for each in sent(outbox, 1, 6)] == [b"b"]


def test_of_more_than_are_kept_the_oldest_are_dropped() -> None:
    outbox = Outbox(2, (), TIMEOUT)
    for body in (b"a", b"b", b"c"):
        outbox.put(0, 0, body)
    assert [each.body for each in sent(outbox, 0, 1)] == [b"b", b"c"]
    assert outbox.dropped == 1


def test_a_value_that_is_too_old_is_not_sent_unless_it_is_retained() -> None:
    outbox = Outbox(1, (1,), TIMEOUT)
    outbox.put(0, 0, b"command")
    outbox.put(1, 0, b"enabled")
    outbox.discard()
    outbox.begin_again()
    assert [each.body for each in sent(outbox, 2 * TIMEOUT, 1)] == [b"enabled"]


def test_another_peer_gets_what_the_first_one_had() -> None:
    outbox = Outbox(1, (), TIMEOUT)
    outbox.put(0, 0, b"a")
    sent(outbox, 0, 1)
    outbox.note(seen(1))
    outbox.begin_again()
    assert [each.body for each in sent(outbox, 1, 2)] == [b"a"]
