"""A port that is recorded notes each value after its number, and sends as it did."""

from firmware_runtime.devs.ports import Sent
from firmware_runtime.devs.simulator import Simulator
from tests.support.periodic_models import PERIOD, Robot


def tapped() -> tuple[Robot, Simulator, Sent]:
    """A robot of whose models the one sends to another, and the other to none."""
    robot, sent = Robot(compass=PERIOD), Sent()
    simulator = Simulator(robot)
    robot.imu.sample.record(7, sent)
    robot.compass.sample.record(9, sent)
    return robot, simulator, sent


def test_values_are_noted_in_the_order_in_which_they_left_and_arrive_as_before() -> None:
    robot, simulator, sent = tapped()
    simulator.run(PERIOD)
    assert sent == [7, 0, 9, 0, 7, 1, 9, 1]
    assert robot.thrust.received == [0, 1]


def test_a_listener_gets_what_leaves_a_tapped_port_also_where_it_is_coupled_to_none() -> None:
    robot, simulator, sent = tapped()
    received: list[int] = []
    listening = simulator.listen(robot.compass.sample, lambda _at, value: received.append(value))
    simulator.run(0)
    listening.end()
    simulator.run(PERIOD)
    assert received == [0]
    assert sent[2::4] == [9, 9]


def test_a_port_that_is_recorded_leads_somewhere() -> None:
    robot = Robot(compass=PERIOD)
    Simulator(robot)
    port = robot.compass.sample
    assert not port.leads_somewhere
    port.record(0, [])
    assert port.leads_somewhere
