"""Instruments wrap a model's functions, in the order given, and cost others nothing."""

from collections.abc import Callable

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.functions import Functions, Instrument, Wrapped
from firmware_runtime.devs.simulator import Simulator
from tests.support.devs_models import Clock, Scripted, top


def noting(notes: list[str], name: str) -> Instrument:
    """Notes every call of every function of every model."""

    def wrap(path: str, function: Callable[..., None]) -> Callable[..., None]:
        def call(*arguments: int) -> None:
            notes.append(f"{name} {path}")
            function(*arguments)

        return call

    def instrument(atomic: Atomic, functions: Functions) -> Functions:
        confluent = functions.confluent
        return Wrapped(
            atomic,
            wrap(f"{atomic.name}.output", functions.output),
            wrap(f"{atomic.name}.internal", functions.internal),
            wrap(f"{atomic.name}.external", functions.external),
            None if confluent is None else wrap(f"{atomic.name}.confluent", confluent),
        )

    return instrument


class OwnConfluent(Scripted):
    """Ignores input that comes as its time runs out."""

    def confluent(self) -> None:
        self.internal()


def test_every_function_is_wrapped_and_a_default_confluent_is_the_two_it_stands_for() -> None:
    notes: list[str] = []
    clock, own, plain = Clock("clock", 5), OwnConfluent("own", 5), Scripted("plain", 5)
    waiting = Scripted("waiting")
    root = top(clock, own, plain, waiting)
    for model in (own, plain, waiting):
        root.couple(clock.ticks, model.inlet)
    Simulator(root, instruments=[noting(notes, "i")]).run(5)
    assert notes == [
        "i clock.output",
        "i own.output",
        "i plain.output",
        "i clock.internal",
        "i own.confluent",
        "i plain.internal",
        "i plain.external",
        "i waiting.external",
    ]


def test_the_first_instrument_is_the_innermost() -> None:
    notes: list[str] = []
    instruments = [noting(notes, "inner"), noting(notes, "outer")]
    Simulator(Clock("clock", 5), instruments=instruments).run(5)
    assert notes == [
        "outer clock.output",
        "inner clock.output",
        "outer clock.internal",
        "inner clock.internal",
    ]


def test_an_instrument_may_leave_a_model_alone_or_change_one_function() -> None:
    sent: list[str] = []

    def only_a(atomic: Atomic, functions: Functions) -> Functions:
        if atomic.name != "a":
            return functions
        rest = functions.internal, functions.external, functions.confluent
        return Wrapped(atomic, lambda: sent.append("a"), *rest)

    a, b = Clock("a", 5), Clock("b", 5)
    simulator = Simulator(top(a, b), instruments=[only_a])
    for clock in (a, b):
        simulator.listen(clock.ticks, lambda _at, value: sent.append(f"value {value}"))
    simulator.run(5)
    assert sent == ["a", "value 0"]
    assert (a.count, b.count) == (1, 1)
