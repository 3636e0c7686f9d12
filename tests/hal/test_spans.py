"""Spans of time in which a fault lasts: what is in them, and when that changes."""

from firmware_runtime.devs.time import NEVER
from firmware_runtime.hal.spans import Spans


def test_a_span_has_its_first_instant_and_not_the_one_at_which_it_is_over() -> None:
    spans = Spans()
    spans.add(10, 20)
    spans.add(30, NEVER)
    assert [at for at in (9, 10, 19, 20, 29, 30, NEVER - 1) if spans.have(at)] == [
        *(10, 19, 30, NEVER - 1)
    ]
    assert [spans.next_change(at) for at in (0, 10, 20, 30)] == [10, 20, 30, NEVER]


def test_what_has_no_end_may_be_given_one_and_what_has_keeps_it() -> None:
    spans = Spans()
    spans.add(10, 20)
    spans.add(10, NEVER)
    spans.end(15)
    assert [spans.have(at) for at in (14, 19, 20)] == [True, True, False]
    assert [spans.next_change(at) for at in (10, 15)] == [15, 20]
