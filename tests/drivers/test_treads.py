import math
import re
import struct

import pytest

from drivers.chips.md25 import Md25, Md25Report
from drivers.chips.sabertooth import Sabertooth
from drivers.chips.setting import SettingError
from drivers.chips.step import Step
from drivers.treads import Treads, TreadSettings, TreadSpeeds
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.hal.errors import HalError
from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.serial import SerialPort
from tests.support.atomic_bench import AtomicBench
from tests.support.scripted_chip import SILENT, ScriptedChip

REPORT = Md25Report(1, 2, 12.0, 0.1, 0.2)
STOP = "stop"


class ScriptedDriver(ScriptedChip):
    """Notes the speeds it was given as calls."""

    timeout_ns = 1000 * MILLISECOND

    def __init__(self) -> None:
        super().__init__()
        self.steps: list[HalError | None] = [None]
        self.drives: list[Md25Report | HalError | None] = [None]
        self.stops: list[HalError | None] = [None]

    def bring_up(self) -> tuple[Step, ...]:
        return (Step("identify", lambda: self.answer("step", self.steps), 10 * MILLISECOND),)

    def set_speeds(self, left: float, right: float) -> Md25Report | None:
        return self.answer((left, right), self.drives)

    def stop(self) -> None:
        self.answer(STOP, self.stops)

    @property
    def driven(self) -> list[tuple[object, float]]:
        return [call for call in self.calls if call[0] != "step"]


def settings(**changes: object) -> TreadSettings:
    given = {"speed": 0.5, "refresh": 200 * MILLISECOND} | changes
    return TreadSettings(**given)  # type: ignore[arg-type]


def bench_of(driver: ScriptedDriver, treads: TreadSettings) -> AtomicBench:
    bench = AtomicBench(Treads("treads", driver, treads))
    driver.now = lambda: bench.simulator.now
    return bench


@pytest.fixture
def driver() -> ScriptedDriver:
    return ScriptedDriver()


@pytest.fixture
def bench(driver: ScriptedDriver) -> AtomicBench:
    return bench_of(driver, settings())


# Orders -------------------------------------------------------------------------------------------


def test_nothing_turns_until_it_is_ordered(bench: AtomicBench, driver: ScriptedDriver) -> None:
    bench.run(5000)
    assert driver.driven == []
    assert bench.model.phase == "still"


@pytest.mark.parametrize(
    ("right", "left", "driven"),
    [(1, 1, (0.5, 0.5)), (1, 2, (-0.5, 0.5)), (2, 1, (0.5, -0.5)), (2, 2, (-0.5, -0.5))],
)
def test_signals_of_one_instant_are_one_write(
    bench: AtomicBench,
    driver: ScriptedDriver,
    right: int,
    left: int,
    driven: tuple[float, float],
) -> None:
    bench.put(50, right=right, left=left)
    bench.run(60)
    assert driver.driven == [(driven, 50)]


def test_a_signal_for_one_side_leaves_the_other_as_it_is(
    bench: AtomicBench, driver: ScriptedDriver
) -> None:
    bench.put(50, right=1, left=2)
    bench.put(100, left=1)
    bench.put(150, right=0)
    bench.run(160)
    assert [call for call, _ in driver.driven] == [(-0.5, 0.5), (0.5, 0.5), (0.5, 0.0)]


def test_moving_treads_are_refreshed_and_standing_ones_left_alone(
    bench: AtomicBench, driver: ScriptedDriver
) -> None:
    bench.put(50, right=1, left=1)
    bench.put(500, right=0, left=0)
    bench.run(5000)
    assert driver.driven == [
        ((0.5, 0.5), 50),
        ((0.5, 0.5), 250),
        ((0.5, 0.5), 450),
        ((0.0, 0.0), 500),
    ]


def test_an_order_puts_the_next_refresh_off(bench: AtomicBench, driver: ScriptedDriver) -> None:
    bench.put(50, right=1)
    bench.put(240, left=1)
    bench.run(445)
    assert [at for _, at in driver.driven] == [50, 240, 440]


@pytest.mark.parametrize(
    ("speeds", "driven"),
    [((0.25, -0.75), (0.25, -0.75)), ((2.0, -7.0), (1.0, -1.0))],
)
def test_speeds_are_taken_as_they_are_and_clipped(
    bench: AtomicBench,
    driver: ScriptedDriver,
    speeds: tuple[float, float],
    driven: tuple[float, float],
) -> None:
    bench.put(50, speeds=TreadSpeeds(*speeds))
    bench.run(60)
    assert driver.driven == [(driven, 50)]


def test_a_signal_goes_before_speeds_for_its_own_side(
    bench: AtomicBench, driver: ScriptedDriver
) -> None:
    bench.put(50, speeds=TreadSpeeds(0.1, 0.1), left=2)
    bench.run(60)
    assert driver.driven == [((-0.5, 0.1), 50)]


def test_a_reversed_motor_is_driven_the_other_way(driver: ScriptedDriver) -> None:
    bench = bench_of(driver, settings(left_reversed=True))
    bench.put(50, right=1, left=1)
    bench.put(60, right=1, left=0)
    bench.run(70)
    assert [call for call, _ in driver.driven] == [(-0.5, 0.5), (0.0, 0.5)]


def test_an_order_during_bring_up_is_kept(bench: AtomicBench, driver: ScriptedDriver) -> None:
    bench.put(3, right=1)
    bench.put(5, left=1)
    bench.run(60)
    assert driver.driven == [((0.5, 0.5), 10)]


def test_an_order_at_the_instant_of_a_refresh_is_written_last(
    bench: AtomicBench, driver: ScriptedDriver
) -> None:
    bench.put(50, right=1, left=1)
    bench.collide(250, right=0, left=0)
    bench.run(1000)
    assert driver.driven[-1] == ((0.0, 0.0), 250)
    assert bench.model.phase == "still"


def test_what_the_driver_says_is_sent_with_each_write(
    bench: AtomicBench, driver: ScriptedDriver
) -> None:
    driver.drives = [REPORT]
    bench.put(50, right=1)
    bench.run(449)
    assert bench.said["report"] == [(50, REPORT), (250, REPORT)]


# Stopping -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("order", "reason"),
    [
        ({"left": 3}, r"treads\.left: signal 3, expected 0, 1 or 2"),
        ({"right": -1}, r"treads\.right: signal -1"),
        ({"speeds": TreadSpeeds(math.nan, 0.0)}, r"treads\.speeds: speeds \(nan, 0\.0\), expected"),
        ({"speeds": TreadSpeeds(0.0, math.inf)}, r"expected finite numbers"),
    ],
)
def test_an_order_that_is_none_stops_both_and_says_why(
    bench: AtomicBench, driver: ScriptedDriver, order: dict[str, object], reason: str
) -> None:
    bench.put(50, right=1, left=1)
    bench.put(60, **order)
    bench.run(1000)
    assert driver.driven[1:] == [(STOP, 60)]
    (fault,) = bench.faults
    assert fault.kind == "NotReady"
    assert re.search(reason, fault.reason)
    assert bench.model.phase == "still"


def test_a_write_that_fails_stops_at_once_and_forgets_the_order(
    bench: AtomicBench, driver: ScriptedDriver
) -> None:
    driver.drives = [None, SILENT, None]
    bench.put(50, right=1, left=1)
    bench.run(1000)
    assert driver.driven == [((0.5, 0.5), 50), ((0.5, 0.5), 250), (STOP, 250)]
    assert [(at, fault.kind) for at, fault in bench.said["fault"]] == [(250, "NoAcknowledge")]
    assert driver.times("step") == [0, 250]
    assert bench.model.phase == "still"


def test_a_stop_is_repeated_until_it_is_acknowledged_and_then_the_chip_brought_up(
    bench: AtomicBench, driver: ScriptedDriver
) -> None:
    driver.drives = [None, SILENT, None]
    driver.stops = [SILENT, SILENT, None]
    bench.put(50, right=1, left=1)
    bench.run(1000)
    assert driver.times(STOP) == [250, 300, 350]
    assert [(at, fault.consecutive) for at, fault in bench.said["fault"]] == [
        (250, 1),
        (250, 2),
        (300, 3),
    ]
    assert driver.times("step") == [0, 350]


def test_an_order_while_the_stop_is_pending_is_obeyed_after_it(
    bench: AtomicBench, driver: ScriptedDriver
) -> None:
    driver.drives = [None, SILENT, None]
    driver.stops = [SILENT, None]
    bench.put(50, right=1, left=1)
    bench.put(270, right=2)
    bench.run(400)
    assert driver.driven[-2:] == [(STOP, 300), ((0.0, -0.5), 310)]


def test_orders_are_obeyed_again_after_a_fault(bench: AtomicBench, driver: ScriptedDriver) -> None:
    driver.drives = [SILENT, None]
    bench.put(50, right=1, left=1)
    bench.put(100, right=1, left=1)
    bench.run(150)
    assert driver.driven[-1] == ((0.5, 0.5), 100)
    assert len(bench.faults) == 1


def test_treads_nobody_orders_about_are_stopped_when_that_is_asked_for(
    driver: ScriptedDriver,
) -> None:
    bench = bench_of(driver, settings(order_timeout=500 * MILLISECOND))
    bench.put(50, right=1, left=1)
    bench.put(300, right=1)
    bench.run(5000)
    assert driver.driven[-1] == (STOP, 800)
    assert [at for call, at in driver.driven if call == (0.5, 0.5)] == [50, 250, 300, 500, 700]
    assert [fault.reason for fault in bench.faults] == ["treads: no order for 0.5 s; stopped"]
    assert driver.times("step") == [0]


def test_standing_treads_need_no_orders(driver: ScriptedDriver) -> None:
    bench = bench_of(driver, settings(order_timeout=500 * MILLISECOND))
    bench.put(50, right=0, left=0)
    bench.run(5000)
    assert bench.faults == []


def test_a_failed_bring_up_is_told_and_begun_again(
    bench: AtomicBench, driver: ScriptedDriver
) -> None:
    driver.steps = [SILENT, None]
    bench.run(500)
    assert driver.times("step") == [0, 100]
    assert len(bench.faults) == 1
    assert bench.model.phase == "still"


def test_exit_stops_in_whatever_phase(bench: AtomicBench, driver: ScriptedDriver) -> None:
    bench.put(50, right=1, left=1)
    assert bench.simulator.exit() == []
    assert driver.driven[-1][0] == STOP


# Settings -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        ({"speed": 0.0}, "speed: 0.0, expected more than 0, 1 at most"),
        ({"speed": math.nan}, "speed: nan"),
        ({"refresh": 501 * MILLISECOND}, "refresh: 501 ms, expected more than 0, at most 500 ms"),
        ({"refresh": 0}, "refresh: 0 ms"),
        ({"order_timeout": 0}, "order_timeout: 0 ns, expected more than 0"),
    ],
)
def test_a_setting_that_cannot_be_is_refused(
    driver: ScriptedDriver, changes: dict[str, object], fault: str
) -> None:
    with pytest.raises(SettingError, match=f"treads on scripted chip: {fault}"):
        Treads("treads", driver, settings(**changes))


class SilentPort(SerialPort):
    name = "ttyS0"

    def __init__(self) -> None:
        self.written = b""

    def write(self, data: bytes) -> None:
        self.written += data

    def read_available(self) -> bytes:
        return b""

    def close(self) -> None:
        self.written = b""


def test_a_sabertooth_obeys_half_a_second_after_its_autobaud_byte() -> None:
    port = SilentPort()
    treads = settings(speed=1.0, refresh=100 * MILLISECOND)
    bench = AtomicBench(Treads("treads", Sabertooth(port), treads))
    bench.put(100, right=1, left=1)
    assert port.written == b"\xaa"
    bench.run(500)
    assert port.written.endswith(bytes.fromhex("80 00 7f 7f 80 04 7f 03"))
    bench.simulator.exit()
    assert port.written.endswith(bytes.fromhex("80 00 00 00 80 04 00 04"))


def test_an_md25_reports_what_it_reads_back(
    register_bus: I2cBus, registers: dict[int, bytearray]
) -> None:
    registers[0x58] = bytearray(256)
    registers[0x58][0x02:0x10] = struct.pack(">2i6B", 5, -5, 118, 0, 1, 2, 5, 0)
    treads = settings(refresh=SECOND // 2)
    bench = AtomicBench(Treads("treads", Md25(register_bus), treads))
    bench.put(100, right=1, left=2)
    bench.run(100)
    assert registers[0x58][0:2] == bytes((128 - 64, 128 + 64))
    assert bench.values("report")[0][:3] == (5, -5, pytest.approx(11.8))
