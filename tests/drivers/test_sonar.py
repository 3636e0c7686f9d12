import pytest
from firmware_drivers.chips.srf08 import Srf08, Srf08Settings
from firmware_drivers.chips.step import Step
from firmware_drivers.sonar import READINGS, Sonar, SonarSettings
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.wire_errors import BusTimeout, HalError, NotReady
from sim_doubles.chips.srf08 import Srf08Double
from sim_doubles.faults import AbsentTarget, FaultScript
from tests.support.scripted_bench import ScriptedBench
from tests.support.scripted_chip import ScriptedChip
from tests.support.virtual_bus import VirtualBus
from tests.support.wire import sentences

BUSY = NotReady("scripted chip: no answer, expected the echo")


class ScriptedSonar(ScriptedChip):
    ranging_ns = 36 * MILLISECOND
    interval_ns = 65 * MILLISECOND
    nearest_m = 0.2

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


class Bench(ScriptedBench[ScriptedSonar]):
    def __init__(
        self, chip: ScriptedSonar, *, only_entering: bool = False, detection_pings: int = 1
    ) -> None:
        settings = SonarSettings(
            100 * MILLISECOND,
            threshold_m=0.5,
            only_entering=only_entering,
            detection_pings=detection_pings,
        )
        super().__init__(Sonar("sonar", chip, settings), chip)

    @property
    def pings(self) -> list[float]:
        return self.chip.times("ping")

    @property
    def reads(self) -> list[float]:
        return self.chip.times("read")

    def at(self, port: str) -> list[float]:
        return [at_ms for at_ms, _ in self.said[port]]

    @property
    def distances(self) -> list[float]:
        return self.at("distance")

    @property
    def detected(self) -> list[float]:
        return self.at("detected")

    @property
    def failed(self) -> str:
        """Each fault as `ms:kind:number in its row`."""
        return " ".join(
            f"{at:.12g}:{fault.kind}:{fault.consecutive}" for at, fault in self.said["fault"]
        )


@pytest.fixture
def bench(chip: ScriptedSonar) -> Bench:
    return Bench(chip)


@sentences(
    {
        "nothing until it is started": "1000; pings is (); steps is 0; phase is idle",
        "it pings every period and reads when the ranging is over": (
            "50 start=1; 300; pings is 50 150 250; reads is 86 186 286; distances is 86 186 286"
        ),
        "a start may be a bool too": "50 start=True; 120 start=False; 1000; pings is 50",
        "a start during bring-up is kept": "5 start=1; 50; pings is 10; reads is 46",
        "a stop while ranging leaves the chip and the port alone": (
            "50 start=1; 60 start=0; 1000; pings is 50; reads is (); distances is (); phase is idle"
        ),
        "a start right after a stop waits for the period": (
            "50 start=1; 60 start=0; 100 start=1; 200; pings is 50 150; reads is 186"
        ),
        "a second start changes nothing": (
            "50 start=1; 60 start=1; 140 start=1; 300; pings is 50 150 250"
        ),
    }
)
def test_pings_and_readings(bench: Bench, lines: str) -> None:
    bench.play(f"{lines}; detected is (); failed is ()")
    assert {*bench.values("distance")} <= {1.0}


@pytest.mark.parametrize(
    ("only_entering", "echoes", "detected"),
    [(False, "0.51 0.5 0.02 inf", "186 286"), (True, "0.3 0.3 inf 0.4 0.3 0.6 0.5", "386 686")],
    ids=["only of what is near enough", "by a sweeping one only of what enters its beam"],
)
def test_detections(
    chip: ScriptedSonar, echoes: str, detected: str, *, only_entering: bool
) -> None:
    bench = Bench(chip, only_entering=only_entering)
    chip.echoes = [*map(float, echoes.split())]
    until_ms = 49 + 100 * len(chip.echoes)
    bench.play(f"50 start=1; {until_ms}; detected is {detected}; failed is ()")
    assert bench.values("distance") == [*map(float, echoes.split())]


@pytest.mark.parametrize(("only_entering", "detected"), [(False, "486 586 886"), (True, "486 886")])
def test_one_echo_alone_is_no_detection_where_two_have_to_agree(
    chip: ScriptedSonar, detected: str, *, only_entering: bool
) -> None:
    bench = Bench(chip, only_entering=only_entering, detection_pings=2)
    chip.echoes = [9.0, 0.1, 9.0, 0.4, 0.3, 0.3, 9.0, 0.5, 0.5]
    bench.play("50 start=1; 949; failed is ()")
    assert bench.detected == [float(each) for each in detected.split()]


def test_the_first_echo_alone_is_no_detection_either_however_often_it_is_started(
    chip: ScriptedSonar,
) -> None:
    bench = Bench(chip, detection_pings=2)
    chip.echoes = [0.1, 9.0, 9.0, 0.1, 0.1, 0.1]
    bench.play("50 start=1; 400 start=0; 1050 start=1; 1249; detected is 1186; failed is ()")


def test_what_stands_in_the_beam_as_it_is_started_again_has_not_entered(
    chip: ScriptedSonar,
) -> None:
    bench = Bench(chip, only_entering=True)
    chip.echoes = [9.0, 9.0, 9.0, 0.3, 9.0, 0.3]
    bench.play("50 start=1; 300 start=0; 1050 start=1; 1349; detected is 1286; failed is ()")


def test_what_stands_in_the_beam_at_first_has_not_entered_however_many_have_to_agree(
    chip: ScriptedSonar,
) -> None:
    bench = Bench(chip, only_entering=True, detection_pings=3)
    chip.echoes = [0.3]
    bench.play("50 start=1; 949; detected is (); failed is ()")


def test_a_stop_at_the_instant_of_the_echo_comes_after_it(bench: Bench) -> None:
    bench.put(50, start=1)
    bench.collide(86, start=0)
    bench.run(1000)
    assert bench.said["distance"] == [(86, 1.0)]


@pytest.mark.parametrize(
    ("echoes", "lines"),
    [
        pytest.param(
            [BUSY, BUSY, 2.0],
            "reads is 86 91 96 186; distances is 96 186; failed is ()",
            id="an echo that is late is asked for again",
        ),
        pytest.param(
            [*[BUSY] * READINGS, 2.0],
            "reads is 86 91 96 101 106 186; distances is 186; failed is 106:NotReady:1",
            id="an echo that never comes is a fault and the next ping is on time",
        ),
        pytest.param(
            [BusTimeout("i2c-1 stuck"), 2.0],
            "reads is 86 186; distances is 186; failed is 86:BusTimeout:1",
            id="an error while reading is not asked again",
        ),
    ],
)
def test_an_echo_that_cannot_be_read(
    bench: Bench, chip: ScriptedSonar, echoes: list[float | HalError], lines: str
) -> None:
    chip.echoes = [*echoes]
    bench.play(f"50 start=1; 200; pings is 50 150; {lines}")


@sentences(
    {
        "a ping without an answer is a fault each period until one does": (
            "pings xx.x.; 50 start=1; 500; distances is 286 486; "
            "failed is 50:NoAcknowledge:1 150:NoAcknowledge:2 350:NoAcknowledge:1"
        ),
        "a failed bring-up is reported and begun again": (
            "steps xx.; pings x.; 5 start=1; 300; "
            "failed is 0:NoAcknowledge:1 100:NoAcknowledge:2 210:NoAcknowledge:1"
        ),
    }
)
def test_a_chip_that_is_silent(bench: Bench, lines: str) -> None:
    bench.play(lines)


def test_a_period_shorter_than_the_chip_allows_is_refused(chip: ScriptedSonar) -> None:
    settings = SonarSettings(period=64 * MILLISECOND, threshold_m=0.5)
    with pytest.raises(SettingError, match="sonar: period of 64 ms; expected 65 ms or more for"):
        Sonar("sonar", chip, settings)


def test_a_threshold_that_no_echo_can_reach_is_refused(chip: ScriptedSonar) -> None:
    """A vehicle would drive into what it is to stop at."""
    Sonar("sonar", chip, SonarSettings(100 * MILLISECOND, threshold_m=0.2))
    with pytest.raises(SettingError, match=r"threshold of 0\.19 m; expected 0\.2 m or more"):
        Sonar("sonar", chip, SonarSettings(100 * MILLISECOND, threshold_m=0.19))


GONE = BusTimeout("scripted chip: silent")


@pytest.mark.parametrize(
    ("steps", "echoes", "counts"),
    [
        pytest.param([None], [GONE], True, id="in every use"),
        pytest.param([None], [1.0, GONE], False, id="but worked once"),
        pytest.param([GONE], [1.0], False, id="in its bring-up, which is no use"),
    ],
)
def test_failed_uses_of_one_that_failed(
    bench: Bench,
    chip: ScriptedSonar,
    steps: list[HalError | None],
    echoes: list[float | HalError],
    *,
    counts: bool,
) -> None:
    chip.steps, chip.echoes = [*steps], [*echoes]
    bench.put(50, start=1)
    bench.run(1000)
    assert isinstance(bench.model, Sonar)
    assert len(bench.faults) > 2
    assert bench.model.failed_uses() == (len(bench.faults) if counts else 0)
    assert bench.model.unready() is not None


# On its double ------------------------------------------------------------------------------------


@pytest.mark.slow
@settings(max_examples=10, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 2_000_000), st.booleans()), max_size=40))
def test_starts_and_stops_at_any_time_never_disturb_a_ranging(
    orders: list[tuple[int, bool]],
) -> None:
    rig = VirtualBus()
    double = rig.connect(Srf08Double, address=0x75, echoes=lambda _: [1.5])
    chip = Srf08(rig.bus, 0x75, Srf08Settings(max_range_m=11.0))
    sonar = Sonar("sonar", chip, SonarSettings(66 * MILLISECOND, threshold_m=1.0))
    received = rig.simulate([sonar], sonar.distance_out, sonar.fault_out)
    for at_us, start in sorted(orders):
        rig.run(at_us * 1000)
        rig.send(sonar.start, int(start), at_us * 1000)
    rig.run(2200 * MILLISECOND)
    assert rig.doubles.errors == 1  # the silence that the bring-up asks for
    assert list(double.warnings) == []
    assert {value for _, value in received} <= {1.5}


def test_one_unplugged_in_mid_run_is_a_fault_each_period_until_it_is_back() -> None:
    rig = VirtualBus()
    double = rig.connect(Srf08Double, address=0x75, echoes=lambda _: [1.5])
    gone = AbsentTarget(target=double, since=1001 * MILLISECOND, until=1999 * MILLISECOND)
    rig.doubles.faults = FaultScript([gone])
    sonar = Sonar("sonar", Srf08(rig.bus, 0x75), SonarSettings(100 * MILLISECOND, threshold_m=1.0))
    received = rig.simulate([sonar], sonar.distance_out, sonar.fault_out)
    rig.send(sonar.start, 1, 0)
    rig.run(3000 * MILLISECOND)
    times = [at // MILLISECOND for at, value in received if value != 1.5]
    assert (len(times), times[0] < 1100) == (10, True)
    assert [at // MILLISECOND for at, value in received if value == 1.5][-1] > 2900
