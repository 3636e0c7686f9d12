"""A loop of blocks in which nothing takes time has no solution by events: it is refused by name."""

from collections.abc import Callable

import pytest

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.models.qss import (
    QSS2,
    Constant,
    Crossing,
    Function,
    Gain,
    Hold,
    Hysteresis,
    Quantizer,
    SampleHold,
    Segment,
    SegmentDelay,
    Sum,
    Switch,
)

AT_ONCE: list[Callable[[], Atomic]] = [
    lambda: Gain("block", 0.5),
    lambda: Function("block", "sin(x)", ["x"]),
    lambda: Function("block", "sin(x)", {"x": 0.0}),
    lambda: Hysteresis("block", -1.0, 1.0),
    lambda: Quantizer("block", 0.1),
    lambda: Switch("block"),
    lambda: Crossing("block", "x - 1", ["x"]),
    lambda: Hold("block", MILLISECOND),
    lambda: SegmentDelay("block", 0),
]


def fed_back(block: Atomic, *, inside: bool = False) -> Coupled:
    """A sum of a constant and of what the block makes of the sum."""
    top = Coupled("top")
    total = top.add(Sum("sum", [1.0, -1.0]))
    one = top.add(Constant("one", 1.0))
    top.couple(one.out, total.inputs[0])
    entrance, out = next(iter(block.in_ports.values())), block.out_ports["out"]
    if inside:
        inner = top.add(Coupled("inner"))
        inner.add(block)
        inner.couple(inner.in_port("in", Segment), entrance)
        inner.couple(out, inner.out_port("out", Segment))
        entrance, out = inner.in_ports["in"], inner.out_ports["out"]
    else:
        top.add(block)
    top.couple(total.out, entrance)
    top.couple(out, total.inputs[1])
    return top


@pytest.mark.parametrize("make", AT_ONCE)
@pytest.mark.parametrize("inside", [False, True])
def test_a_loop_without_a_delay_is_refused_by_the_names_in_it(
    make: Callable[[], Atomic], *, inside: bool
) -> None:
    block = "top.inner.block" if inside else "top.block"
    with pytest.raises(ModelError, match=rf"(top\.sum|{block}) -> .* an algebraic loop; expected"):
        Simulator(fed_back(make(), inside=inside)).run(SECOND)


def test_a_block_that_feeds_itself_through_others_is_refused_but_not_those_behind_it() -> None:
    top = Coupled("top")
    first, second, behind = (top.add(Gain(name, 0.5)) for name in ("a", "b", "c"))
    top.couple(first.out, second.inputs[0])
    top.couple(second.out, first.inputs[0])
    top.couple(second.out, behind.inputs[0])
    with pytest.raises(ModelError, match=r"^top\.a -> top\.b -> top\.a: an algebraic loop"):
        Simulator(top)


def test_a_block_before_a_loop_is_not_blamed_for_it() -> None:
    top = Coupled("top")
    before, total, back = top.add(Gain("a", 0.5)), top.add(Sum("b", [1.0, 1.0])), Gain("c", 0.5)
    top.couple(before.out, total.inputs[0])
    top.couple(top.add(back).out, total.inputs[1])
    top.couple(total.out, back.inputs[0])
    with pytest.raises(ModelError, match=r"^top\.b -> top\.c -> top\.b: an algebraic loop"):
        Simulator(top)


@pytest.mark.parametrize(
    "make",
    [
        lambda: SegmentDelay("block", MILLISECOND),
        lambda: SampleHold("block"),
    ],
)
def test_a_loop_with_a_delay_or_a_held_value_in_it_runs(make: Callable[[], Atomic]) -> None:
    Simulator(fed_back(make())).run(SECOND)


def test_a_loop_through_an_integrator_is_solved() -> None:
    top = Coupled("top")
    x, f = top.add(QSS2("x", 1.0, 1e-4)), top.add(Gain("f", -1.0))
    top.couple(x.out, f.inputs[0])
    top.couple(f.out, x.derivative)
    Simulator(top).run(SECOND)
    assert x.value_at(SECOND) == pytest.approx(0.367879, abs=1e-3)
