from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.trace import trace
from tests.support.devs_models import Clock, Echo, Log, top, traced


def test_a_trace_has_every_message_with_instant_and_path_below_the_root() -> None:
    controller = Coupled("controller")
    yaw, clock = controller.add(Echo("yaw", delay=1)), Clock("imu", 5)
    inlet = controller.in_port("in", int)
    controller.couple(inlet, yaw.inlet)
    model = top(clock, controller)
    model.couple(clock.ticks, inlet)
    assert traced(Simulator(model), 10) == [
        (5, "imu.ticks", 0),
        (6, "controller.yaw.out", 0),
        (10, "imu.ticks", 1),
    ]


def test_only_the_ports_named_are_traced_in_the_order_of_their_messages() -> None:
    inner = Coupled("inner")
    clock, other = inner.add(Clock("clock", 5)), inner.add(Clock("other", 5))
    outlet = inner.out_port("out", int)
    inner.couple(clock.ticks, outlet)
    simulator = Simulator(top(inner))
    messages: list[tuple[int, str, object]] = []
    trace(simulator, lambda *message: messages.append(message), [other.ticks, outlet])
    simulator.run(5)
    assert messages == [(5, "inner.out", 0), (5, "inner.other.ticks", 0)]


def test_a_port_without_couplings_is_traced_too() -> None:
    assert traced(Simulator(Clock("clock", 5)), 5) == [(5, "ticks", 0)]


def test_an_untraced_run_has_nothing_between_sender_and_bag() -> None:
    clock, log = Clock("clock", 5), Log("log")
    model = top(clock, log)
    model.couple(clock.ticks, log.values)
    simulator = Simulator(model, checked=False)
    assert clock.ticks._only is log.values
    trace(simulator, lambda _at, _path, _value: None)
    assert clock.ticks._only is None
