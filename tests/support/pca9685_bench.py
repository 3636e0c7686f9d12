"""An actuator on a PCA9685's double, its interlock a switch of the test."""

from collections.abc import Callable

from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.esc import Esc, EscSettings
from firmware_drivers.hardware import HardwareModel

from firmware_runtime.devs.time import NEVER, SECOND
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.faults import FaultScript, NackAddress
from sim_doubles.i2c_bus import I2cBusDouble
from tests.support.scripted_bench import PlayedBench

Interlock = Callable[[], bool]


class Pca9685Bench(PlayedBench):
    """The model that `build` makes of chip and interlock; `double` is the chip's."""

    def __init__(
        self, build: Callable[[Pca9685, Interlock], HardwareModel], *, enabled: bool = True
    ) -> None:
        self.is_simulated = False
        self.enabled = enabled
        self.double = Pca9685Double(self.now)
        self.bus = I2cBusDouble("i2c1", self.now, [self.double])
        self.actuator = build(Pca9685(self.bus), lambda: self.enabled)
        super().__init__(self.actuator)
        self.is_simulated = True

    def now(self) -> int:
        return self.simulator.now if self.is_simulated else 0

    def switch(self) -> None:
        """Enable the outputs or disable them."""
        self.enabled = not self.enabled

    @property
    def unready(self) -> str:
        return self.actuator.unready() or ""

    @property
    def running(self) -> str:
        return str(self.double.running)

    @property
    def off(self) -> str:
        return str(self.double.all_off)

    def act(self, line: str) -> None:
        """Let the chip lose its supply, refuse so often, or the interlock switch."""
        if line == "power cycle":
            self.bus.power_cycle()
        elif line == "switch":
            self.switch()
        else:
            self.refuse(int(line.removeprefix("refuse ")))

    def refuse(self, times: int) -> None:
        """Let the chip acknowledge nothing, so many times."""
        self.bus.faults = FaultScript([NackAddress(times=times)])


class EscBench(Pca9685Bench):
    @property
    def pulse_us(self) -> str:
        return f"{round(self.double.duty(3) * 2000) * 10}"

    @property
    def armed(self) -> str:
        """When it was armed, and disarmed with a minus."""
        return " ".join(f"{at if armed else -at:.12g}" for at, armed in self.said["armed"])


def esc_bench(timeout: int = NEVER, *, enabled: bool = True) -> EscBench:
    """Return an ESC at 50 Hz, still at 1000 us and full at 2000 us, that arms in 3 s."""
    settings = EscSettings(3, 50.0, 1000.0, 2000.0, 3 * SECOND, timeout)
    return EscBench(lambda chip, interlock: Esc("esc", chip, settings, interlock), enabled=enabled)
