"""Ports and couplings: what is refused, by the type checker too, and where wires lead."""

from collections.abc import Callable
from typing import Any

import pytest

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.model_errors import CouplingError, ModelError
from firmware_runtime.devs.ports import InPort, OutPort
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.wiring import Wiring
from firmware_runtime.runs.model_alone import run
from tests.support.devs_models import Clock, Echo, Log, top


class Base:
    pass


class Derived(Base):
    pass


class Model(Atomic):
    """Two typed ports of each kind."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.base_in = self.in_port("base_in", Base)
        self.derived_in = self.in_port("derived_in", Derived)
        self.base_out = self.out_port("base_out", Base)
        self.derived_out = self.out_port("derived_out", Derived)


def test_a_path_joins_the_names_from_the_root() -> None:
    root, inner = Coupled("robot"), Coupled("controller")
    root.add(inner)
    model = inner.add(Model("yaw"))
    assert model.path == "robot.controller.yaw"
    assert model.base_in.path == "robot.controller.yaw.base_in"
    assert repr(model.base_out) == "<OutPort robot.controller.yaw.base_out>"
    assert repr(model.base_in) == "<InPort robot.controller.yaw.base_in []>"


@pytest.mark.parametrize("name", ["", "a.b", "caf\udce9", 3, None])
@pytest.mark.parametrize(
    "declare",
    [
        Atomic,
        Coupled,
        lambda name: Atomic("model").in_port(name, int),
        lambda name: Atomic("model").out_port(name, int),
    ],
)
def test_a_name_that_would_spoil_a_path_is_refused(
    declare: Callable[[str], object], name: str
) -> None:
    with pytest.raises(CouplingError, match="a name is a text, not empty, and holds no dot"):
        declare(name)


class Skipping(Atomic):
    def __init__(self) -> None:
        self.speed = 0


class Hasty(Atomic):
    def __init__(self, name: str) -> None:
        self.out = self.out_port("out", int)
        super().__init__(name)


class Rash(Atomic):
    def __init__(self, name: str) -> None:
        self.inlet = self.in_port("in", int)
        super().__init__(name)


class Hollow(Coupled):
    def __init__(self) -> None:
        self.part = self.add(Atomic("part"))


class Wired(Coupled):
    def __init__(self) -> None:
        model = Model("model")
        self.couple(model.base_out, model.base_in)


@pytest.mark.parametrize(
    "declare",
    [
        lambda: Simulator(Skipping()),
        lambda: Coupled("root").add(Skipping()),
        lambda: run(Skipping(), for_s=1.0, clock="virtual"),
        lambda: Hasty("hasty"),
        lambda: Rash("rash"),
        Hollow,
        Wired,
    ],
)
def test_a_model_whose_init_skips_that_of_its_base_is_named(declare: Callable[[], object]) -> None:
    with pytest.raises(
        CouplingError, match=r"^(Skipping|Hasty|Rash|Hollow|Wired): .* super\(\)\.__init__"
    ):
        declare()


def test_ports_differ_by_identity_though_their_bags_are_equal() -> None:
    model = Model("model")
    assert model.base_in != model.derived_in
    assert list(model.base_in) == list(model.derived_in)
    assert len({model.base_in, model.derived_in}) == 2


def of_itself(*, inner: bool) -> None:
    outer, middle = Coupled("outer"), Coupled("middle")
    outer.add(middle)
    (middle if inner else outer).add(outer)


@pytest.mark.parametrize(
    ("declare", "sentence"),
    [
        (lambda model: model.in_port("base_in", Base), "^model: port 'base_in' is declared twice$"),
        (lambda model: model.out_port("base_out", Base), "^model: port 'base_out' is declared twi"),
        (
            lambda model: model.in_port("in", tuple[int, int]),
            r"a port's type is a class, not tuple\[int, int\]",
        ),
        (lambda _: Coupled("root").add(Atomic), "Atomic"),  # type: ignore[type-var]
        (
            lambda model: (Coupled("first").add(model), Coupled("second").add(model)),
            r"^first\.model is already part of first$",
        ),
        (
            lambda _: top(Model("model"), Model("model")),
            "^top: component 'model' is declared twice",
        ),
        (lambda _: of_itself(inner=True), "'outer' cannot be part of itself"),
        (lambda _: of_itself(inner=False), "'outer' cannot be part of itself"),
        (lambda _: Simulator(top(Component("odd"))), r"^top\.odd: .* Atomic or a Coupled"),  # type: ignore[arg-type]
    ],
)
def test_a_wrong_declaration_is_refused(declare: Callable[[Model], object], sentence: str) -> None:
    with pytest.raises(CouplingError, match=sentence):
        declare(Model("model"))


class Pair:
    """Two models in a coupled one with ports of its own, and a stranger."""

    def __init__(self) -> None:
        self.a, self.b = Model("a"), Model("b")
        self.top = top(self.a, self.b)
        self.inlet = self.top.in_port("inlet", Base)
        self.outlet = self.top.out_port("outlet", Base)
        self.stranger = Model("stranger")


@pytest.mark.parametrize(
    ("ends", "reason"),
    [
        (lambda p: (p.a.base_out, p.b.derived_in), "a port of Base cannot feed a port of Derived"),
        (lambda p: (p.a.base_out, p.a.base_in), "cannot be coupled to the model itself"),
        (lambda p: (p.stranger.base_out, p.b.base_in), "source is neither an input of top nor"),
        (lambda p: (p.a.base_in, p.b.base_in), "source is neither an input of top nor"),
        (lambda p: (p.outlet, p.b.base_in), "source is neither an input of top nor"),
        (lambda p: (p.a.base_out, p.stranger.base_in), "end is neither an output of top nor"),
        (lambda p: (p.a.base_out, p.b.base_out), "end is neither an output of top nor"),
        (lambda p: (p.a.base_out, p.inlet), "end is neither an output of top nor"),
        (lambda p: (p.a.base_out, "base_in"), "joins two ports; 'base_in' is none"),
        (lambda p: (p.a, p.b.base_in), "joins two ports"),
    ],
)
def test_a_wrong_coupling_is_refused_with_both_paths(
    ends: Callable[[Pair], tuple[Any, Any]], reason: str
) -> None:
    pair = Pair()
    source, destination = ends(pair)
    with pytest.raises(CouplingError, match=reason) as refusal:
        pair.top.couple(source, destination)
    if isinstance(source, InPort | OutPort) and isinstance(destination, InPort | OutPort):
        assert str(refusal.value).startswith(f"{source.path} -> {destination.path}: ")
    assert not pair.top.couplings


def test_what_is_narrower_or_whole_feeds_what_is_wider_by_a_wire_drawn_once() -> None:
    pair = Pair()
    pair.top.couple(pair.a.derived_out, pair.b.base_in)
    assert list(pair.top.couplings) == [(pair.a.derived_out, pair.b.base_in)]
    with pytest.raises(CouplingError, match=r"^top\.a\.derived_out -> top\.b\.base_in: coupled tw"):
        pair.top.couple(pair.a.derived_out, pair.b.base_in)
    model = top(Atomic("source"), Atomic("end"))
    source, end = model.components.values()
    whole_out, float_out = source.out_port("whole", int), source.out_port("real", float)
    whole_in, float_in = end.in_port("whole", int), end.in_port("real", float)
    model.couple(whole_out, float_in)
    with pytest.raises(CouplingError, match="a port of float cannot feed a port of int"):
        model.couple(float_out, whole_in)  # type: ignore[misc]


def test_couplings_keep_the_order_in_which_they_were_drawn() -> None:
    pair = Pair()
    pair.top.couple(pair.b.base_out, pair.outlet)
    pair.top.couple(pair.inlet, pair.a.base_in)
    pair.top.couple(pair.a.base_out, pair.b.base_in)
    assert [source.path for source, _ in pair.top.couplings] == [
        "top.b.base_out",
        "top.inlet",
        "top.a.base_out",
    ]


def test_a_wire_is_followed_down_across_and_up() -> None:
    sender, receiver = Coupled("sender"), Coupled("receiver")
    clock, log, other = sender.add(Clock("clock", 1)), receiver.add(Log("log")), Log("other")
    model = top(sender, receiver, other)
    out, into = sender.out_port("out", int), receiver.in_port("in", int)
    sender.couple(clock.ticks, out)
    model.couple(out, into)
    model.couple(out, other.values)
    receiver.couple(into, log.values)
    wiring = Wiring(model)
    assert wiring.atomics == [clock, log, other]
    assert wiring.ends(clock.ticks) == [log.values, other.values]


def through(name: str) -> Coupled:
    """A coupled model with one input port and one output port, and a wire between them."""
    model = Coupled(name)
    model.couple(model.in_port("in", int), model.out_port("out", int))
    return model


def test_a_wire_may_lead_straight_through_a_coupled_model() -> None:
    clock, log = Clock("clock", 1), Log("log")
    first, second = through("first"), through("second")
    model = top(clock, first, second, log)
    model.couple(clock.ticks, first.in_ports["in"])
    model.couple(first.out_ports["out"], second.in_ports["in"])
    model.couple(second.out_ports["out"], log.values)
    assert Wiring(model).ends(clock.ticks) == [log.values]
    Simulator(model).run(2)
    assert log.bags == [[0], [1]]


def test_wires_that_lead_round_through_no_atomic_model_are_refused() -> None:
    first, second = through("first"), through("second")
    model = top(Clock("clock", 1), first, second)
    model.couple(first.out_ports["out"], second.in_ports["in"])
    model.couple(second.out_ports["out"], first.in_ports["in"])
    with pytest.raises(CouplingError, match=r"^top\.first\.in: its wires lead back to it"):
        Simulator(model)


def test_a_part_of_a_model_can_be_flattened_by_itself() -> None:
    inner = Coupled("inner")
    echo, log = inner.add(Echo("echo")), Log("log")
    inlet, outlet = inner.in_port("in", int), inner.out_port("out", int)
    inner.couple(inlet, echo.inlet)
    inner.couple(echo.outlet, outlet)
    model = top(inner, log)
    model.couple(outlet, log.values)
    assert Wiring(inner).ends(echo.outlet) == []
    assert Wiring(model).ends(echo.outlet) == [log.values]
    assert Wiring(inner).ends(inlet) == [echo.inlet]


class Text(str):
    __slots__ = ()


class Typed(Atomic):
    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.number_in = self.in_port("number_in", int)
        self.number_out = self.out_port("number_out", int)
        self.string_in = self.in_port("string_in", str)
        self.string_out = self.out_port("string_out", str)
        self.text_in = self.in_port("text_in", Text)
        self.text_out = self.out_port("text_out", Text)

    def right_output(self) -> None:
        self.number_out.send(1)

    def wrong_output(self) -> None:
        self.number_out.send("1")  # type: ignore[arg-type]


class Whole(Coupled):
    def __init__(self) -> None:
        super().__init__("whole")
        self.number = self.in_port("number", int)
        self.text = self.out_port("text", Text)
        self.a = self.add(Typed("a"))
        self.b = self.add(Typed("b"))


def test_right_couplings_are_taken() -> None:
    whole = Whole()
    a, b = whole.a, whole.b
    whole.couple(a.number_out, b.number_in)
    whole.couple(a.text_out, b.string_in)
    whole.couple(whole.number, a.number_in)
    whole.couple(b.text_out, whole.text)


def test_wrong_couplings_are_refused_when_they_run_too() -> None:
    whole = Whole()
    a, b = whole.a, whole.b
    with pytest.raises(ModelError):
        whole.couple(a.number_out, b.string_in)  # type: ignore[misc]
    with pytest.raises(ModelError):
        whole.couple(a.string_out, b.text_in)  # type: ignore[misc]
    with pytest.raises(ModelError):
        whole.couple(whole.number, a.string_in)  # type: ignore[misc]
    with pytest.raises(ModelError):
        whole.couple(a.number_out, whole.text)  # type: ignore[misc]
    with pytest.raises(ModelError):
        whole.couple(a.number_out, "number_in")  # type: ignore[arg-type]
