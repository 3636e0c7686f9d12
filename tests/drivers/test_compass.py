from typing import ClassVar

import pytest
from firmware_drivers.chips.bearing import Bearing
from firmware_drivers.chips.cmps12 import Cmps12
from firmware_drivers.chips.step import Step
from firmware_drivers.compass import ONCE, PERIODIC, Compass, CompassSettings
from firmware_drivers.tables.compass import Cmps12Table, Hmc5883lTable

from firmware_runtime.devs.model_errors import ModelFailure
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.wire_errors import HalError, Stuck
from sim_doubles.chips.cmps12 import Cmps12Double
from tests.support.scripted_bench import ScriptedBench
from tests.support.scripted_chip import ScriptedChip
from tests.support.virtual_bus import VirtualBus
from tests.support.wire import sentences

PERIOD = 100 * MILLISECOND
PLAIN = CompassSettings(PERIOD)


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


class Bench(ScriptedBench[ScriptedCompass]):
    good: ClassVar = {"readings": bearing(90.0)}

    def __init__(self, chip: ScriptedCompass, settings: CompassSettings = PLAIN) -> None:
        super().__init__(Compass("compass", chip, settings), chip)

    @property
    def answered(self) -> list[float]:
        return [at_ms for at_ms, _ in self.said["heading_deg"]]

    @property
    def starts(self) -> list[float]:
        return self.chip.times("start")


@pytest.fixture
def chip() -> ScriptedCompass:
    return ScriptedCompass()


@pytest.fixture
def bench(chip: ScriptedCompass) -> Bench:
    return Bench(chip)


# Requests -----------------------------------------------------------------------------------------


@sentences(
    {
        "nothing is read until it is asked for": "1000; answered is ()",
        "one request is answered once at once": "50 request=1; 1000; answered is 50",
        "a periodic request is answered until it is taken back": (
            "50 request=2; 300 request=0; 1000; answered is 50 150 250"
        ),
        "a single request between periodic ones is answered at once and ends nothing": (
            "50 request=2; 120 request=1; 350; answered is 50 120 220 320"
        ),
        "a request during bring-up is kept": "5 request=1; 1000; answered is 10",
        "two requests at one instant are both answered": (
            "50 request=1; 50 request=1; 60; answered is 50 50"
        ),
    }
)
def test_requests_are_answered(bench: Bench, lines: str) -> None:
    bench.play(f"{lines}; steps is 0; consecutive is ()")
    assert {*bench.values("heading_deg")} <= {90.0}
    assert len(bench.chip.times("read")) == len(bench.answered)


@sentences(
    {
        "takes its time, which is part of the period": (
            "50 request=2; 300; answered is 57 157 257; starts is 50 150 250"
        ),
        "answers a request while measuring": "50 request=1; 53 request=1; 200; answered is 57",
        "is not sent where the request was taken back": (
            "50 request=2; 53 request=0; 200; answered is (); starts is 50"
        ),
        "is a fault where it cannot be started": (
            "starts x.; 50 request=1; 1000; answered is 157; consecutive is 1"
        ),
    }
)
def test_a_measurement(lines: str) -> None:
    Bench(ScriptedCompass(measuring_ms=7)).play(lines)


@pytest.mark.parametrize(
    ("measuring_ms", "first", "collides_at", "answered_at"),
    [
        pytest.param(0, PERIODIC, 150, [50, 150], id="of a periodic reading is answered by it"),
        pytest.param(7, ONCE, 57, [57, 64], id="a measurement ends gets one of its own at once"),
    ],
)
def test_a_request_at_the_instant(
    measuring_ms: int, first: int, collides_at: int, answered_at: list[int]
) -> None:
    bench = Bench(ScriptedCompass(measuring_ms=measuring_ms))
    bench.put(50, request=first)
    bench.collide(collides_at, request=ONCE)
    bench.run(200)
    assert bench.answered == answered_at


def test_a_request_that_is_none_is_a_bug_and_names_the_port(bench: Bench) -> None:
    with pytest.raises(ModelFailure, match="compass: request 3, expected 0, 1 or 2"):
        bench.put(50, request=3)


# Headings -----------------------------------------------------------------------------------------


TURNED = CompassSettings(PERIOD, counterclockwise=True, offset_deg=30.0)
WHOLE = CompassSettings(PERIOD, whole_degrees=True)


@pytest.mark.parametrize(
    ("settings", "bearing_deg", "heading_deg"),
    [
        *((PLAIN, angle, angle) for angle in (0.0, 359.9, 123.4)),
        *((WHOLE, 0.4, 0), (WHOLE, 0.6, 1), (WHOLE, 359.4, 359), (WHOLE, 359.6, 0)),
        *((TURNED, 0.0, 30.0), (TURNED, 90.0, 300.0), (TURNED, 350.0, 40.0), (TURNED, 30.0, 0.0)),
    ],
)
def test_bearings_become_headings(
    chip: ScriptedCompass, settings: CompassSettings, bearing_deg: float, heading_deg: float
) -> None:
    bench = Bench(chip, settings)
    chip.readings = [bearing(bearing_deg)]
    bench.put(50, request=ONCE)
    (heading,) = bench.values("heading_deg")
    assert heading == pytest.approx(heading_deg)
    assert type(heading) is type(heading_deg)


def test_headings_are_those_of_the_chip_where_the_board_says_nothing_else() -> None:
    said = Cmps12Table(bus="i2c1", address=0x60, period_s=0.1).model(whole_degrees=False)
    assert said == PLAIN
    other = Hmc5883lTable(bus="i2c1", period_s=0.1, counterclockwise=True, offset_deg=30.0)
    assert other.model(whole_degrees=False) == TURNED


@pytest.mark.parametrize(
    ("states", "said"),
    [((0, 0, 2, 2), [(50, 0), (250, 2)]), ((None, None, None, None), [])],
    ids=["is sent when it changes", "of a chip that does not judge itself is not"],
)
def test_calibration(
    bench: Bench, chip: ScriptedCompass, states: tuple[int | None], said: list[object]
) -> None:
    chip.readings = [bearing(angle, calibration=state) for angle, state in enumerate(states)]
    bench.put(50, request=PERIODIC)
    bench.run(400)
    assert bench.values("heading_deg") == [0, 1, 2, 3]
    assert bench.said["calibration"] == said


# Faults -------------------------------------------------------------------------------------------


@sentences(
    {
        "tried again until answered": (
            "readings xx.; 50 request=1; 1000; answered is 250; steps is 0; consecutive is 1 2"
        ),
        "after some in a row the chip is brought up again": (
            "readings xxx.; 50 request=1; 1000; answered is 260; steps is 0 250; "
            "consecutive is 1 2 3"
        ),
    }
)
def test_a_request_that_fails_is(bench: Bench, lines: str) -> None:
    bench.play(lines)


def test_a_chip_that_hangs_sends_nothing_until_it_does_not(
    bench: Bench, chip: ScriptedCompass
) -> None:
    hung = [Stuck("chip", "field x", 7, readings) for readings in (9, 10)]
    chip.readings = [bearing(90.0), *hung, bearing(91.0)]
    bench.put(50, request=PERIODIC)
    bench.run(400)
    assert bench.said["heading_deg"] == [(50, 90.0), (350, 91.0)]
    assert [(fault.kind, fault.axis, fault.value, fault.duration) for fault in bench.faults] == [
        ("Stuck", "field x", 7.0, readings * PERIOD) for readings in (9, 10)
    ]


def test_a_bearing_may_stand_still(bench: Bench) -> None:
    bench.put(50, request=PERIODIC)
    bench.run(20_000)
    assert bench.faults == []


def test_a_period_that_cannot_be_is_refused(chip: ScriptedCompass) -> None:
    with pytest.raises(SettingError, match=r"compass: period of 0 ns; expected more than 0 ns"):
        Compass("compass", chip, CompassSettings(period=0))


# On its double ------------------------------------------------------------------------------------


def turning(at: int) -> float:
    """A vehicle that turns right by 60 degrees/s."""
    return 60.0 * at / SECOND % 360


@pytest.mark.slow
def test_one_that_hangs_is_reported_and_sends_no_heading() -> None:
    rig = VirtualBus()
    double = rig.connect(Cmps12Double, address=0x62, bearing_deg=turning)
    double.hangs_from = 5 * SECOND
    chip = Cmps12(rig.bus, 0x62, period_ns=50 * MILLISECOND)
    compass = Compass("compass2", chip, CompassSettings(period=50 * MILLISECOND))
    headings = rig.simulate([compass], compass.heading_out)
    faults = rig.listen(compass.fault_out)
    rig.run(100 * MILLISECOND)
    rig.send(compass.request, PERIODIC, 100 * MILLISECOND)
    rig.run(8 * SECOND)
    at, first = faults[0]
    assert (first.kind, first.axis) == ("Stuck", "field x, field y, field z")
    assert at == pytest.approx(5800 * MILLISECOND, abs=100 * MILLISECOND)
    assert headings[-1][0] < 5900 * MILLISECOND
