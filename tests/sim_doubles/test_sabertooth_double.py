"""The Sabertooth's double by bytes; every expected value is worked out by hand."""

import pytest

from sim_doubles.chips.sabertooth import SabertoothDouble
from sim_doubles.clock import ManualClock

MILLISECOND = 1_000_000
SECOND = 1_000_000_000
STOP = bytes.fromhex("80000000 80040004")
FULL_AHEAD = bytes.fromhex("80007f7f 80047f03")


@pytest.fixture
def driver(clock: ManualClock) -> SabertoothDouble:
    """A driver that has got its autobaud byte and jumps to every speed."""
    double = SabertoothDouble(clock, full_speed_rad_s=12.7)
    double.receive(b"\xaa")
    double.receive(packet(16, 0))
    return double


def packet(command: int, value: int, address: int = 128) -> bytes:
    return bytes([address, command, value, (address + command + value) & 0x7F])


def units(driver: SabertoothDouble) -> tuple[int, ...]:
    """Return the speeds in 127ths of full speed."""
    return tuple(round(speed * 127) for speed in driver.speeds)


@pytest.mark.parametrize(
    ("sent", "speeds"),
    [
        ("80003f3f", (63, 0)),
        ("80053f44", (0, -63)),
        ("80007f7f 80047f03", (127, 127)),
        ("80017f00", (-127, 0)),
        ("80060006", (-127, 0)),
        ("80064046", (0, 0)),
        ("80067f05", (127, 0)),
        ("80072027", (0, -64)),  # 32 of 64 steps backwards: -63.5, rounded to even
    ],
)
def test_packets_drive_the_motors(
    driver: SabertoothDouble, sent: str, speeds: tuple[int, int]
) -> None:
    driver.receive(bytes.fromhex(sent))
    assert units(driver) == speeds
    assert driver.warnings == []


def test_speeds_are_a_share_of_full_speed_and_in_rad_a_second(driver: SabertoothDouble) -> None:
    driver.receive(packet(0, 127) + packet(5, 127))
    assert driver.speeds == (1.0, -1.0)
    assert driver.speeds_rad_s == pytest.approx((12.7, -12.7))


def test_a_packet_may_come_in_pieces(driver: SabertoothDouble) -> None:
    for byte in bytes.fromhex("80003f3f"):
        driver.receive(bytes([byte]))
    assert units(driver) == (63, 0)


def test_the_driver_never_sends(driver: SabertoothDouble, clock: ManualClock) -> None:
    assert driver.transmitted(clock()) == b""


def test_nothing_is_taken_before_the_autobaud_byte(clock: ManualClock) -> None:
    driver = SabertoothDouble(clock)
    driver.receive(packet(0, 64))
    clock.advance(SECOND)
    assert driver.speeds == (0, 0)
    assert driver.warnings[0] == (
        "Sabertooth 128: byte 0x80 before the autobaud byte 0xaa; it is ignored"
    )
    assert driver.warnings.total == 4
    driver.receive(b"\xaa" + packet(0, 64))
    clock.advance(SECOND)
    assert units(driver) == (64, 0)


def test_a_model_that_stores_its_baud_rate_needs_no_autobaud_byte(clock: ManualClock) -> None:
    driver = SabertoothDouble(clock, autobaud=False)
    driver.receive(packet(0, 64))
    clock.advance(SECOND)
    assert units(driver) == (64, 0)


def test_more_autobaud_bytes_do_no_harm(driver: SabertoothDouble) -> None:
    driver.receive(b"\xaa\xaa" + packet(0, 64) + b"\xaa" + packet(4, 64))
    assert units(driver) == (64, 64)
    assert driver.warnings == []


@pytest.mark.parametrize(
    ("sent", "warning"),
    [
        ("80003f3e", "packet 80 00 3f 3e has a wrong checksum; it is ignored"),
        ("81003f40", "packet for address 129; it is ignored"),
        ("80003f aa", "packet 80 00 3f cut short; it is ignored"),
        ("3f", "byte 0x3f outside a packet; it is ignored"),
        ("80033f42 80123f51", "command 18 with 63 does not exist; it is ignored"),
        ("80105161", "command 16 with 81 does not exist; it is ignored"),
    ],
)
def test_what_is_no_packet_for_the_driver_is_ignored_with_a_warning(
    driver: SabertoothDouble, sent: str, warning: str
) -> None:
    driver.receive(packet(0, 64))
    driver.receive(bytes.fromhex(sent))
    assert units(driver) == (64, 0)
    assert driver.warnings == [f"Sabertooth 128: {warning}"]
    driver.receive(packet(0, 0))
    assert units(driver) == (0, 0)


def test_an_address_byte_begins_a_packet_wherever_it_comes(driver: SabertoothDouble) -> None:
    driver.receive(bytes.fromhex("8000 80003f3f"))
    assert units(driver) == (63, 0)
    assert driver.warnings == ["Sabertooth 128: packet 80 00 cut short; it is ignored"]


def test_two_drivers_share_a_line_by_address(clock: ManualClock) -> None:
    drivers = [SabertoothDouble(clock, address, autobaud=False) for address in (128, 135)]
    for driver in drivers:
        driver.receive(packet(0, 100, 135))
    clock.advance(SECOND)
    assert [units(driver) for driver in drivers] == [(0, 0), (100, 0)]


def test_mixed_mode_waits_for_drive_and_turn(driver: SabertoothDouble) -> None:
    driver.receive(packet(8, 50))
    assert units(driver) == (0, 0)
    driver.receive(packet(10, 20))
    assert units(driver) == (70, 30)
    driver.receive(packet(9, 50))
    assert units(driver) == (-30, -70)


@pytest.mark.parametrize(
    ("drive", "turn", "speeds"),
    [
        ((8, 100), (11, 60), (40, 127)),
        ((9, 100), (10, 60), (-40, -127)),
        ((12, 64), (13, 127), (127, -127)),
        ((12, 127), (13, 64), (127, 127)),
        ((12, 0), (13, 0), (-127, 0)),
    ],
)
def test_mixed_commands_add_up_within_full_speed(
    driver: SabertoothDouble,
    drive: tuple[int, int],
    turn: tuple[int, int],
    speeds: tuple[int, int],
) -> None:
    driver.receive(packet(*drive) + packet(*turn))
    assert units(driver) == speeds


def test_changing_between_command_sets_stops_until_new_commands(driver: SabertoothDouble) -> None:
    driver.receive(packet(0, 100) + packet(4, 100))
    driver.receive(packet(8, 50))
    assert units(driver) == (0, 0)
    driver.receive(packet(10, 0))
    assert units(driver) == (50, 50)
    driver.receive(packet(0, 30))
    assert units(driver) == (30, 0)


def test_the_timeout_is_off_at_first(driver: SabertoothDouble, clock: ManualClock) -> None:
    driver.receive(FULL_AHEAD)
    clock.advance(3600 * SECOND)
    assert units(driver) == (127, 127)


def test_silence_longer_than_the_timeout_stops_the_motors(
    driver: SabertoothDouble, clock: ManualClock
) -> None:
    driver.receive(bytes.fromhex("800e0311"))
    driver.receive(FULL_AHEAD)
    clock.advance(300 * MILLISECOND - 1)
    assert units(driver) == (127, 127)
    clock.advance(1)
    assert units(driver) == (0, 0)
    clock.advance(3600 * SECOND)
    assert driver.turned_rad(clock()) == pytest.approx((12.7 * 0.3, 12.7 * 0.3))


def test_the_timeout_runs_from_the_last_packet_for_this_driver(
    driver: SabertoothDouble, clock: ManualClock
) -> None:
    driver.receive(packet(14, 2))
    driver.receive(FULL_AHEAD)
    clock.advance(150 * MILLISECOND)
    driver.receive(packet(4, 127))
    clock.advance(150 * MILLISECOND)
    assert units(driver) == (127, 127)
    driver.receive(packet(0, 127, 129) + bytes.fromhex("80007f00"))
    clock.advance(50 * MILLISECOND)
    assert units(driver) == (0, 0)


def test_after_the_timeout_each_motor_waits_for_its_own_command(
    driver: SabertoothDouble, clock: ManualClock
) -> None:
    driver.receive(packet(14, 1))
    driver.receive(FULL_AHEAD)
    clock.advance(SECOND)
    driver.receive(packet(4, 64))
    assert units(driver) == (0, 64)


def test_mixed_mode_waits_for_both_again_after_the_timeout(
    driver: SabertoothDouble, clock: ManualClock
) -> None:
    driver.receive(packet(14, 1) + packet(8, 50) + packet(10, 0))
    clock.advance(SECOND)
    driver.receive(packet(8, 50))
    assert units(driver) == (0, 0)
    driver.receive(packet(11, 0))
    assert units(driver) == (50, 50)


def test_a_timeout_of_zero_switches_it_off(driver: SabertoothDouble, clock: ManualClock) -> None:
    driver.receive(packet(14, 1) + FULL_AHEAD + packet(14, 0))
    clock.advance(3600 * SECOND)
    assert units(driver) == (127, 127)


def test_a_power_cycle_loses_timeout_and_autobaud(
    driver: SabertoothDouble, clock: ManualClock
) -> None:
    driver.receive(packet(14, 1) + FULL_AHEAD + b"\x80\x00")
    driver.power_cycle()
    assert units(driver) == (0, 0)
    driver.receive(FULL_AHEAD)
    assert units(driver) == (0, 0)
    driver.receive(b"\xaa" + FULL_AHEAD)
    clock.advance(SECOND)
    assert units(driver) == (127, 127)


@pytest.mark.parametrize(
    ("ramping", "step_ns"),
    [(1, 1_000_000), (2, 500_000), (10, 100_000), (11, 65_573_770), (20, 6_557_377), (80, 936_768)],
)
def test_ramping_sets_the_time_of_each_of_256_steps(
    driver: SabertoothDouble, clock: ManualClock, ramping: int, step_ns: int
) -> None:
    driver.receive(packet(16, ramping))
    driver.receive(packet(0, 127))
    clock.advance(100 * step_ns - 1)
    assert units(driver) == (99, 0)
    clock.advance(1)
    assert units(driver) == (100, 0)
    clock.advance(27 * step_ns)
    assert units(driver) == (127, 0)


def test_a_fresh_driver_goes_from_full_reverse_to_full_forward_in_a_quarter_second(
    clock: ManualClock,
) -> None:
    driver = SabertoothDouble(clock, full_speed_rad_s=127.0)
    driver.receive(b"\xaa" + packet(1, 127))
    clock.advance(SECOND)
    driver.receive(packet(0, 127))
    clock.advance(253 * MILLISECOND)
    assert units(driver) == (126, 0)
    clock.advance(MILLISECOND)
    assert units(driver) == (127, 0)
    # 0, -1 to -126 and a stand at -127; then as much up as down but for the last step
    turned = -(0.126 * 127 / 2 + 127 * (1 - 0.127)) - 127 * 0.001
    assert driver.turned_rad(clock())[0] == pytest.approx(turned)


def test_ramping_and_deadband_survive_a_power_cycle(
    driver: SabertoothDouble, clock: ManualClock
) -> None:
    driver.receive(packet(17, 20))
    driver.power_cycle()
    driver.receive(b"\xaa" + packet(0, 19) + packet(4, 20))
    assert units(driver) == (0, 20)
    clock.advance(SECOND)
    assert driver.warnings == []


def test_the_deadband_takes_small_speeds_for_stop(driver: SabertoothDouble) -> None:
    driver.receive(packet(0, 2) + packet(5, 3))
    assert units(driver) == (0, -3)
    driver.receive(packet(17, 10))
    assert units(driver) == (0, 0)
    driver.receive(packet(17, 0))
    assert units(driver) == (0, -3)


def test_battery_limits_and_baud_rate_are_taken_without_effect(driver: SabertoothDouble) -> None:
    driver.receive(packet(2, 10) + packet(3, 60) + packet(15, 4) + packet(0, 64))
    assert units(driver) == (64, 0)
    assert driver.warnings == []


def test_the_world_advances_before_its_course_changes(
    driver: SabertoothDouble, clock: ManualClock
) -> None:
    at: list[int] = []
    driver.motors.before_change = lambda: at.append(clock())
    driver.receive(FULL_AHEAD)
    clock.advance(SECOND)
    driver.receive(FULL_AHEAD)
    driver.receive(STOP)
    assert at == [0, 0, SECOND, SECOND]


def test_an_address_the_switches_cannot_set_is_refused(clock: ManualClock) -> None:
    with pytest.raises(ValueError, match="Sabertooth: address is 0x88, expected 0x80 to 0x87"):
        SabertoothDouble(clock, 136)
