"""The Sabertooth's double by bytes; every expected value is worked out by hand."""

import pytest

from firmware_runtime.devs.time import MILLISECOND
from sim_doubles.chips.sabertooth import SabertoothDouble
from sim_doubles.clock import ManualClock
from tests.support.wire import Played, sentences

AHEAD, STILL, FULL = "0 127; 4 127", "units is 0 0", "units is 127 127"


TENTH = 100 * MILLISECOND


def packet(command: int, value: int, address: int = 128) -> bytes:
    return bytes([address, command, value, (address + command + value) & 0x7F])


class Sabertooth(Played[SabertoothDouble]):
    """A driver; a line of its tests is a command and its value, or bytes: `S 80 00 3f 3f`."""

    def __init__(self, clock: ManualClock, speed: float = 12.7, **model: bool) -> None:
        super().__init__(clock, SabertoothDouble(clock, full_speed_rad_s=speed, **model))

    @property
    def units(self) -> tuple[int, ...]:
        """The speeds in 127ths of full speed."""
        return tuple(round(speed * 127) for speed in self.chip.speeds)

    def transfer(self, line: str) -> None:
        if line.startswith("S "):
            self.chip.receive(bytes.fromhex(line.removeprefix("S ")))
        else:
            command, value, *address = map(int, line.split())
            self.chip.receive(packet(command, value, *address))

    def power_cycle(self) -> None:
        self.chip.power_cycle()


@pytest.fixture
def fresh(clock: ManualClock) -> Sabertooth:
    """Return one that has got no byte yet."""
    return Sabertooth(clock)


@pytest.fixture
def driver(fresh: Sabertooth) -> Sabertooth:
    """Return one that has got its autobaud byte and jumps to every speed."""
    fresh.play("S aa; 16 0")
    return fresh


@sentences(
    {
        "motor 1 ahead": "S 80 00 3f 3f; units is 63 0",
        "motor 2 astern": "S 80 05 3f 44; units is 0 -63",
        "both ahead in two packets": "S 80 00 7f 7f 80 04 7f 03; units is 127 127",
        "motor 1 astern": "S 80 01 7f 00; units is -127 0",
        "seven bits: least is full astern": "S 80 06 00 06; units is -127 0",
        "seven bits: the middle is stop": "S 80 06 40 46; units is 0 0",
        "seven bits: most is full ahead": "S 80 06 7f 05; units is 127 0",
        # 32 of 64 steps backwards: -63.5, rounded to even
        "seven bits of motor 2": "S 80 07 20 27; units is 0 -64",
        "a packet may come in pieces": "S 80; S 00; S 3f; S 3f; units is 63 0",
        "speeds are a share of full speed and in rad a second": (
            "0 127; 5 127; speeds is 1 -1; speeds_rad_s is 12.7 -12.7"
        ),
        "more autobaud bytes do no harm": "S aa aa; 0 64; S aa; 4 64; units is 64 64",
        "an address byte begins a packet wherever it comes": (
            "S 80 00 80 00 3f 3f; units is 63 0; warns packet 80 00 cut short"
        ),
        "mixed mode waits for drive and turn": (
            "8 50; units is 0 0; 10 20; units is 70 30; 9 50; units is -30 -70"
        ),
        "mixed speeds end at full ahead": "8 100; 11 60; units is 40 127",
        "mixed speeds end at full astern": "9 100; 10 60; units is -40 -127",
        "mixed turn in seven bits": "12 64; 13 127; units is 127 -127",
        "mixed drive in seven bits": "12 127; 13 64; units is 127 127",
        "mixed, both least": "12 0; 13 0; units is -127 0",
        "changing between command sets stops until new commands": (
            f"0 100; 4 100; 8 50; {STILL}; 10 0; units is 50 50; 0 30; units is 30 0"
        ),
        "the timeout is off at first": f"{AHEAD}; 3600 s; {FULL}",
        "a timeout of zero switches it off": f"14 1; {AHEAD}; 14 0; 3600 s; {FULL}",
        "silence longer than the timeout stops the motors": (
            f"S 80 0e 03 11; {AHEAD}; 299.999999 ms; {FULL}; 1 ns; {STILL}; 3600 s; {STILL}"
        ),
        "the timeout runs from the last packet for this driver": (
            f"14 2; {AHEAD}; 150 ms; 4 127; 150 ms; {FULL}; 0 127 129; S 80 00 7f 00; 50 ms; "
            f"{STILL}; warns packet for address 129; warns wrong checksum"
        ),
        "after the timeout each motor waits for its own command": (
            f"14 1; {AHEAD}; 1 s; 4 64; units is 0 64"
        ),
        "mixed mode waits for both again after the timeout": (
            f"14 1; 8 50; 10 0; 1 s; 8 50; {STILL}; 11 0; units is 50 50"
        ),
        "a power cycle loses timeout and autobaud": (
            f"14 1; {AHEAD}; S 80 00; power cycle; {STILL}; {AHEAD}; {STILL}; "
            f"{'; '.join(['warns before the autobaud byte'] * 8)}; S aa; {AHEAD}; 1 s; {FULL}"
        ),
        "ramping and deadband survive a power cycle": (
            "17 20; power cycle; S aa; 0 19; 4 20; units is 0 20; 1 s; units is 0 20"
        ),
        "the deadband takes small speeds for stop": (
            f"0 2; 5 3; units is 0 -3; 17 10; {STILL}; 17 0; units is 0 -3"
        ),
        "battery limits and baud rate are taken without effect": (
            "2 10; 3 60; 15 4; 0 64; units is 64 0"
        ),
    }
)
def test_packets_drive_the_motors(driver: Sabertooth, lines: str) -> None:
    driver.play(lines)


@pytest.mark.parametrize(
    ("sent", "warnings"),
    [
        ("80003f3e", "warns packet 80 00 3f 3e has a wrong checksum"),
        ("81003f40", "warns packet for address 129"),
        ("80003f aa", "warns packet 80 00 3f cut short"),
        ("3f", "warns byte 0x3f outside a packet"),
        ("80033f42 80123f51", "warns command 18 with 63 does not exist"),
        ("80105161", "warns command 16 with 81 does not exist"),
    ],
)
def test_what_is_no_packet_for_the_driver_is_ignored_with_a_warning(
    driver: Sabertooth, sent: str, warnings: str
) -> None:
    driver.play(f"0 64; S {sent}; units is 64 0; {warnings}; 0 0", STILL)


def test_the_driver_never_sends(driver: Sabertooth) -> None:
    assert driver.chip.transmitted(driver.clock()) == b""


def test_nothing_is_taken_before_the_autobaud_byte(fresh: Sabertooth) -> None:
    ignored = "; ".join(["warns before the autobaud byte 0xaa"] * 4)
    fresh.play(f"0 64; 1 s; {STILL}; {ignored}; S aa; 0 64; 1 s; units is 64 0")


def test_a_model_that_stores_its_baud_rate_needs_no_autobaud_byte(clock: ManualClock) -> None:
    Sabertooth(clock, autobaud=False).play("0 64; 1 s; units is 64 0")


def test_two_drivers_share_a_line_by_address(clock: ManualClock) -> None:
    drivers = [SabertoothDouble(clock, address, autobaud=False) for address in (128, 135)]
    for driver in drivers:
        driver.receive(packet(0, 127, 135))
    clock.advance(1_000_000_000)
    assert [driver.speeds for driver in drivers] == [(0, 0), (1, 0)]


def test_the_timeout_ends_the_turn_at_its_instant(driver: Sabertooth) -> None:
    driver.play("14 3", AHEAD, "3600 s")
    assert driver.chip.turned_rad(driver.clock()) == pytest.approx((12.7 * 0.3, 12.7 * 0.3))


@pytest.mark.parametrize(
    ("ramping", "step_ns"),
    [(1, 1_000_000), (2, 500_000), (10, 100_000), (11, 65_573_770), (20, 6_557_377), (80, 936_768)],
)
def test_ramping_sets_the_time_of_each_of_256_steps(
    driver: Sabertooth, ramping: int, step_ns: int
) -> None:
    driver.play(f"16 {ramping}; 0 127; {100 * step_ns - 1} ns; units is 99 0; 1 ns; units is 100 0")
    driver.play(f"{27 * step_ns} ns; units is 127 0")


def test_a_fresh_driver_goes_from_full_reverse_to_full_forward_in_a_quarter_second(
    clock: ManualClock,
) -> None:
    driver = Sabertooth(clock, speed=127.0)
    driver.play("S aa; 1 127; 1 s; 0 127; 253 ms; units is 126 0; 1 ms; units is 127 0")
    # 0, -1 to -126 and a stand at -127; then as much up as down but for the last step
    turned = -(0.126 * 127 / 2 + 127 * (1 - 0.127)) - 127 * 0.001
    assert driver.chip.turned_rad(clock())[0] == pytest.approx(turned)


def test_the_world_advances_before_its_course_changes(driver: Sabertooth) -> None:
    at: list[int] = []
    driver.chip.motors.before_change = lambda: at.append(driver.clock())
    driver.play(AHEAD, "1 s", AHEAD, "S 80 00 00 00 80 04 00 04")
    assert at == [0, 0, 1_000_000_000, 1_000_000_000]


def test_a_motor_is_on_while_it_is_driven_and_not_while_it_runs_down(clock: ManualClock) -> None:
    driver = Sabertooth(clock)
    driver.play("S aa; 16 11; 14 3; 0 127")  # a ramp of a second and a half; silence is 0.3 s
    assert driver.chip.outputs_on(clock()) == 1, "at its first step"
    clock.advance(2 * TENTH)
    assert driver.chip.speeds[0] > 0
    driver.play("0 0")
    assert (driver.chip.speeds[0] > 0, driver.chip.outputs_on(clock())) == (True, 0)
    driver.play("4 127")
    assert driver.chip.outputs_on(clock()) == 1
    assert driver.chip.outputs_on(clock() + 3 * TENTH) == 0, "silence has stopped it"
