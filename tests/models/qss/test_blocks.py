"""The blocks around the integrators, each wired as any atomic model."""

import math
from collections.abc import Callable
from pathlib import Path

import pytest

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.ports import OutPort
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.models.qss import (
    Constant,
    Crossing,
    FromFile,
    Function,
    Gain,
    Hold,
    Hysteresis,
    Product,
    Pulse,
    Quantizer,
    Ramp,
    SampleHold,
    Samples,
    Segment,
    SegmentDelay,
    Simulation,
    Sine,
    Square,
    Step,
    Sum,
    Switch,
    System,
    VariableDelay,
    When,
)
from firmware_runtime.models.qss.sources import Schedule
from firmware_runtime.runs.model_alone import run
from firmware_runtime.view.diagram.draw import diagram
from tests.support.atomic_bench import AtomicBench


class Diagram:
    """Blocks in one model; `at` reads the wire of one of them."""

    def __init__(self) -> None:
        self.top = Coupled("top")
        self.sent: list[tuple[int, Segment]] = []

    def add(self, block: Atomic, **feeds: Atomic) -> Atomic:
        self.top.add(block)
        for port, source in feeds.items():
            name = port.removesuffix("_")
            self.top.couple(source.out_ports["out"], block.in_ports[name])
        return block

    def run(self, watched: Atomic, until: int = 5 * SECOND) -> Callable[[float], float]:
        simulator = Simulator(self.top, checked=True)
        port: OutPort[Segment] = watched.out_ports["out"]
        simulator.listen(port, lambda at, segment: self.sent.append((at, segment)))
        simulator.run(until)

        def at(seconds: float) -> float:
            since, segment = [each for each in self.sent if each[0] <= round(seconds * SECOND)][-1]
            return segment.at(seconds - since / SECOND)

        return at


def alone(source: Atomic, until: int = 5 * SECOND) -> Callable[[float], float]:
    diagram = Diagram()
    return diagram.run(diagram.add(source), until)


def test_sources_send_what_their_names_say() -> None:
    assert [alone(Constant("c", 2.5))(t) for t in (0.0, 3.0)] == [2.5, 2.5]
    assert [alone(Step("s", 1.0, before=-1.0))(t) for t in (0.0, 0.999, 1.0)] == [-1.0, -1.0, 1.0]
    ramp = alone(Ramp("r", 2.0, at_s=1.0, until_s=2.0, start=5.0))
    assert [ramp(t) for t in (0.5, 1.5, 4.0)] == [5.0, 6.0, 7.0]
    pulse = alone(Pulse("p", 1.0, 0.5))
    assert [pulse(t) for t in (0.0, 1.2, 1.5)] == [0.0, 1.0, 0.0]
    square = alone(Square("q", 2.0, duty=0.25, low=-1.0))
    assert [square(t) for t in (0.0, 0.4, 0.5, 1.9, 2.1)] == [1.0, 1.0, -1.0, -1.0, 1.0]
    assert [alone(Square("q", 1.0, duty=duty))(2.7) for duty in (0.0, 1.0)] == [0.0, 1.0]


@pytest.mark.slow
@pytest.mark.parametrize("order", [1, 2, 3])
def test_a_sine_is_never_further_off_than_its_tolerance(order: int) -> None:
    sine = Sine("s", 0.5, amplitude=2.0, phase_rad=0.3, offset=1.0, order=order, tolerance=1e-2)
    at, far = alone(sine), []
    for tick in range(500):
        exact = 1.0 + 2.0 * math.sin(math.pi * tick / 100 + 0.3)
        far.append(abs(at(tick / 100) - exact))
    assert 1e-3 < max(far) <= 1.05e-2


def test_a_file_is_followed_by_straight_lines_or_held(tmp_path: Path) -> None:
    path = tmp_path / "samples.csv"
    path.write_text("t,u\n0.5,1\n1.5,3\n2.5,0\n")
    lines, held = alone(FromFile("f", path)), alone(FromFile("f", path, holds=True))
    assert [lines(t) for t in (0.0, 1.0, 2.0, 4.0)] == [1.0, 2.0, 1.5, 0.0]
    assert [held(t) for t in (0.0, 1.0, 2.0, 4.0)] == [1.0, 1.0, 3.0, 0.0]
    path.write_text("0,1\n1,x\n")
    with pytest.raises(ModelError, match=r"line 2 is 1,x; expected seconds and a value|line 2"):
        FromFile("f", path)
    with pytest.raises(ModelError, match="each after the last"):
        Samples("s", [(1.0, 0.0), (1.0, 2.0)])


def test_gain_and_sum_are_exact_and_a_product_is_within_its_tolerance() -> None:
    diagram = Diagram()
    ramp = diagram.add(Ramp("ramp", 2.0, start=1.0))
    step = diagram.add(Step("step", 1.0, after=3.0))
    gain = diagram.add(Gain("gain", -2.0), in0=ramp)
    total = diagram.add(Sum("sum", [1.0, 0.5]), in0=gain, in1=step)
    assert [diagram.run(total)(t) for t in (0.5, 2.0)] == [-4.0, -8.5]
    other = Diagram()
    one, two = other.add(Ramp("one", 1.0)), other.add(Ramp("two", -2.0, start=1.0))
    product = other.run(other.add(Product("product", tolerance=1e-2), in0=one, in1=two))
    assert [product(t) for t in (0.7, 3.3)] == pytest.approx([-0.28, -18.48], abs=1e-2)
    assert not any(any(each[2:]) for _, each in other.sent), "straight lines, for QSS2"


@pytest.mark.parametrize(
    ("block", "named"),
    [
        (lambda: Gain("g", math.nan), "weight is nan"),
        (lambda: Sum("s", [1.0, math.inf]), "weight is inf"),
        (lambda: Gain("g", 10**400), "weight is 10+"),
        (lambda: Sum("s", ["1"]), "weight is '1'"),  # type: ignore[list-item]
        (lambda: Switch("s", math.nan), "threshold is nan"),
        (lambda: Sine("s", math.nan), "frequency_hz is nan"),
        (lambda: Sine("s", 1.0, amplitude=math.inf), "amplitude is inf"),
    ],
)
def test_a_number_that_is_not_finite_is_refused_by_its_name(
    block: Callable[[], Atomic], named: str
) -> None:
    with pytest.raises(ModelError, match=f"{named}; expected a finite number"):
        block()


@pytest.mark.parametrize(
    ("block", "says"),
    [
        (lambda: Function("f", "x", ["x"], order=5), "order is 5; expected 1, 2 or 3"),
        (lambda: Function("f", "x", ["x"], tolerance=0.0), "tolerance is 0.0; expected more than"),
        (lambda: Function("f", "x", ["x"], tolerance=math.inf), "tolerance is inf; expected"),
        (lambda: Sum("s", []), "0 inputs; expected 1 or more"),
        (lambda: Hysteresis("h", 1.0, 1.0), "lower is 1.0; expected less than upper, 1.0"),
        (lambda: Quantizer("q", 0.0), "step is 0.0; expected more than 0"),
        (lambda: Quantizer("q", math.inf), "step is inf; expected more than 0"),
        (lambda: VariableDelay("d", 0.0), "longest_s is 0.0; expected more than 0"),
        (lambda: VariableDelay("d", math.inf), "longest_s is inf; expected more than 0"),
        (lambda: SegmentDelay("d", -1), "a delay of -1; expected whole ns, 0 or more"),
        (lambda: Hold("h", 0), "a period of 0; expected whole ns, 1 or more"),
        (lambda: Square("q", 1e-9), "period_s is 1e-09; expected 4e-9 or more"),
        (lambda: Square("q", math.inf), "period_s is inf; expected"),
        (lambda: Square("q", 1.0, duty=1.5), "duty is 1.5; expected 0 to 1"),
        (lambda: Square("q", 1.0, duty=-0.5), "duty is -0.5; expected 0 to 1"),
        (lambda: Samples("s", []), "0 samples; expected 1 or more"),
        (lambda: Step("s", -1.0), "expected instants of 0 s or more"),
        (lambda: Step("s", math.inf), "expected instants of 0 s or more"),
    ],
)
def test_a_block_that_could_not_work_is_refused_with_what_is_expected(
    block: Callable[[], Atomic], says: str
) -> None:
    with pytest.raises(ModelError, match=says):
        block()


def test_a_hysteresis_changes_at_its_two_levels() -> None:
    diagram = Diagram()
    triangle = diagram.add(Samples("in", [(0.0, 0.0), (2.0, 2.0), (4.0, 0.0)]))
    relay = diagram.add(Hysteresis("relay", 0.5, 1.5, low=-1.0), in_=triangle)
    diagram.run(relay)
    assert [(at, each.value) for at, each in diagram.sent] == [
        (0, -1.0),
        (round(1.5 * SECOND), 1.0),
        (round(3.5 * SECOND), -1.0),
    ]


def test_a_hysteresis_changes_where_its_input_jumps_to_a_level_and_stays_there() -> None:
    diagram = Diagram()
    steps = diagram.add(Samples("in", [(0.0, 0.0), (1.0, 1.5), (2.0, 0.5)], holds=True))
    diagram.run(diagram.add(Hysteresis("relay", 0.5, 1.5), in_=steps))
    sent = [(at / SECOND, each.value) for at, each in diagram.sent]
    assert sent == [(0.0, 0.0), (1.0, 1.0), (2.0, 0.0)]


@pytest.mark.parametrize(("begins_at", "sent"), [(1.4, [-1.0]), (1.6, [-1.0, 1.0])])
def test_a_hysteresis_that_begins_above_its_upper_level_is_on_at_once(
    begins_at: float, sent: list[float]
) -> None:
    diagram = Diagram()
    constant = diagram.add(Constant("in", begins_at))
    diagram.run(diagram.add(Hysteresis("relay", 0.5, 1.5, low=-1.0), in_=constant))
    assert [(at, each.value) for at, each in diagram.sent] == [(0, each) for each in sent]


def test_a_switch_passes_one_wire_or_the_other() -> None:
    diagram = Diagram()
    control = diagram.add(Ramp("control", 1.0, start=-1.0))
    above, below = diagram.add(Ramp("above", 10.0)), diagram.add(Step("below", 0.5, after=7.0))
    switch = diagram.add(Switch("switch"), in_=control, above=above, below=below)
    at = diagram.run(switch)
    assert [at(t) for t in (0.2, 0.7, 1.0, 2.0)] == pytest.approx([0.0, 7.0, 10.0, 20.0])
    for side in (1.0, -1.0):
        diagram = Diagram()
        control = diagram.add(Constant("control", side))
        assert diagram.run(diagram.add(Switch("switch"), in_=control))(1.0) == 0.0, "of no wire"


def test_a_quantizer_sends_each_step_at_its_edge() -> None:
    diagram = Diagram()
    triangle = diagram.add(Samples("in", [(0.0, 0.0), (1.0, 1.0), (3.0, -1.0)]))
    quantizer = diagram.add(Quantizer("quantizer", 0.25), in_=triangle)
    at = diagram.run(quantizer)
    levels = [(t, math.floor((t if t < 1 else 2 - t) * 4) / 4) for t in (0.1, 0.3, 0.9, 1.4, 2.6)]
    assert [(t, at(t)) for t, _ in levels] == levels
    steps = [round(each.value / 0.25) for _, each in diagram.sent]
    assert steps == [0, 1, 2, 3, 2, 1, 0, -1, -2, -3, -4]
    falls = [1_250_000_250 + number * SECOND // 4 for number in range(7)]
    assert [at for at, _ in diagram.sent] == [0, *(n * SECOND // 4 for n in (1, 2, 3)), *falls]


def test_a_quantizer_to_the_nearest_step_changes_half_way() -> None:
    diagram = Diagram()
    ramp = diagram.add(Ramp("in", 1.0))
    diagram.run(diagram.add(Quantizer("quantizer", 0.5, nearest=True), in_=ramp), SECOND)
    sent = [(at / SECOND, each.value) for at, each in diagram.sent]
    assert sent == [(0.0, 0.0), (0.25, 0.5), (0.75, 1.0)]


def test_a_quantizer_starts_below_its_input_and_takes_one_that_turns_at_an_edge() -> None:
    diagram = Diagram()
    bent = diagram.add(Samples("in", [(0.0, 0.75), (0.25, 1.0), (0.75, 3.0), (0.875, 3.5)]))
    diagram.run(diagram.add(Quantizer("quantizer", 1.0), in_=bent))
    sent = [(at / SECOND, each.value) for at, each in diagram.sent]
    assert sent == [(0.0, 0.0), (0.25, 1.0), (0.5, 2.0), (0.75, 3.0)]


@pytest.mark.parametrize(
    ("begins_at", "slope", "step", "sent"),
    [
        (0.75, 0.0, 0.25, [(0.0, 0.75)]),
        (0.7, 0.5, 0.1, [(0.0, 0.7), (0.2, 0.8), (0.4, 0.9)]),
        (0.7, -0.5, 0.1, [(0.0, 0.6), (0.2, 0.5), (0.4, 0.4)]),
    ],
)
def test_a_quantizer_that_begins_at_an_edge_is_on_the_side_to_which_its_input_goes(
    begins_at: float, slope: float, step: float, sent: list[tuple[float, float]]
) -> None:
    diagram = Diagram()
    ramp = diagram.add(Ramp("ramp", slope, start=begins_at))
    diagram.run(diagram.add(Quantizer("quantizer", step), in_=ramp), SECOND // 2)
    found = [(at / SECOND, each.value) for at, each in diagram.sent]
    assert found == [pytest.approx(each, abs=1e-6) for each in sent]


def test_a_quantizer_sends_nothing_before_its_input_has_come() -> None:
    bench = AtomicBench(quantizer := Quantizer("quantizer", 1.0))
    bench.run(1000)
    assert bench.values("out") == []
    bench.simulator.inject(quantizer.entrance, Segment(2.5))
    bench.run(2000)
    assert bench.values("out") == [Segment(2.0)]


def test_a_hold_samples_at_its_period_and_a_sample_hold_at_its_trigger() -> None:
    diagram = Diagram()
    ramp = diagram.add(Ramp("ramp", 1.0))
    hold = diagram.run(diagram.add(Hold("hold", 300 * MILLISECOND), in_=ramp))
    assert [hold(t) for t in (0.0, 0.29, 0.3, 1.0)] == pytest.approx([0.0, 0.0, 0.3, 0.9])
    other = Diagram()
    ramp = other.add(Ramp("ramp", 1.0))
    crossing = other.top.add(Crossing("crossing", "x - 2", ["x"]))
    other.top.couple(ramp.out_ports["out"], crossing.inputs["x"])
    sample = other.top.add(SampleHold("sample", -1.0))
    other.top.couple(ramp.out_ports["out"], sample.entrance)
    other.top.couple(crossing.event, sample.trigger)
    at = other.run(sample)
    assert [at(t) for t in (1.9, 2.5)] == pytest.approx([-1.0, 2.0])


def test_an_input_between_two_samples_of_a_hold_does_not_put_the_next_one_off() -> None:
    diagram = Diagram()
    triangle = diagram.add(Samples("in", [(0.0, 0.0), (1.0, 1.0), (2.0, 0.0)]))
    diagram.run(diagram.add(Hold("hold", 300 * MILLISECOND), in_=triangle), 2 * SECOND)
    assert [at for at, _ in diagram.sent] == [n * 300 * MILLISECOND for n in range(7)]
    values = [each.value for _, each in diagram.sent]
    assert values == pytest.approx([0.0, 0.3, 0.6, 0.9, 0.8, 0.5, 0.2])


def test_delays_give_what_was_then() -> None:
    diagram = Diagram()
    triangle = diagram.add(Samples("in", [(0.0, 0.0), (1.0, 1.0), (2.0, 0.0)]))
    at = diagram.run(diagram.add(SegmentDelay("late", 500 * MILLISECOND, -3.0), in_=triangle))
    assert [at(t) for t in (0.4, 1.0, 2.0, 4.0)] == pytest.approx([-3.0, 0.5, 0.5, 0.0])


def test_a_delay_sends_zero_until_something_has_come_through_unless_told_otherwise() -> None:
    for delay in (SegmentDelay("late", SECOND), VariableDelay("late", 2.0)):
        diagram = Diagram()
        diagram.add(delay, in_=diagram.add(Constant("in", 3.0)))
        if isinstance(delay, VariableDelay):
            diagram.top.couple(diagram.add(Constant("delay", 1.0)).out_ports["out"], delay.delay)
        at = diagram.run(delay)
        assert [at(t) for t in (0.0, 0.9, 1.1)] == [0.0, 0.0, 3.0]


def test_a_variable_delay_looks_back_as_far_as_the_signal_says() -> None:
    diagram = Diagram()
    triangle = diagram.add(Samples("in", [(0.0, 0.0), (1.0, 1.0), (2.0, 0.0)]))
    growing = diagram.add(Ramp("delay", 0.5, start=0.1))
    late = diagram.add(VariableDelay("late", 5.0, initial=-3.0), in_=triangle, delay=growing)
    at = diagram.run(late)

    def exact(t: float) -> float:
        seen = t - 0.1 - 0.5 * t
        return -3.0 if seen < 0 else max(0.0, seen if seen < 1 else 2.0 - seen)

    for t in (0.1, 0.19, 0.21, 1.0, 2.1, 2.3, 4.1, 4.3):
        assert at(t) == pytest.approx(exact(t), abs=1e-8)


def test_a_variable_delay_sends_where_its_input_turns_and_where_that_is_seen_alone() -> None:
    diagram = Diagram()
    triangle = diagram.add(Samples("in", [(0.0, 0.0), (1.0, 1.0), (2.0, 0.0)]))
    delay = diagram.add(Constant("delay", 0.5))
    diagram.run(diagram.add(VariableDelay("late", 5.0), in_=triangle, delay=delay))
    assert [at / SECOND for at, _ in diagram.sent] == [0.0, 0.5, 1.0, 1.5, 2.0, 2.5]


def test_a_delay_that_grows_faster_than_time_looks_back_over_what_has_been() -> None:
    diagram = Diagram()
    triangle = diagram.add(Samples("in", [(0.0, 0.0), (1.0, 1.0), (2.0, 0.0)]))
    growing = diagram.add(Ramp("delay", 2.0, at_s=1.5, until_s=3.0, start=0.1))
    late = diagram.add(VariableDelay("late", 5.0, initial=-3.0), in_=triangle, delay=growing)
    at = diagram.run(late)
    for t, seen in ((1.4, 1.3), (1.8, 1.1), (2.0, 0.9), (2.8, 0.1), (3.3, 0.2), (4.3, 1.2)):
        assert at(t) == pytest.approx(min(seen, 2.0 - seen), abs=1e-8)
    assert at(2.95) == -3.0


def test_a_delay_that_bends_up_looks_back_over_what_has_been() -> None:
    diagram = Diagram()
    bent = diagram.add(Samples("in", [(0.0, 0.0), (0.25, 1.0), (9.0, 1.0)]))
    parabola = diagram.add(Schedule("delay", [(0.0, Segment(0.1, 0.0, 0.5))]))
    late = diagram.add(VariableDelay("late", 5.0, order=3), in_=bent, delay=parabola)
    at = diagram.run(late, 2 * SECOND)
    for t in (0.3, 0.5, 1.5, 1.6, 1.8):
        assert at(t) == pytest.approx(min(4.0 * (t - 0.1 - 0.5 * t * t), 1.0), abs=1e-8)


def test_a_variable_delay_keeps_all_that_its_longest_delay_reaches() -> None:
    late, sent = VariableDelay("late", 0.002), dict[int, float]()
    simulator = Simulator(late)
    simulator.listen(late.out, lambda at, segment: sent.update({at: segment.value}))
    simulator.inject(late.delay, Segment(0.002))
    for ms in range(300):
        simulator.inject(late.entrance, Segment(float(ms)))
        simulator.advance(ms * MILLISECOND)
        simulator.run(ms * MILLISECOND)
    assert [sent[ms * MILLISECOND] for ms in range(2, 300)] == list(map(float, range(298)))


def test_of_two_values_of_one_instant_a_variable_delay_keeps_the_last() -> None:
    bench = AtomicBench(VariableDelay("late", 1.0))
    bench.put(0, delay=Segment(0.01))
    for value in (1.0, 2.0):
        bench.put(5, **{"in": Segment(value)})
    bench.run(20)
    assert [(at, segment.value) for at, segment in bench.said["out"]][-1] == (15.0, 2.0)


def delayed_by(delay: Atomic) -> Callable[[float], float]:
    """A ramp of slope 1 from 0, delayed by a signal; 2 s at most, and -3 before the start."""
    diagram = Diagram()
    ramp = diagram.add(Ramp("ramp", 1.0))
    late = diagram.add(VariableDelay("late", 2.0, initial=-3.0), in_=ramp, delay=diagram.add(delay))
    return diagram.run(late, 3 * SECOND)


def test_a_delay_counts_as_none_exactly_while_it_is_below_zero() -> None:
    rising, falling = delayed_by(Ramp("d", 0.5, start=-0.5)), delayed_by(Ramp("d", -0.5, start=0.5))
    for t in (0.5, 0.99, 1.5, 2.5):
        assert rising(t) == pytest.approx(t - max(0.5 * t - 0.5, 0.0), abs=1e-8)
    for t in (0.5, 0.99, 1.5, 2.5):
        assert falling(t) == pytest.approx(t - max(0.5 - 0.5 * t, 0.0), abs=1e-8)


def test_a_delay_that_grows_beyond_the_longest_is_an_error_when_it_does() -> None:
    with pytest.raises(ModelError, match=r"a delay of 2 s; expected 2 s at most"):
        delayed_by(Ramp("d", 1.0))


@pytest.mark.parametrize("order", [1, 2, 3])
def test_a_function_sends_as_many_coefficients_as_its_order_within_its_tolerance(
    order: int,
) -> None:
    diagram = Diagram()
    power = diagram.add(Function("power", "t * t * t * t", order=order, tolerance=0.1))
    at = diagram.run(power, 2 * SECOND)
    assert [at(t) for t in (0.5, 1.0, 1.9)] == pytest.approx([0.0625, 1.0, 13.0321], abs=0.1)
    assert not any(any(each[order:]) for _, each in diagram.sent)


@pytest.mark.parametrize("divisor", ["x - 1/3", "t - 1/3"])
def test_a_function_whose_divisor_passes_zero_ends_there(divisor: str) -> None:
    diagram = Diagram()
    ramp = diagram.add(Ramp("ramp", 1.0))
    function = Function("function", f"1 / ({divisor}) + 0 * x", ["x"], tolerance=1e6)
    with pytest.raises(ModelError, match=r"has no value at 0\.333333334 s.*goes through 0"):
        diagram.run(diagram.add(function, x=ramp))


def test_a_function_of_what_stands_still_is_not_evaluated_again() -> None:
    function = Function("function", "sin(x)", ["x"])
    simulator = Simulator(function)
    simulator.inject(function.inputs["x"], Segment(1.0))
    simulator.run(SECOND)
    assert simulator.next_at == NEVER


def test_a_function_waits_until_each_input_has_a_value() -> None:
    diagram = Diagram()
    late = diagram.add(Function("late", "1 / x", ["x"]))
    diagram.run(late)
    assert diagram.sent == []


@pytest.mark.real_time
def test_the_blocks_run_in_real_time_and_give_the_values_of_virtual_time() -> None:
    system = System({"x": 1.0, "v": 0.0}, {"x": "v", "v": "-40 * x"}, quantum=1e-2)
    simulation = Simulation(system)
    simulation.advance(SECOND // 2)
    live = Simulation(system).model
    run(live, for_s=0.5)
    assert live.steps == simulation.model.steps


def test_a_system_is_drawn_with_its_sources_and_what_it_sends() -> None:
    system = System(
        {"x": 1.0, "v": 0.0},
        {"x": "v", "v": "u - 0.1 * v * abs(v)"},
        inputs={"u": Square("u", 0.4)},
        events=[When("x crosses 0 falling", v="-0.8 * v")],
    )
    picture = diagram(Simulation(system).model)
    for name in ("x", "v", "u", "engine"):
        assert f">{name}<" in picture
    assert "system.u.out → system.engine.u" in picture
