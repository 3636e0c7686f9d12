"""Double of the Texas Instruments ADS1115, a 16-bit ADC with four inputs on I2C.

Source: TI data sheet SBAS444. Modelled: the four registers and their pointer, single-shot and
continuous conversion with their times and the OS bit, input multiplexer, the six full scales, codes
that stop at 7FFFh and 8000h, the power-up values, reset by general call, and a converter that is
slower or faster than nominal (`rate_error`, within a tenth by the data sheet).

Not modelled: the comparator and the ALERT/RDY pin (their settings are kept and do nothing), noise,
the supply and what it does to inputs beyond it, high-speed I2C. Assumed where the data sheet is
silent: the input is taken when its conversion ends; a setting written during a conversion, of
either mode, counts from the next one; other general calls than 06h are acknowledged and ignored; a
word of one byte is not taken; what is read or written beyond a word is the same register again.
"""

from collections.abc import Callable, Sequence

from firmware_runtime.devs.time import MICROSECOND, NEVER, SECOND
from sim_doubles.chips.protocol_warnings import ProtocolWarnings
from sim_doubles.chips.register_target import RegisterTarget
from sim_doubles.clock import Now
from sim_doubles.i2c_target import Words

SHIPPED_AT = 0x48  # ADDR at GND
GENERAL_CALL, RESET = 0x00, 0x06

CONVERSION, CONFIG = 0, 1
CONFIG_AT_POWER_UP = 0x8583
NAMES = ("Conversion", "Config", "Lo_thresh", "Hi_thresh")

OS, MODE = 0x8000, 0x0100  # Config
WAKES_UP_IN = 25 * MICROSECOND
RATES = (8, 16, 32, 64, 128, 250, 475, 860)  # DR, in samples a second
FULL_SCALES_V = (6.144, 4.096, 2.048, 1.024, 0.512, 0.256, 0.256, 0.256)  # PGA
GROUND = None
INPUTS = (  # MUX: the positive and the negative input
    *((0, 1), (0, 3), (1, 3), (2, 3)),
    *((0, GROUND), (1, GROUND), (2, GROUND), (3, GROUND)),
)
LEAST, LARGEST = -0x8000, 0x7FFF


class Ads1115Double(RegisterTarget):
    """An ADS1115; `inputs` gives the voltages at AIN0 to AIN3 at an instant (ns), in V from GND.

    A plant whose state depends on the host's writes must see every conversion that ended before it
    moves on: call `catch_up` first.
    """

    measured = (Words(0, 1),)

    def __init__(
        self,
        now: Now,
        address: int = SHIPPED_AT,
        *,
        inputs: Callable[[int], Sequence[float]],
        rate_error: float = 0.0,
    ) -> None:
        super().__init__(now, address)
        self.warnings = ProtocolWarnings("ADS1115")
        self._inputs = inputs
        self._stretch = 1 / (1 + rate_error)
        self._is_called = False
        self._lands_at = NEVER
        self._reset()

    def catch_up(self) -> None:
        """Carry out the conversions that have ended by now; only the last leaves a trace."""
        self._at = self._now()
        while self._lands_at <= self._at:
            if self._runs_by == self._registers[CONFIG] and not self._runs_by & MODE:
                self._lands_at += (self._at - self._lands_at) // self._period * self._period
            self._registers[CONVERSION] = self._converted(self._lands_at)
            self.source = self._inputs_chosen
            if self._registers[CONFIG] & MODE:
                self._lands_at = NEVER
            else:
                self._convert(self._lands_at)

    # Bus face

    def start(self, address: int, *, read: bool) -> bool:
        """Answer its own address, and the general call."""
        self._is_called = address == GENERAL_CALL
        return super().start(address, read=read)

    def write(self, byte: int) -> bool:
        """Take pointer and words, or the byte of a general call."""
        if not self._is_called:
            return super().write(byte)
        if byte == RESET:
            self._reset()
        return True

    def _listens_to(self, address: int, *, read: bool) -> bool:
        return address == self.address or (address == GENERAL_CALL and not read)

    def _begin(self) -> None:
        self.catch_up()

    def _point(self, byte: int) -> bool:
        if byte & 0xFC:
            self.warnings.note(f"pointer written 0x{byte:02x}; its upper six bits must be 0")
        self._pointer = byte & 0x03
        return True

    def _width(self, register: int) -> int:  # noqa: ARG002 (all alike)
        return 2

    def _after(self, register: int) -> int:
        return register

    def _read_register(self, register: int) -> int:
        if register == CONFIG:
            return self._registers[CONFIG] | (OS if self._lands_at == NEVER else 0)
        return self._registers[register]

    def _write_register(self, register: int, byte: int) -> None:
        if register == CONVERSION:
            self.warnings.note("Conversion is read-only; the write is ignored")
            return
        if register == CONFIG:
            self._configure(byte)
        else:
            self._registers[register] = byte

    def _cut_short(self, register: int) -> None:
        self.warnings.note(f"{NAMES[register]} written one byte; it has two, and keeps its content")

    # Converting

    @property
    def _inputs_chosen(self) -> int:
        return self._runs_by >> 12 & 0x07

    @property
    def _period(self) -> int:
        return round(SECOND / RATES[self._runs_by >> 5 & 0x07] * self._stretch)

    def _reset(self) -> None:
        self._registers = [0x0000, CONFIG_AT_POWER_UP & ~OS, 0x8000, 0x7FFF]
        self._runs_by = self._registers[CONFIG]
        self._lands_at = NEVER

    def _configure(self, word: int) -> None:
        """Take settings; they count now if nothing is being converted, else from the next one."""
        self._registers[CONFIG] = word & ~OS
        if self._lands_at != NEVER:
            if word & OS:
                self.warnings.note("OS written 1 during a conversion; it does nothing")
        elif word & OS or not word & MODE:
            self._convert(self._at + WAKES_UP_IN)

    def _convert(self, since: int) -> None:
        self._runs_by = self._registers[CONFIG]
        self._lands_at = since + self._period

    def _converted(self, at: int) -> int:
        """Convert the chosen inputs; the code as a register holds it."""
        positive, negative = INPUTS[self._inputs_chosen]
        voltages = self._inputs(at)
        volts = voltages[positive] - (0.0 if negative is GROUND else voltages[negative])
        code = round(volts / FULL_SCALES_V[self._runs_by >> 9 & 0x07] * 0x8000)
        return min(max(code, LEAST), LARGEST) & 0xFFFF
