import pytest
from firmware_drivers.chips.bearing import Bearing
from firmware_drivers.chips.step import Step
from firmware_drivers.compass import ONCE, PERIODIC, STOP, Compass, CompassSettings

from firmware_runtime.devs.model_errors import ModelFailure
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.wire_errors import HalError, Stuck
from tests.support.atomic_bench import AtomicBench
from tests.support.scripted_chip import SILENT, ScriptedChip

PERIOD = 100 * MILLISECOND


def bearing(bearing_deg: float, *, calibration: int | None = 3) -> Bearing:
    return Bearing(bearing_deg, calibration)


class ScriptedCompass(ScriptedChip):
    def __init__(self, *, measuring_ms: int = 0) -> None:
        super().__init__()
        self.steps: list[HalError | None] = [None]
        self.readings: list[Bearing | HalError] = [bearing(90.0)]
        self.starts: list[HalError | None] = [None]
        start = Step("measure", lambda: self.answer("start", self.starts), measuring_ms * 10**6)
        self.measurement = (start,) if measuring_ms else ()

    def bring_up(self) -> tuple[Step, ...]:
        return (Step("identify", lambda: self.answer("step", self.steps), 10 * MILLISECOND),)

    def read_bearing(self) -> Bearing:
        return self.answer("read", self.readings)


def bench_of(chip: ScriptedCompass, settings: CompassSettings | None = None) -> AtomicBench:
    model = Compass("compass", chip, settings or CompassSettings(period=PERIOD))
    bench = AtomicBench(model)
    chip.now = lambda: bench.simulator.now
    return bench


@pytest.fixture
def chip() -> ScriptedCompass:
    return ScriptedCompass()


@pytest.fixture
def bench(chip: ScriptedCompass) -> AtomicBench:
    return bench_of(chip)


# Requests -----------------------------------------------------------------------------------------


def test_nothing_is_read_until_it_is_asked_for(bench: AtomicBench, chip: ScriptedCompass) -> None:
    bench.run(1000)
    assert chip.calls == [("step", 0.0)]
    assert not any(bench.said.values())


def test_one_request_is_answered_once_at_once(bench: AtomicBench) -> None:
    bench.put(50, request=ONCE)
    bench.run(1000)
    assert bench.said["heading_deg"] == [(50, 90.0)]
    assert bench.model.phase == "idle"


def test_a_periodic_request_is_answered_until_it_is_taken_back(bench: AtomicBench) -> None:
    bench.put(50, request=PERIODIC)
    bench.put(300, request=STOP)
    bench.run(1000)
    assert [at for at, _ in bench.said["heading_deg"]] == [50, 150, 250]


def test_a_single_request_between_periodic_ones_is_answered_at_once_and_ends_nothing(
    bench: AtomicBench,
) -> None:
    bench.put(50, request=PERIODIC)
    bench.put(120, request=ONCE)
    bench.run(350)
    assert [at for at, _ in bench.said["heading_deg"]] == [50, 120, 220, 320]


def test_a_request_during_bring_up_is_kept(bench: AtomicBench) -> None:
    bench.put(5, request=ONCE)
    bench.run(1000)
    assert [at for at, _ in bench.said["heading_deg"]] == [10]


def test_a_request_at_the_instant_of_a_periodic_reading_is_answered_at_that_instant(
    bench: AtomicBench,
) -> None:
    bench.put(50, request=PERIODIC)
    bench.collide(150, request=ONCE)
    bench.run(200)
    assert [at for at, _ in bench.said["heading_deg"]] == [50, 150]


def test_two_requests_at_one_instant_one_after_the_other_are_both_answered(
    bench: AtomicBench,
) -> None:
    bench.put(50, request=ONCE)
    bench.put(50, request=ONCE)
    bench.run(60)
    assert [at for at, _ in bench.said["heading_deg"]] == [50, 50]


def test_a_request_that_is_none_is_a_bug_and_names_the_port(bench: AtomicBench) -> None:
    with pytest.raises(ModelFailure, match="compass: request 3, expected 0, 1 or 2"):
        bench.put(50, request=3)


# Headings -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("bearing_deg", "heading_deg"),
    [(0.0, 0.0), (359.9, 359.9), (123.4, 123.4)],
)
def test_an_ordinary_compass_gives_its_bearing(
    bench: AtomicBench, chip: ScriptedCompass, bearing_deg: float, heading_deg: float
) -> None:
    chip.readings = [bearing(bearing_deg)]
    bench.put(50, request=ONCE)
    bench.run(60)
    assert bench.values("heading_deg") == [heading_deg]


@pytest.mark.parametrize(
    ("bearing_deg", "heading_deg"), [(0.4, 0), (0.6, 1), (359.4, 359), (359.6, 0)]
)
def test_whole_degrees_are_rounded_round_the_circle(
    chip: ScriptedCompass, bearing_deg: float, heading_deg: int
) -> None:
    bench = bench_of(chip, CompassSettings(period=PERIOD, whole_degrees=True))
    chip.readings = [bearing(bearing_deg)]
    bench.put(50, request=ONCE)
    bench.run(60)
    (heading,) = bench.values("heading_deg")
    assert (heading, type(heading)) == (heading_deg, int)


@pytest.mark.parametrize(
    ("bearing_deg", "heading_deg"), [(0.0, 30.0), (90.0, 300.0), (350.0, 40.0), (30.0, 0.0)]
)
def test_sense_and_offset_turn_bearings_into_headings(
    chip: ScriptedCompass, bearing_deg: float, heading_deg: float
) -> None:
    settings = CompassSettings(period=PERIOD, counterclockwise=True, offset_deg=30.0)
    bench = bench_of(chip, settings)
    chip.readings = [bearing(bearing_deg)]
    bench.put(50, request=ONCE)
    bench.run(60)
    assert bench.values("heading_deg") == [pytest.approx(heading_deg)]


def test_calibration_is_sent_when_it_changes(bench: AtomicBench, chip: ScriptedCompass) -> None:
    chip.readings = [bearing(angle, calibration=state) for angle, state in enumerate((0, 0, 2, 2))]
    bench.put(50, request=PERIODIC)
    bench.run(400)
    assert bench.said["calibration"] == [(50, 0), (250, 2)]


def test_a_chip_that_does_not_judge_itself_says_nothing_of_calibration(
    bench: AtomicBench, chip: ScriptedCompass
) -> None:
    chip.readings = [bearing(1.0, calibration=None)]
    bench.put(50, request=ONCE)
    bench.run(60)
    assert bench.values("heading_deg") == [1.0]
    assert bench.said["calibration"] == []


# Chips that measure on command --------------------------------------------------------------------


def test_a_measurement_takes_its_time_and_the_next_follows_a_period_after_its_end() -> None:
    chip = ScriptedCompass(measuring_ms=7)
    bench = bench_of(chip)
    bench.put(50, request=PERIODIC)
    bench.run(200)
    assert chip.times("start") == [50, 157]
    assert [at for at, _ in bench.said["heading_deg"]] == [57, 164]


def test_a_request_while_measuring_is_answered_by_that_measurement() -> None:
    chip = ScriptedCompass(measuring_ms=7)
    bench = bench_of(chip)
    bench.put(50, request=ONCE)
    bench.put(53, request=ONCE)
    bench.run(200)
    assert [at for at, _ in bench.said["heading_deg"]] == [57]


def test_a_request_at_the_instant_a_measurement_ends_gets_one_of_its_own_at_once() -> None:
    chip = ScriptedCompass(measuring_ms=7)
    bench = bench_of(chip)
    bench.put(50, request=ONCE)
    bench.collide(57, request=ONCE)
    bench.run(200)
    assert [at for at, _ in bench.said["heading_deg"]] == [57, 64]


def test_a_request_taken_back_while_measuring_is_not_answered() -> None:
    chip = ScriptedCompass(measuring_ms=7)
    bench = bench_of(chip)
    bench.put(50, request=PERIODIC)
    bench.put(53, request=STOP)
    bench.run(200)
    assert bench.said["heading_deg"] == []
    assert chip.times("start") == [50]


# Faults -------------------------------------------------------------------------------------------


def test_a_request_that_fails_is_reported_and_tried_again_until_answered(
    bench: AtomicBench, chip: ScriptedCompass
) -> None:
    chip.readings = [SILENT, SILENT, bearing(5.0)]
    bench.put(50, request=ONCE)
    bench.run(1000)
    assert [(at, fault.consecutive) for at, fault in bench.said["fault"]] == [(50, 1), (150, 2)]
    assert bench.said["heading_deg"] == [(250, 5.0)]
    assert chip.times("step") == [0]


def test_after_some_failures_in_a_row_the_chip_is_brought_up_again(
    bench: AtomicBench, chip: ScriptedCompass
) -> None:
    chip.readings = [SILENT, SILENT, SILENT, bearing(5.0)]
    bench.put(50, request=ONCE)
    bench.run(1000)
    assert chip.times("step") == [0, 250]
    assert bench.said["heading_deg"] == [(260, 5.0)]


def test_a_measurement_that_cannot_be_started_is_a_fault() -> None:
    chip = ScriptedCompass(measuring_ms=7)
    chip.starts = [SILENT, None]
    bench = bench_of(chip)
    bench.put(50, request=ONCE)
    bench.run(1000)
    assert [fault.kind for fault in bench.faults] == ["NoAcknowledge"]
    assert bench.said["heading_deg"] == [(157, 90.0)]


def test_a_chip_that_hangs_sends_nothing_until_it_does_not(chip: ScriptedCompass) -> None:
    bench = bench_of(chip)
    chip.readings = [
        bearing(90.0),
        *[Stuck("chip", "field x", 7, n) for n in (9, 10)],
        bearing(91.0),
    ]
    bench.put(50, request=PERIODIC)
    bench.run(400)
    assert bench.said["heading_deg"] == [(50, 90.0), (350, 91.0)]
    assert [(fault.kind, fault.axis, fault.value) for fault in bench.faults] == [
        ("Stuck", "field x", 7.0)
    ] * 2
    assert [fault.duration for fault in bench.faults] == [9 * PERIOD, 10 * PERIOD]


def test_a_bearing_may_stand_still(chip: ScriptedCompass) -> None:
    bench = bench_of(chip)
    bench.put(50, request=PERIODIC)
    bench.run(20_000)
    assert bench.faults == []


def test_a_period_that_cannot_be_is_refused(chip: ScriptedCompass) -> None:
    with pytest.raises(SettingError, match=r"compass: period of 0 ns; expected more than 0 ns"):
        Compass("compass", chip, CompassSettings(period=0))
