"""What watches a run is one instrument: its parts cannot come in a wrong order."""

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.functions import Functions, Instrument
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.deadlines import PathDeadline
from firmware_runtime.executive.instruments import Instruments
from tests.support.periodic_models import PERIOD, Robot


def instruments_of(robot: Robot) -> Instruments:
    deadline = PathDeadline("yaw", robot.imu.sample, robot.thrust, PERIOD)
    settings = Configuration(deadlines=[deadline], recorded_spans=64)
    return Instruments(robot, lambda: 0, settings)


def test_the_parts_are_no_instruments_of_their_own() -> None:
    instruments = instruments_of(Robot())
    parts = [instruments.step, instruments.recorder, *instruments.watches, instruments.accounting]
    assert callable(instruments)
    assert not any(map(callable, parts))


def test_it_counts_alike_before_and_after_another_instrument() -> None:
    def idle(_atomic: Atomic, functions: Functions) -> Functions:
        return functions

    counted = []
    for before in (True, False):
        robot = Robot()
        watching = instruments_of(robot)
        order: list[Instrument] = [idle, watching] if before else [watching, idle]
        simulator = Simulator(robot, instruments=order)
        watching.attach(simulator)
        assert watching.recorder is not None
        watching.recorder.open(None)
        simulator.run(10 * PERIOD)
        counted.append([account.path for account in watching.accounting.accounts])
    assert counted[0] == counted[1] == ["imu", "thrust"]
