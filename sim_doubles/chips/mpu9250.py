"""Double of the InvenSense MPU-9250: gyroscope, accelerometer, auxiliary master to the AK8963.

Source: RM-MPU-9250A rev. 1.6 (register map), the product specification for start-up times.

Modelled: registers, H_RESET, sleep, start-up, sample clock, ranges, filters as lags, offsets,
self-test, data ready, one sample a burst, FIFO, auxiliary master and bypass. The chip samples by
itself; what it did is worked out when it is looked at, every sample at its own instant and in
order. After a silence longer than its memory the work is bounded (`mpu9250_registers`).

Not modelled: cycle mode and wake-on-motion (registers only), FSYNC, the interrupt pin, DMP, time on
either bus. Assumed: registers hold their power-up values during an H_RESET and writes are
lost; data registers keep the last sample in sleep.
"""

from collections.abc import Callable

from firmware_runtime.devs.time import MILLISECOND, NEVER
from sim_doubles.chips.ak8963 import HOFL, Ak8963Double
from sim_doubles.chips.mpu9250_auxiliary_master import AuxiliaryMaster
from sim_doubles.chips.mpu9250_registers import (
    ACCEL_XOUT_H,
    ANYRD_2CLEAR,
    BYPASS_EN,
    CYCLE,
    EXT_SENS_DATA_00,
    FIFO_COUNTH,
    FIFO_ENABLE,
    FIFO_R_W,
    FIFO_RST,
    H_RESET,
    I2C_IF_DIS,
    I2C_MST_EN,
    I2C_MST_RST,
    I2C_MST_STATUS,
    INT_PIN_CFG,
    INT_STATUS,
    PWR_MGMT_1,
    RAW_DATA_RDY,
    READ_ONLY,
    SIG_COND_RST,
    SIGNAL_PATH_RESET,
    USER_CTRL,
    Fifo,
    SampleClock,
    edges,
    is_sampling,
    power_up,
    sample_period,
)
from sim_doubles.chips.mpu9250_signal_path import SignalPath
from sim_doubles.chips.protocol_warnings import ProtocolWarnings
from sim_doubles.clock import Now
from sim_doubles.i2c_target import Target, Words
from sim_doubles.inertial_truth import Inertia

POWER_UP_TIME = 11 * MILLISECOND
RESET_TIME = 100 * MILLISECOND

CHANGED_BY_READING = frozenset({I2C_MST_STATUS, INT_STATUS, FIFO_COUNTH, FIFO_R_W})


class Mpu9250Double(Target):
    """An MPU-9250 at `address`, powered for long; `inertia` gives the truth at an instant (ns).

    The truth is in the chip's axes and called once a sample, in order of time. `who_am_i` 0x70
    and no magnetometer make it the MPU-6500 found on many modules. With a `magnetometer` put
    `targets` on the bus: the host reaches it at 0x0C through the bypass. `samples` counts the
    samples taken, without those that left no trace. `noise_seed` chooses the part's noise; None
    where the truth is noisy already, or a test wants exact values: a driver finds such a part dead.

    A plant whose state depends on the host's writes must see every sample taken before it moves
    on: call `catch_up` first, for example in `Pca9685Double.before_change`.
    """

    measured = (Words(0x3B, 3), Words(0x43, 3), Words(0x4A, 3, "little", overflow=(0x50, HOFL)))
    """Acceleration, rate, and the field that its master has read."""

    def __init__(  # noqa: PLR0913 (what varies between modules, one line each)
        self,
        now: Now,
        inertia: Callable[[int], Inertia],
        address: int = 0x68,
        *,
        who_am_i: int = 0x71,
        magnetometer: Ak8963Double | None = None,
        reset_time: int = RESET_TIME,
        noise_seed: int | None = 1,
    ) -> None:
        self.address = address
        self.warnings = ProtocolWarnings(f"MPU-9250 0x{address:02x}")
        self.samples = 0
        self._now = now
        self._inertia = inertia
        self._magnetometer = magnetometer
        self.reset_time = reset_time
        """How long an H_RESET takes, ns."""
        self._power_up = power_up(who_am_i)
        self._registers = bytearray(self._power_up)
        self._clock = SampleClock()
        self._signal_path = SignalPath(self._registers, f"MPU-9250 0x{address:02x}", noise_seed)
        self._sampled_at = 0
        self._master = AuxiliaryMaster(self._registers, magnetometer)
        self._fifo = Fifo(self._registers, self.warnings)
        self._pointer = 0
        self._is_sample_due = False
        """The last sample is not in the data registers yet: it is put there when they are read."""
        self._in_transaction = self._expects_pointer = False
        self._at = self._answers_from = now()
        self._reset_ends_at = NEVER
        self._reset()
        self._signal_path.skip_start_up(self._at)
        if magnetometer is not None:
            magnetometer.host_reaches = self._switches_host_through

    # World face

    @property
    def targets(self) -> tuple[Target, ...]:
        """Return the targets for the bus: this chip, and its magnetometer behind the bypass."""
        return (self,) if self._magnetometer is None else (self, self._magnetometer)

    @property
    def content(self) -> bytes:
        """Return what stands in its 128 registers by now; that reads none, so it clears none."""
        self.catch_up()
        if self._is_sample_due:
            self._fill_data_registers()
        return bytes(self._registers)

    def catch_up(self) -> None:
        """Take every sample due up to now, the magnetometer's among them, in order of time."""
        read_clock = self._now  # as a local, which CPython calls sooner
        now = read_clock()
        if now >= self._reset_ends_at:
            self._end_reset()
        self._at = now
        if now >= self._clock.next_at:
            for at in self._clock.take(now, self._edges):
                self._sample(at)
            self._is_sample_due = True
        magnetometer = self._magnetometer
        if magnetometer is not None and now >= magnetometer.lands_at:
            magnetometer.advance(now)

    def power_cycle(self) -> None:
        """Lose supply and get it back, the magnetometer too; deaf for 11 ms, gyro up in 35 ms."""
        self._at = self._now()
        self._answers_from = self._at + POWER_UP_TIME
        self._reset_ends_at = NEVER
        self._reset()
        if self._magnetometer is not None:
            self._magnetometer.power_cycle()

    # Bus face

    def start(self, address: int, *, read: bool) -> bool:
        """Answer the hardware address; samples due by then are taken, later ones wait for STOP."""
        if address != self.address:
            return False
        if not self._in_transaction:
            self.catch_up()
            if self._at < self._answers_from or self._registers[USER_CTRL] & I2C_IF_DIS:
                return False
            self._in_transaction = True
        self._expects_pointer = not read
        if read and self._is_sample_due:
            self._fill_data_registers()
        return True

    def write(self, byte: int) -> bool:
        """Take the pointer, then register contents."""
        if self._expects_pointer:
            self._expects_pointer = False
            self._pointer = byte & 0x7F
        else:
            if self._at != self._now():  # a message takes time on the wire
                self.catch_up()
            self._write_register(self._pointer, byte)
            self._step_pointer()
        return True

    def read(self) -> int:
        """Give the register at the pointer, with the side effects reading it has."""
        register = self._pointer
        if register in CHANGED_BY_READING:
            value = self._read_changing(register)
        else:
            value = self._registers[register]
        if self._any_read_clears:
            self._registers[INT_STATUS] = 0
        self._step_pointer()
        return value

    def read_bytes(self, length: int) -> bytes:
        """Give registers in a row, all at once where reading changes no later one of them."""
        first = self._pointer
        end = first + length
        if end > FIFO_COUNTH or (self._any_read_clears and first != INT_STATUS):
            return super().read_bytes(length)
        registers = self._registers
        values = bytes(registers[first:end])
        if first <= INT_STATUS < end:
            registers[INT_STATUS] = 0
        if first <= I2C_MST_STATUS < end:
            registers[I2C_MST_STATUS] = 0
        self._pointer = end
        return values

    def stop(self) -> None:
        """End the transaction: the data registers may change again."""
        self._in_transaction = False

    def _step_pointer(self) -> None:
        if self._pointer != FIFO_R_W:
            self._pointer = self._pointer + 1 & 0x7F

    def _read_changing(self, register: int) -> int:
        if register == FIFO_R_W:
            return self._fifo.pop()
        if register == FIFO_COUNTH:
            return self._fifo.latch_count()
        value = self._registers[register]
        self._registers[register] = 0
        return value

    def _switches_host_through(self) -> bool:
        self.catch_up()
        bypass = self._registers[INT_PIN_CFG] & BYPASS_EN
        return bool(bypass) and not self._registers[USER_CTRL] & I2C_MST_EN

    # Registers

    def _reset(self) -> None:
        self._is_sample_due = False
        self._registers[:] = self._power_up
        self._fifo.clear()
        self._clock.stop()
        self._signal_path.switch_off(self._at)
        self._configure()

    def _end_reset(self) -> None:
        """Wake up from a reset at the instant it was over."""
        self._at, self._reset_ends_at = self._reset_ends_at, NEVER
        self._registers[PWR_MGMT_1] &= ~H_RESET
        self._configure()

    def _fill_data_registers(self) -> None:
        self._is_sample_due = False
        self._registers[ACCEL_XOUT_H:EXT_SENS_DATA_00] = self._signal_path.sample(self._sampled_at)

    def _write_register(self, register: int, byte: int) -> None:
        if self._is_sample_due:  # by the settings it was taken with
            self._fill_data_registers()
        if self._reset_ends_at != NEVER:
            self.warnings.note(f"register 0x{register:02x} written during H_RESET; it is lost")
        elif register in READ_ONLY:
            self.warnings.note(f"register 0x{register:02x} is read-only; the real chip ignores it")
        elif register == FIFO_R_W:
            self._fifo.push(bytes([byte]))
        elif register == SIGNAL_PATH_RESET:
            self._signal_path.forget(byte)
        else:
            self._registers[register] = byte
            if register == USER_CTRL:
                self._write_user_control(byte)
            elif register == PWR_MGMT_1:
                self._write_power_management(byte)
            self._configure()

    def _write_user_control(self, byte: int) -> None:
        if byte & FIFO_RST:
            self._fifo.reset(byte)
        if byte & I2C_MST_RST:
            self._registers[I2C_MST_STATUS] = 0
        if byte & SIG_COND_RST:
            self._signal_path.forget(0b111)
            self._registers[ACCEL_XOUT_H:0x61] = bytes(0x61 - ACCEL_XOUT_H)
        if byte & I2C_IF_DIS:
            self.warnings.note("I2C_IF_DIS set over I2C; the real chip is deaf until a power cycle")
        self._registers[USER_CTRL] &= ~(FIFO_RST | I2C_MST_RST | SIG_COND_RST)

    def _write_power_management(self, byte: int) -> None:
        if byte & H_RESET:
            self._reset()
            self._registers[PWR_MGMT_1] |= H_RESET
            self._reset_ends_at = self._at + self.reset_time
        elif byte & CYCLE:
            self.warnings.note("CYCLE set; this double does not model it and samples on")

    def _configure(self) -> None:
        """Recompute what follows from the registers."""
        running = is_sampling(self._registers)
        period = sample_period(self._registers)
        if running:
            self._clock.run(period, self._at)
        else:
            self._clock.stop()
        self._signal_path.configure(self._at, period, running=running)
        self._edges = edges(self._registers, self._signal_path.memory)
        self._master.configure()
        self._any_read_clears = self._registers[INT_PIN_CFG] & ANYRD_2CLEAR

    # Samples

    def _sample(self, at: int) -> None:
        self.samples += 1
        self._sampled_at = at
        magnetometer = self._magnetometer
        if magnetometer is not None and at >= magnetometer.lands_at:
            magnetometer.advance(at)
        if self._master.enabled:
            self._master.run(at, self._clock.number(at))
        inertia = self._inertia
        if self._signal_path.take(at, inertia(at)):
            self._registers[INT_STATUS] |= RAW_DATA_RDY
            if self._registers[USER_CTRL] & FIFO_ENABLE:
                self._fill_data_registers()
                self._fifo.push_sample(self._master.fifo_bytes())
