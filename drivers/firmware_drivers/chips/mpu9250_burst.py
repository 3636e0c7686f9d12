"""The one burst a sample costs on an MPU-9250, and its way from bytes to SI units in body axes.

Registers 0x3A to 0x50, 23 bytes: INT_STATUS, acceleration, temperature and rate (big-endian), then
what the auxiliary master last fetched from the AK8963: ST1, field (little-endian), ST2. Without
magnetometer the burst is 0x38 to 0x48, 17 bytes: it ends after the rate, and begins with
INT_ENABLE, which shows a chip that was reset and goes on at other scales; with one, the fetched
bytes show that.
"""

import struct
from typing import Final, NamedTuple, Self

from msgspec import Struct

from firmware_drivers.chips.ak8963 import BITM, DRDY, HOFL, MEASUREMENT
from firmware_drivers.chips.liveness import Liveness, MeanSquare
from firmware_drivers.chips.mounting import Mounting, Vector
from firmware_drivers.chips.mpu9250_settings import COUNTS_FULL_SCALE, Mpu9250Settings
from firmware_runtime.hal.i2c import Message
from firmware_runtime.hal.wire_errors import SOME_NOISE, Implausible, NotReady, Stuck

INT_ENABLE: Final = 0x38
INT_STATUS: Final = 0x3A
RAW_RDY_EN: Final = 0x01
RAW_DATA_RDY: Final = 0x01
STANDARD_GRAVITY: Final = 9.80665
TEMPERATURE_COUNTS_PER_C: Final = 333.87
TEMPERATURE_AT_ZERO_C: Final = 21.0

MAGNETOMETER_AXES: Final = Mounting((1, 0, 2), (1, 1, -1))
"""The AK8963 sits turned in the package: x and y are swapped, z points down."""

INERTIAL_AXES: Final = (
    *(f"acceleration {axis}" for axis in "xyz"),
    *(f"rate {axis}" for axis in "xyz"),
)
"""Names of the chip's own axes in faults."""
_ENDS: Final = frozenset({-COUNTS_FULL_SCALE, 1 - COUNTS_FULL_SCALE, COUNTS_FULL_SCALE - 1})
"""Counts of a rate at an end of its range."""
GRAVITY_READINGS: Final = 256
FIELD_NOISE_COUNTS: Final = 1.0
"""Fresh noise of a field: the AK8963's data sheet states none, users find 0.3 uT, two counts."""
FIELD_AXES: Final = ("field x", "field y", "field z")
FETCHES_WITHOUT_FIELD: Final = 32
"""In a row; an AK8963 that works has a new measurement for almost every one."""

_INERTIAL: Final = struct.Struct(">B7h")
_FIELD_AT: Final = _INERTIAL.size
NO_BIAS: Final[Vector] = (0.0, 0.0, 0.0)
_SILENCE: Final = (bytes(_FIELD_AT - 1), b"\xff" * (_FIELD_AT - 1))
_UNFETCHED: Final = bytes(MEASUREMENT.size)

SIX_AXES: Final[tuple[Message, ...]] = (
    bytes((INT_ENABLE,)),
    INT_STATUS - INT_ENABLE + _FIELD_AT,
)
NINE_AXES: Final[tuple[Message, ...]] = (bytes((INT_STATUS,)), _FIELD_AT + MEASUREMENT.size)


class InertialSample(NamedTuple):
    """One sample in body axes: specific force in m/s2, rate in rad/s, field in T.

    `field` is None when there is no new measurement, none that is valid, or no magnetometer;
    `field_overflow` says that the field was beyond the sensor's range.
    """

    acceleration: Vector
    rate: Vector
    field: Vector | None
    temperature_c: float
    field_overflow: bool


class InertialChecks:
    """Liveness of the sensors of one chip; it outlasts bring-ups, so that a dead one stays dead.

    The MPU-9250 keeps what it fetched last when the AK8963 stops answering, or is not asked any
    more because its auxiliary bus hangs: then there is no field until a bit changes, and
    `stuck_field` has axis, counts, readings, and what was expected. So it has where no measurement
    is new, or each is beyond the range.
    """

    def __init__(self, place: str, settings: Mpu9250Settings, period_ns: int | None = None) -> None:
        self.stuck_field: tuple[str, float, int, str] | None = None
        self.without_field = 0
        """Readings in a row without a new and valid measurement."""
        repeats = settings.readings_a_fetch(period_ns)
        self._most_without_field = FETCHES_WITHOUT_FIELD * repeats
        self.inertial = Liveness(place, INERTIAL_AXES, settings.fresh_counts())
        self.gravity = MeanSquare(
            place,
            "acceleration",
            "g",
            scale=settings.accel_range_g / COUNTS_FULL_SCALE,
            limits=settings.mean_acceleration_g,
            readings=GRAVITY_READINGS,
        )
        self.field = Liveness(place, FIELD_AXES, (FIELD_NOISE_COUNTS,) * 3, repeats=repeats)

    def restart(self) -> None:
        """Go on after a bring-up: what was stuck has yet to change."""
        self.inertial.restart()
        self.field.restart()

    def note_stuck_field(self, error: Stuck) -> None:
        """Take a new and valid measurement that repeats itself."""
        self.without_field = 0
        self.stuck_field = error.axis, error.value, error.readings, SOME_NOISE

    def note_no_field(self, st1: int, st2: int) -> None:
        """Take a reading without a new and valid measurement, by its status bytes."""
        self.without_field += 1
        readings = self.without_field
        if readings <= self._most_without_field:
            return
        if st2 & HOFL:
            self.stuck_field = "field overflow", 1, readings, "a field within 4912 uT"
        else:
            is_new = st1 & DRDY
            self.stuck_field = "field data ready", is_new, readings, "new ones, of 16 bits"


class FieldDecoder(Struct, eq=False):
    """Turns the AK8963's part of a burst into tesla in body axes.

    `sensitivity` is in tesla per count of the AK8963's own axes.
    """

    _place: str
    _axes: tuple[int, int, int]
    _factors: Vector

    @classmethod
    def of(cls, place: str, mounting: Mounting, sensitivity: Vector) -> Self:
        """Return the decoder for an AK8963 that is mounted so within the MPU-9250."""
        magnetometer = mounting.of(MAGNETOMETER_AXES)
        return cls(place, magnetometer.axes, magnetometer.factors(sensitivity))

    def decode(self, measurement: bytes, checks: InertialChecks) -> tuple[Vector | None, bool]:
        """Give the field, None if there is no new one that lives, and whether it overflowed.

        Raises NotReady if all is zero: ST2 echoes 16 bits as long as the AK8963 measures as brought
        up, so it or the whole chip was reset, and then ranges and axes are not what we set either.
        """
        st1, hx, hy, hz, st2 = MEASUREMENT.unpack(measurement)
        if st1 & DRDY and st2 & (HOFL | BITM) == BITM:
            field = (hx, hy, hz)
            try:
                checks.field.check(field)
            except Stuck as error:
                checks.note_stuck_field(error)
                return None, False
            checks.stuck_field = None
            checks.without_field = 0
            i, j, k = self._axes
            x, y, z = self._factors
            return (field[i] * x, field[j] * y, field[k] * z), False
        if measurement == _UNFETCHED:
            raise NotReady(
                f"the auxiliary master's data are all zero, expected ST2 {BITM:02x}; "
                "the chip was reset since bring-up",
                where=self._place,
            )
        checks.note_no_field(st1, st2)
        return None, bool(st1 & DRDY and st2 & HOFL)


class BurstDecoder(Struct, eq=False):
    """Turns bursts into samples; built once a bring-up, with all factors multiplied out.

    `acceleration_range` is full scale in m/s2, `rate_range` in rad/s. Without `field`, samples
    have none and bursts are the shorter ones; `messages` is the transaction to decode.
    """

    messages: tuple[Message, ...]
    field: FieldDecoder | None
    _place: str
    _axes: tuple[int, int, int]
    _acceleration: Vector
    _rate: Vector

    @classmethod
    def of(
        cls,
        place: str,
        mounting: Mounting,
        *,
        acceleration_range: float,
        rate_range: float,
        field: FieldDecoder | None,
    ) -> Self:
        """Return the decoder for these ranges."""
        return cls(
            SIX_AXES if field is None else NINE_AXES,
            field,
            place,
            mounting.axes,
            mounting.factors((acceleration_range / COUNTS_FULL_SCALE,) * 3),
            mounting.factors((rate_range / COUNTS_FULL_SCALE,) * 3),
        )

    def decode(
        self, burst: bytes, checks: InertialChecks, rate_bias: Vector = NO_BIAS
    ) -> InertialSample:
        """Turn one burst into a sample, its rate without a bias in rad/s, body axes.

        Raises NotReady if there is none since the burst before, or none at all; Stuck and
        Implausible for one that shows that a sensor is dead, or turns faster than it can read.
        """
        enabled = RAW_RDY_EN
        if self.field is None:
            enabled, burst = burst[0], burst[INT_STATUS - INT_ENABLE :]
        status, ax, ay, az, temperature, gx, gy, gz = _INERTIAL.unpack_from(burst)
        if burst[1:_FIELD_AT] in _SILENCE:
            raise NotReady(
                f"acceleration, temperature and rate all read {burst[1]:02x}, expected "
                "a sample; the chip is absent or was reset",
                where=self._place,
            )
        if enabled != RAW_RDY_EN:
            raise NotReady(
                f"INT_ENABLE reads {enabled:02x}, expected {RAW_RDY_EN:02x}; the chip "
                "was reset since bring-up",
                where=self._place,
            )
        if not status & RAW_DATA_RDY:
            raise NotReady(
                f"INT_STATUS reads {status:02x}", where=self._place, expected="a new sample"
            )
        checks.inertial.check((ax, ay, az, gx, gy, gz))
        acceleration, rate = (ax, ay, az), (gx, gy, gz)
        if not _ENDS.isdisjoint(rate):  # a shock clips an acceleration, and is over
            raise _at_an_end(self._place, rate)
        checks.gravity.check(ax, ay, az)
        field, overflow = None, False
        if self.field is not None:
            field, overflow = self.field.decode(burst[_FIELD_AT:], checks)
        i, j, k = self._axes
        (px, py, pz), (qx, qy, qz) = self._acceleration, self._rate
        bias_x, bias_y, bias_z = rate_bias
        return InertialSample(
            (acceleration[i] * px, acceleration[j] * py, acceleration[k] * pz),
            (rate[i] * qx - bias_x, rate[j] * qy - bias_y, rate[k] * qz - bias_z),
            field,
            temperature / TEMPERATURE_COUNTS_PER_C + TEMPERATURE_AT_ZERO_C,
            overflow,
        )


def _at_an_end(place: str, rates: tuple[int, ...]) -> Implausible:
    """Return what is wrong with a rate that is all the gyro can read: it may be any more."""
    axis, rate = next(each for each in zip("xyz", rates, strict=True) if each[1] in _ENDS)
    expected = "less than the whole range, -32767 to 32767 counts"
    return Implausible(place, f"rate {axis}", rate, expected)
