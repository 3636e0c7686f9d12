"""Everything with a driver that moves something: one output or both motors, and off again."""

from collections.abc import Callable
from typing import Final, NamedTuple

from firmware_drivers.catalogue.identity import MD25_IDENTITY, PCA9685_IDENTITY
from firmware_drivers.catalogue.trial import (
    Actuator,
    OnBus,
    OnPort,
    Option,
    Options,
    Quantity,
    Reading,
)
from firmware_drivers.chips import md25, pca9685_registers, sabertooth
from firmware_drivers.chips.h_bridge import HBridge
from firmware_drivers.chips.md25 import Md25
from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.chips.pca9685_registers import CHANNELS
from firmware_drivers.chips.sabertooth import Sabertooth, SabertoothSettings
from firmware_drivers.treads import TreadDriver
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.hal.wire_errors import NotReady

PWM_ADDRESSES: Final = tuple(each for each in range(0x40, 0x78) if each != 0x70)
PULSE_HZ: Final = 50.0
DUTY_HZ: Final = 1000.0
POLL_NS: Final = 100_000_000
"""Period at which a PCA9685 is checked to be as brought up and set."""
MD25_REPEAT_NS: Final = 500_000_000
"""A quarter of the silence after which an MD25 stops by itself."""
SABERTOOTH_REPEAT_NS: Final = 100_000_000
"""A third of the silence after which a Sabertooth stops by itself, as it is set."""


class _Kept:
    """Registers of a chip after its command: another program that changes them has a reason.

    So the command is not written again, which would overrule a `safe-state` from another terminal.
    """

    def __init__(self, place: str, read: Callable[[], bytes]) -> None:
        self._place = place
        self._read = read
        self._kept: bytes | None = None

    def is_first(self) -> bool:
        """Return whether nothing was written yet. Raises NotReady if registers changed since."""
        if self._kept is None:
            return True
        found = self._read()
        if found != self._kept:
            raise NotReady(
                f"outputs read {found.hex(' ')}, expected {self._kept.hex(' ')}; "
                "another program has changed them, or switched them off",
                where=self._place,
            )
        return False

    def remember(self) -> None:
        """Take what stands there now for what was written."""
        self._kept = self._read()


class _Wave(NamedTuple):
    """Wave of a PWM output: its share of each cycle, and its rate."""

    share: float
    frequency_hz: float
    what: str


def _wave(options: Options) -> _Wave:
    """The wave that the options state. Raises SettingError."""
    duty, pulse_us = options["duty"], options["pulse_us"]
    if (duty is None) == (pulse_us is None):
        raise SettingError("expected either --duty or --pulse-us")
    frequency_hz = options["frequency_hz"] or (DUTY_HZ if pulse_us is None else PULSE_HZ)
    prescale = pca9685_registers.prescale_for(frequency_hz, options["osc_hz"])
    true_hz = pca9685_registers.actual_frequency_hz(prescale, options["osc_hz"])
    if pulse_us is None:
        return _Wave(duty, frequency_hz, f"duty {duty:g} at {true_hz:.0f} Hz")
    share = pulse_us * 1e-6 * true_hz
    if share > 1:
        raise SettingError(f"--pulse-us {pulse_us:g}: longer than a cycle of {1e6 / true_hz:.0f}")
    return _Wave(share, frequency_hz, f"pulses of {pulse_us:g} us at {true_hz:.0f} Hz")


def _pwm_output(bus: I2cBus, address: int, options: Options) -> Actuator:
    channel, wave = options["channel"], _wave(options)
    chip = Pca9685(bus, address, osc_hz=options["osc_hz"])
    kept = _Kept(chip.place, lambda: chip.read_outputs(channel, 1))

    def move() -> Reading:
        chip.poll()
        if kept.is_first():
            chip.set_duties(channel, (wave.share,))
            kept.remember()
        return (Quantity("duty", wave.share, "duty", "", 4),)

    return Actuator(
        place=chip.place,
        promise=f"channel {channel} goes to {wave.what}, its other 15 go off",
        bring_up=lambda: chip.bring_up(wave.frequency_hz),
        move=move,
        off=chip.stop_all,
        repeat_ns=POLL_NS,
    )


def _bridge(bus: I2cBus, address: int, options: Options) -> Actuator:
    chip = Pca9685(bus, address)
    bridge = HBridge(chip, options["pwm"], options["in1"], options["in2"])
    speed: float = options["speed"]
    kept = _Kept(bridge.place, lambda: chip.read_outputs(0, CHANNELS))

    def move() -> Reading:
        chip.poll()
        if kept.is_first():
            (bridge.forward if speed >= 0 else bridge.reverse)(abs(speed))
            kept.remember()
        return (Quantity("speed", speed, "speed", "of full"),)

    return Actuator(
        place=bridge.place,
        promise=f"the motor turns at {speed:g} of full speed, all other outputs go off",
        bring_up=lambda: bridge.bring_up(options["frequency_hz"]),
        move=move,
        off=chip.stop_all,
        repeat_ns=POLL_NS,
    )


def _both_motors(
    chip: TreadDriver, left: float, right: float, move: Callable[[], Reading], repeat_ns: int
) -> Actuator:
    """Both motors of a driver; refuse two speeds of 0, with which nothing would move."""
    if not left and not right:
        raise SettingError("expected --left or --right, or both, other than 0")
    return Actuator(
        place=chip.place,
        promise=f"the left motor turns at {left:g} of full speed, the right at {right:g}",
        bring_up=chip.bring_up,
        move=move,
        off=chip.stop,
        repeat_ns=repeat_ns,
    )


def _md25(bus: I2cBus, address: int, options: Options) -> Actuator:
    chip = Md25(bus, address)
    left, right = options["left"], options["right"]
    kept = _Kept(chip.place, chip.read_speeds)

    def move() -> Reading:
        is_first = kept.is_first()
        report = chip.set_speeds(left, right)
        if is_first:
            kept.remember()
        return (
            Quantity("encoders", (report.left_encoder, report.right_encoder), "encoders", "", 0),
            Quantity("battery_v", report.battery_v, "battery", "V", 1),
            Quantity(
                "currents_a", (report.left_current_a, report.right_current_a), "currents", "A", 1
            ),
        )

    return _both_motors(chip, left, right, move, MD25_REPEAT_NS)


def _sabertooth(port: SerialPort, options: Options) -> Actuator:
    settings = SabertoothSettings(autobaud=not options["stored_baud"])
    chip = Sabertooth(port, options["switches"], settings)
    left, right = options["left"], options["right"]

    def move() -> Reading:
        chip.set_speeds(left, right)
        return (Quantity("speeds", (left, right), "speeds", "of full"),)

    return _both_motors(chip, left, right, move, SABERTOOTH_REPEAT_NS)


def _speed(name: str, what: str, *, default: float | None) -> Option:
    text = f"{what}, a share of full speed, -1 to 1"
    return Option(name, float, text, default, -1, 1, required=default is None)


def _channel(name: str, what: str) -> Option:
    return Option(name, int, f"{what}, 0 to 15", least=0, most=15, required=True)


_BOTH: Final = (
    _speed("left", "the left motor's speed", default=0.0),
    _speed("right", "the right motor's speed", default=0.0),
)
PCA9685: Final = OnBus(
    name="pca9685",
    title="PCA9685: one of its 16 outputs",
    address=0x40,
    addresses=PWM_ADDRESSES,
    moves=True,
    build=_pwm_output,
    options=(
        _channel("channel", "the output"),
        Option("duty", float, "share of the time it is on, 0 to 1", least=0, most=1),
        Option("pulse-us", float, "or how long it is on in every cycle, us", least=0, most=42e3),
        Option(
            "frequency-hz",
            float,
            f"cycles a second; default {DUTY_HZ:g}, with --pulse-us {PULSE_HZ:g}",
        ),
        Option("osc-hz", float, "frequency of its oscillator", pca9685_registers.NOMINAL_OSC_HZ),
    ),
    identity=PCA9685_IDENTITY,
)
H_BRIDGE: Final = OnBus(
    name="h_bridge",
    title="a motor on an H-bridge behind a PCA9685",
    address=0x40,
    addresses=PWM_ADDRESSES,
    moves=True,
    build=_bridge,
    options=(
        _speed("speed", "its speed", default=None),
        _channel("pwm", "the output that makes it fast"),
        _channel("in1", "the output that turns it forward"),
        _channel("in2", "the output that turns it back"),
        Option("frequency-hz", float, "cycles a second", DUTY_HZ),
    ),
)
MD25: Final = OnBus(
    name="md25",
    title="MD25: two motors",
    address=0x58,
    addresses=md25.ADDRESSES,
    moves=True,
    build=_md25,
    options=_BOTH,
    identity=MD25_IDENTITY,
)
SABERTOOTH: Final = OnPort(
    name="sabertooth",
    title="Sabertooth: two motors",
    baud=9600,
    moves=True,
    build=_sabertooth,
    options=(
        *_BOTH,
        Option("switches", int, "its address, 128 to 135", sabertooth.ADDRESSES[0]),
        Option("stored-baud", bool, "it stores its rate and wants no autobaud byte", False),
    ),
)
