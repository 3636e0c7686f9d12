import math

import pytest
from firmware_drivers.chips.step import Step
from firmware_drivers.sonar import READINGS, Sonar, SonarSettings

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.wire_errors import BusTimeout, HalError, NotReady
from tests.support.atomic_bench import AtomicBench
from tests.support.scripted_chip import SILENT, ScriptedChip

UP = 10.0
"""Ms the bring-up takes."""
BUSY = NotReady("scripted chip: no answer, expected the echo")


class ScriptedSonar(ScriptedChip):
    ranging_ns = 36 * MILLISECOND
    interval_ns = 65 * MILLISECOND

    def __init__(self) -> None:
        super().__init__()
        self.steps: list[HalError | None] = [None]
        self.pings: list[HalError | None] = [None]
        self.echoes: list[float | HalError] = [1.0]

    def bring_up(self) -> tuple[Step, ...]:
        return (Step("identify", lambda: self.answer("step", self.steps), 10 * MILLISECOND),)

    def start_ranging(self) -> None:
        self.answer("ping", self.pings)

    def read_distance(self) -> float:
        return self.answer("read", self.echoes)


@pytest.fixture
def chip() -> ScriptedSonar:
    return ScriptedSonar()


@pytest.fixture
def bench(chip: ScriptedSonar) -> AtomicBench:
    settings = SonarSettings(period=100 * MILLISECOND, threshold_m=0.5)
    bench = AtomicBench(Sonar("sonar", chip, settings))
    chip.now = lambda: bench.simulator.now
    return bench


def test_it_says_nothing_until_it_is_started(bench: AtomicBench, chip: ScriptedSonar) -> None:
    bench.run(1000)
    assert bench.model.phase == "idle"
    assert chip.calls == [("step", 0.0)]
    assert not any(bench.said.values())


def test_it_pings_every_period_and_reads_when_the_ranging_is_over(
    bench: AtomicBench, chip: ScriptedSonar
) -> None:
    bench.put(50, start=1)
    bench.run(300)
    assert chip.times("ping") == [50, 150, 250]
    assert chip.times("read") == [86, 186, 286]
    assert bench.said["distance"] == [(86, 1.0), (186, 1.0), (286, 1.0)]


def test_only_what_is_near_enough_is_a_detection(bench: AtomicBench, chip: ScriptedSonar) -> None:
    chip.echoes = [0.51, 0.5, 0.02, math.inf]
    bench.put(50, start=1)
    bench.run(449)
    assert bench.values("distance") == [0.51, 0.5, 0.02, math.inf]
    assert bench.said["detected"] == [(186, 1), (286, 1)]
    assert bench.faults == []


def test_a_sweeping_sonar_detects_only_what_enters_its_beam(chip: ScriptedSonar) -> None:
    settings = SonarSettings(100 * MILLISECOND, threshold_m=0.5, only_entering=True)
    bench = AtomicBench(Sonar("sonar", chip, settings))
    chip.now = lambda: bench.simulator.now
    chip.echoes = [0.3, 0.3, math.inf, 0.4, 0.3, 0.6, 0.5]
    bench.put(50, start=1)
    bench.run(749)
    assert bench.values("distance") == [0.3, 0.3, math.inf, 0.4, 0.3, 0.6, 0.5]
    assert bench.said["detected"] == [(386, 1), (686, 1)]


def test_a_start_may_be_a_bool_too(bench: AtomicBench, chip: ScriptedSonar) -> None:
    bench.put(50, start=True)
    bench.put(120, start=False)
    bench.run(1000)
    assert chip.times("ping") == [50]


def test_a_start_during_bring_up_is_kept(bench: AtomicBench, chip: ScriptedSonar) -> None:
    bench.put(5, start=1)
    bench.run(50)
    assert chip.times("ping") == [UP]


def test_a_stop_while_ranging_leaves_the_chip_and_the_port_alone(
    bench: AtomicBench, chip: ScriptedSonar
) -> None:
    bench.put(50, start=1)
    bench.put(60, start=0)
    bench.run(1000)
    assert chip.calls[1:] == [("ping", 50)]
    assert bench.values("distance") == []
    assert bench.model.phase == "idle"


def test_a_start_right_after_a_stop_waits_for_the_period(
    bench: AtomicBench, chip: ScriptedSonar
) -> None:
    bench.put(50, start=1)
    bench.put(60, start=0)
    bench.put(100, start=1)
    bench.run(200)
    assert chip.times("ping") == [50, 150]


def test_a_second_start_changes_nothing(bench: AtomicBench, chip: ScriptedSonar) -> None:
    bench.put(50, start=1)
    bench.put(60, start=1)
    bench.put(140, start=1)
    bench.run(300)
    assert chip.times("ping") == [50, 150, 250]


def test_a_stop_at_the_instant_of_the_echo_comes_after_it(bench: AtomicBench) -> None:
    bench.put(50, start=1)
    bench.collide(86, start=0)
    bench.run(1000)
    assert bench.said["distance"] == [(86, 1.0)]


def test_an_echo_that_is_late_is_asked_for_again(bench: AtomicBench, chip: ScriptedSonar) -> None:
    chip.echoes = [BUSY, BUSY, 2.0]
    bench.put(50, start=1)
    bench.run(200)
    assert chip.times("read") == [86, 91, 96, 186]
    assert bench.said["distance"] == [(96, 2.0), (186, 2.0)]
    assert chip.times("ping") == [50, 150]
    assert bench.faults == []


def test_an_echo_that_never_comes_is_a_fault_and_the_next_ping_is_on_time(
    bench: AtomicBench, chip: ScriptedSonar
) -> None:
    chip.echoes = [BUSY]
    bench.put(50, start=1)
    bench.run(249)
    assert len(chip.times("read")) == 2 * READINGS
    assert bench.said["distance"] == []
    assert [(at, fault.kind, fault.consecutive) for at, fault in bench.said["fault"]] == [
        (106, "NotReady", 1),
        (206, "NotReady", 2),
    ]
    assert chip.times("ping") == [50, 150]


def test_a_ping_without_an_answer_is_a_fault_each_period_until_one_does(
    bench: AtomicBench, chip: ScriptedSonar
) -> None:
    chip.pings = [SILENT, SILENT, None, SILENT, None]
    bench.put(50, start=1)
    bench.run(500)
    assert [(at, fault.consecutive) for at, fault in bench.said["fault"]] == [
        (50, 1),
        (150, 2),
        (350, 1),
    ]
    assert [at for at, _ in bench.said["distance"]] == [286, 486]


def test_an_error_while_reading_is_not_asked_again(bench: AtomicBench, chip: ScriptedSonar) -> None:
    chip.echoes = [BusTimeout("i2c-1 stuck"), 1.0]
    bench.put(50, start=1)
    bench.run(200)
    assert chip.times("read") == [86, 186]
    assert [fault.kind for fault in bench.faults] == ["BusTimeout"]


def test_a_failed_bring_up_is_reported_and_begun_again(
    bench: AtomicBench, chip: ScriptedSonar
) -> None:
    chip.steps = [SILENT, SILENT, None]
    chip.pings = [SILENT, None]
    bench.put(5, start=1)
    bench.run(300)
    faults = [(at, fault.consecutive) for at, fault in bench.said["fault"]]
    assert faults == [(0, 1), (100, 2), (210, 1)]
    assert chip.times("ping")[0] == 210


def test_a_period_shorter_than_the_chip_allows_is_refused(chip: ScriptedSonar) -> None:
    settings = SonarSettings(period=64 * MILLISECOND, threshold_m=0.5)
    with pytest.raises(SettingError, match="sonar: period of 64 ms; expected 65 ms or more for"):
        Sonar("sonar", chip, settings)


def sonar_of(bench: AtomicBench) -> Sonar:
    assert isinstance(bench.model, Sonar)
    return bench.model


def test_one_that_failed_in_every_use_says_how_often(
    bench: AtomicBench, chip: ScriptedSonar
) -> None:
    chip.echoes = [BusTimeout("scripted chip: silent")]
    bench.put(50, start=1)
    bench.run(1000)
    assert sonar_of(bench).failed_uses() == len(bench.faults) > 2
    assert sonar_of(bench).unready() is not None


def test_one_that_worked_once_has_not_failed_in_every_use(
    bench: AtomicBench, chip: ScriptedSonar
) -> None:
    chip.echoes = [1.0, BusTimeout("scripted chip: silent")]
    bench.put(50, start=1)
    bench.run(1000)
    assert len(bench.faults) > 2
    assert sonar_of(bench).failed_uses() == 0


def test_a_bring_up_that_failed_is_no_use(bench: AtomicBench, chip: ScriptedSonar) -> None:
    chip.steps = [BusTimeout("scripted chip: silent")]
    bench.run(1000)
    assert len(bench.faults) > 2
    assert sonar_of(bench).failed_uses() == 0
