"""Instruments wrap a model's functions; a part behaves as it did in the whole."""

from collections.abc import Callable
from functools import partial

import pytest

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.functions import FUNCTIONS, Functions, Instrument, Laps, Wrapped
from firmware_runtime.devs.model_errors import CouplingError
from firmware_runtime.devs.part import part_of
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import NEVER
from tests.support.devs_models import Clock, Echo, Log, Scripted, top


class Robot(Coupled):
    """sensor -> controller -> motor and log; a reference comes from outside, a copy goes there."""

    def __init__(self) -> None:
        super().__init__("robot")
        self.reference = self.in_port("reference", int)
        self.seen = self.out_port("seen", int)
        self.sensor = self.add(Clock("sensor", 10))
        self.controller = self.add(Echo("controller"))
        self.motor = self.add(Log("motor"))
        self.log = self.add(Log("log"))
        self.couple(self.sensor.ticks, self.controller.inlet)
        self.couple(self.reference, self.controller.inlet)
        self.couple(self.controller.outlet, self.motor.values)
        self.couple(self.controller.outlet, self.log.values)
        self.couple(self.controller.outlet, self.seen)


def test_couplings_that_the_cut_crosses_end_at_ports_named_after_their_source() -> None:
    robot = Robot()
    part = part_of(robot, ["controller"])
    assert part.model.path == "robot"
    assert list(part.entering) == ["sensor.ticks"]
    assert list(part.leaving) == ["controller.out"]
    assert part.entering["sensor.ticks"].path == "robot.sensor:ticks"
    assert [*part.model.in_ports] == ["sensor:ticks", "reference"]
    assert [*part.model.out_ports] == ["controller:out", "seen"]
    assert robot.controller.path == "robot.controller"


def test_what_is_on_one_side_of_the_cut_stays_coupled() -> None:
    part = part_of(Robot(), ["sensor", "controller"])
    assert list(part.entering) == []
    assert list(part.leaving) == ["controller.out"]
    robot_end = part_of(Robot(), ["motor", "log"])
    assert list(robot_end.entering) == ["controller.out"]
    assert len(robot_end.model.couplings) == 2
    assert list(robot_end.model.in_ports) == ["controller:out"]
    assert list(robot_end.leaving) == []


def test_two_parts_joined_by_hand_do_what_the_whole_does() -> None:
    whole = Robot()
    Simulator(whole).run(50)
    first, second = Robot(), Robot()
    controller, robot_end = part_of(first, ["controller"]), part_of(second, ["sensor", "motor"])
    control, motion = Simulator(controller.model), Simulator(robot_end.model)
    sensed: list[int] = []
    sent: list[int] = []
    motion.listen(second.sensor.ticks, lambda _, value: sensed.append(value))
    control.listen(first.controller.outlet, lambda _, value: sent.append(value))
    for at in range(10, 60, 10):
        motion.advance(at)
        control.inject(controller.entering["sensor.ticks"], sensed.pop())
        control.advance(at)
        motion.inject(robot_end.entering["controller.out"], sent.pop())
        motion.advance(at)
    assert second.motor.bags == whole.motor.bags != []


def test_a_name_that_is_no_component_is_refused() -> None:
    with pytest.raises(CouplingError, match="no component wheel, tail; expected some of sensor"):
        part_of(Robot(), ["sensor", "wheel", "tail"])


def test_the_round_of_an_instant_is_known_to_a_listener() -> None:
    root = Coupled("root")
    clock, first, second = root.add(Clock("clock", 10)), root.add(Echo("a")), root.add(Echo("b"))
    inlet = root.in_port("in", int)
    root.couple(inlet, first.inlet)
    root.couple(clock.ticks, first.inlet)
    root.couple(first.outlet, second.inlet)
    simulator = Simulator(root)
    simulator.inject(inlet, 7)
    rounds: list[tuple[str, int]] = []
    simulator.listen(inlet, lambda _, __: rounds.append(("in", simulator.round)))
    simulator.listen(clock.ticks, lambda _, __: rounds.append(("clock", simulator.round)))
    simulator.listen(first.outlet, lambda _, __: rounds.append(("a", simulator.round)))
    simulator.listen(second.outlet, lambda _, __: rounds.append(("b", simulator.round)))
    simulator.run(20)
    simulator.inject(inlet, 8)
    simulator.advance(20)
    ticks, entries = ([(first, 0), ("a", 1), ("b", 2)] for first in ("clock", "in"))
    assert rounds == [*entries, *ticks, *ticks, *entries]


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


def meeting() -> Coupled:
    """A clock that reaches two models as their time runs out, again and again, and one other."""
    clock, own, plain = Clock("clock", 5), OwnConfluent("own", 5), Scripted("plain", 5)
    waiting = Scripted("waiting")
    root = top(clock, own, plain, waiting)
    for model in (own, plain, waiting):
        root.couple(clock.ticks, model.inlet)
    for again in (own, plain):
        again.on_internal = partial(again.hold_in, "again", 5)
    return root


MET = [
    "i clock.output",
    "i own.output",
    "i plain.output",
    "i clock.internal",
    "i own.confluent",
    "i plain.internal",
    "i plain.external",
    "i waiting.external",
]


def test_every_function_is_wrapped_and_a_default_confluent_is_the_two_it_stands_for() -> None:
    notes: list[str] = []
    Simulator(meeting(), instruments=[noting(notes, "i")]).run(5)
    assert notes == MET


def test_laps_have_every_function_that_returned_with_its_model_and_what_it_booked() -> None:
    laps = Laps(lambda: 7)
    Simulator(meeting(), laps=laps).run(5)
    numbers, functions, readings, sigmas = (laps.noted[each::4] for each in range(4))
    names = ["clock", "own", "plain", "waiting"]
    called = zip(numbers, functions, strict=True)
    assert [f"i {names[number]}.{FUNCTIONS[function]}" for number, function in called] == MET
    assert set(readings) == {7}
    assert sigmas == [0, 0, 0, 5, 5, 5, 5, NEVER]


def test_between_two_advances_an_instrument_may_come_and_go() -> None:
    notes: list[str] = []
    simulator = Simulator(meeting())
    simulator.run(5)
    with simulator.watched(noting(notes, "i")):
        simulator.run(10)
    simulator.run(15)
    assert notes == MET
    assert simulator.internal_transitions == 9


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
