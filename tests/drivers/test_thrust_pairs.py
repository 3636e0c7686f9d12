import pytest
from firmware_drivers.thrust_pairs import Forces, ThrustPairs, ThrustSettings, duties_of
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.devs.time import MILLISECOND
from tests.support.pca9685_bench import Pca9685Bench
from tests.support.wire import sentences

FORCE = st.floats(-1.0, 1.0)
OFF = (0.0,) * 8
TENTHS = (0.1, 0.1, 0.1, 0.1)


class Bench(Pca9685Bench):
    """Thrust pairs on a PCA9685 double; forces come in by hand."""

    def __init__(self, slew_per_s: float = 1e6, first_channel: int = 0) -> None:
        settings = ThrustSettings(0.4, 1000.0, slew_per_s, 50 * MILLISECOND, first_channel)
        super().__init__(lambda chip, _: ThrustPairs("thrust", chip, settings))

    def push(self, at_ms: int, *forces: float) -> None:
        self.put(at_ms, forces=Forces(*(forces or TENTHS)))

    @property
    def kinds(self) -> str:
        return " ".join(fault.kind for fault in self.faults)

    @property
    def duties(self) -> list[float]:
        return [duty for duties in self.values("duties") for duty in duties]

    def drive(self, from_ms: int, to_ms: int) -> None:
        for at_ms in range(from_ms, to_ms, 10):
            self.push(at_ms)


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_zero_force_is_both_propellers_at_one_half() -> None:
    assert duties_of(Forces(0, 0, 0, 0), 0.4) == (0.5,) * 8


@given(FORCE, st.floats(0.1, 2.0))
def test_a_pair_gives_the_force_that_was_asked_up_to_its_limit(force: float, most: float) -> None:
    first, second = duties_of(Forces(force, 0, 0, 0), most)[:2]
    assert most * (first**2 - second**2) == pytest.approx(max(-most, min(most, force)))


TENTHS_AT_100 = "100 forces=(0.1,0.1,0.1,0.1)"
AGAIN = "forces=(0.1,0.1,0.1,0.1)"


@sentences(
    {
        "nothing turns until forces come": "1000; running is True; off is True; duties is ()",
        "forces before the chip is up have no effect": f"10 {AGAIN}; 1000; off is True",
        "all go off when no forces come for the timeout, and on with new ones": (
            f"{TENTHS_AT_100}; 149; off is False; 150; off is True; consecutive is 1; 300 {AGAIN}; "
            "off is False; consecutive is 1"
        ),
        "disabled they are off at once and without a fault, until they are enabled": (
            f"{TENTHS_AT_100}; 110 enable=False; off is True; 115 {AGAIN}; off is True; "
            f"150 enable=True; off is True; 160 {AGAIN}; off is False; consecutive is ()"
        ),
        "enabled while they turn they turn on, for no longer than forces hold": (
            f"{TENTHS_AT_100}; 140 enable=True; off is False; 149; off is False; 150; off is True"
        ),
        "a force that is no number switches off": (
            f"{TENTHS_AT_100}; 110 forces=(0.1,1e999,0.1,0.1); off is True; consecutive is 1"
        ),
        "a burst that fails switches off and a later one recovers": (
            f"{TENTHS_AT_100}; refuse 1; 110 {AGAIN}; off is True; 120 {AGAIN}; off is False; "
            "consecutive is 1"
        ),
        "the first burst after a failed one is followed by a poll": (
            f"{TENTHS_AT_100}; refuse 1; 110 {AGAIN}; power cycle; 120 {AGAIN}; off is True; "
            "kinds is NoAcknowledge NotReady"
        ),
        "stopping is repeated until it is acknowledged": (
            f"{TENTHS_AT_100}; refuse 3; 249; off is False; 300; off is True; "
            "consecutive is 1 2 3 4"
        ),
        "a failed bring-up is reported and begun again": (
            "refuse 2; 199; kinds is NoAcknowledge NoAcknowledge; running is False; 400; "
            "running is True"
        ),
    }
)
def test_forces_turn_the_propellers(bench: Bench, lines: str) -> None:
    bench.play(lines)


def test_disabled_while_nothing_turns_they_write_nothing(bench: Bench) -> None:
    bench.run(100)
    before = bench.bus.transactions
    bench.play("110 enable=False; 150; off is True")
    assert bench.bus.transactions == before


def test_the_end_of_forces_is_said_with_its_duties(bench: Bench) -> None:
    bench.play(TENTHS_AT_100, "150")
    assert bench.values("duties")[-1] == OFF
    assert "no forces for 0.05 s" in bench.faults[0].reason


def test_duties_are_not_sent_while_nobody_knows_what_the_chip_has(bench: Bench) -> None:
    bench.play(TENTHS_AT_100, "refuse 3", "249")
    assert bench.values("duties") == [bench.double.duties[:8]]
    bench.run(300)
    assert bench.values("duties")[1:] == [OFF]


def test_forces_become_one_burst_of_duties_on_the_right_channels() -> None:
    bench = Bench(first_channel=4)
    bench.run(100)
    before = bench.bus.transactions
    bench.push(100, 0.4, -0.4, 0.0, 0.2)
    assert bench.bus.transactions == before + 1
    assert bench.double.duties[4:12] == (1.0, 0.0, 0.0, 1.0, 0.5, 0.5, 0.75, 0.25)
    assert bench.values("duties") == [bench.double.duties[4:12]]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("inverted", "read"),
    [(False, "read 11 11 1e,"), (True, "MODE1, MODE2, PRE_SCALE read 20 14 05,")],
)
def test_a_chip_that_was_reset_or_inverted_is_switched_off_within_a_second_and_brought_up(
    bench: Bench, read: str, *, inverted: bool
) -> None:
    bench.drive(100, 1500)
    if inverted:
        bench.bus.write(0x40, b"\x01\x14")
    else:
        bench.double.power_cycle()
    were: list[tuple[float, ...]] = []
    bench.double.before_change = lambda: were.append(bench.double.duties)
    bench.drive(1500, 2500)
    (fault,) = bench.faults
    assert f"{read} expected 20 04 05" in fault.reason
    assert (0.0,) * 16 in were
    assert OFF in bench.values("duties")
    assert bench.values("duties")[-1] == bench.double.duties[:8]
    assert not bench.double.all_off


def test_a_duty_changes_no_faster_than_the_slew() -> None:
    bench = Bench(slew_per_s=10.0)
    for at_ms, force, duties in (
        (100, 0.0, (0.5, 0.5)),
        (110, 0.4, (0.6, 0.4)),
        (140, 0.4, (0.9, 0.1)),
    ):
        bench.push(at_ms, force, 0.0, 0.0, 0.0)
        assert bench.double.duties[:2] == pytest.approx(duties, abs=1 / 4096)


def test_exit_leaves_all_channels_off(bench: Bench) -> None:
    bench.push(100)
    assert bench.simulator.exit() == []
    assert bench.double.all_off
