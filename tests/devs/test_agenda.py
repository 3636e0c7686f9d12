from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from firmware_runtime.devs.agenda import Agenda
from firmware_runtime.devs.time import NEVER

MODELS = 5


class AgendaAgainstAPlainDictionary(RuleBasedStateMachine):
    """Bookings, rebookings and takings in any order, against the obvious implementation."""

    def __init__(self) -> None:
        super().__init__()
        self.agenda = Agenda(MODELS)
        self.agenda.most = MODELS + 2  # so that stale entries are dropped often
        self.due: dict[int, int] = {}
        self.now = 0

    @rule(model=st.integers(0, MODELS - 1), delay=st.integers(0, 6) | st.just(NEVER))
    def book(self, model: int, delay: int) -> None:
        self.agenda.book(model, self.now + delay)
        self.due.pop(model, None)
        if delay != NEVER:
            self.due[model] = self.now + delay

    @precondition(lambda self: self.due)
    @rule()
    def take_the_next(self) -> None:
        self.now = min(self.due.values())
        self.take(self.now)

    @rule(delay=st.integers(0, 3))
    def take_some_instant(self, delay: int) -> None:
        at = min([self.now + delay, *self.due.values()])
        self.now = at
        self.take(at)

    def take(self, at: int) -> None:
        expected = sorted(model for model, due in self.due.items() if due == at)
        assert self.agenda.take(at) == expected
        for model in expected:
            del self.due[model]

    @invariant()
    def agrees(self) -> None:
        assert self.agenda.next_at() == min(self.due.values(), default=NEVER)
        assert self.agenda.due_at == [self.due.get(model, NEVER) for model in range(MODELS)]


TestAgendaAgainstAPlainDictionary = AgendaAgainstAPlainDictionary.TestCase
TestAgendaAgainstAPlainDictionary.settings = settings(max_examples=30, stateful_step_count=25)


@given(st.lists(st.integers(0, 3), max_size=4))
def test_models_due_together_come_in_order_of_declaration(order: list[int]) -> None:
    agenda = Agenda(4)
    for model in order:
        agenda.book(model, 7)
    assert agenda.take(7) == sorted(set(order))


def test_never_is_never_and_a_timeout_that_is_always_rebooked_does_not_fill_the_memory() -> None:
    agenda = Agenda(1)
    agenda.book(0, NEVER + 5)
    assert agenda.next_at() == NEVER
    assert agenda.due_at == [NEVER]
    agenda = Agenda(2)
    agenda.book(1, 3)
    for at in range(10, 10_010):
        agenda.book(0, at)
    assert len(agenda.heap) < 100
    assert [agenda.take(3), agenda.take(10_009)] == [[1], [0]]
    assert agenda.next_at() == NEVER
