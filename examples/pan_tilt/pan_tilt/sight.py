"""From four photocells to where the head looks, relative to the light."""

from firmware_drivers.analog_inputs import Voltages

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.time import SECOND
from firmware_runtime.models.motion import Motion


class Sight(Atomic):
    """Turns each reading into how far the head looks `aside`, left of the light, and `above` it.

    Both are differences of two photocells over their sum, -1 to 1.

    waiting --voltages?--> seeing (0) --aside! above! seen!--> waiting

    In the dark there are no differences. `seen` is sent with the first reading, and when it
    changes: 1 for light, 0 for dark.
    """

    def __init__(self, name: str, dark_v: float) -> None:
        super().__init__(name)
        self.voltages = self.in_port("voltages", Voltages)
        self.aside = self.out_port("aside", Motion)
        self.above = self.out_port("above", Motion)
        self.seen = self.out_port("seen", int)
        self.dark_v = dark_v
        self.differences: tuple[Motion, Motion] | None = None
        self.is_light: bool | None = None
        self._has_changed = False
        self._since = 0

    def output(self) -> None:
        """Send what is seen."""
        if self.differences is not None:
            aside, above = self.differences
            self.aside.send(aside)
            self.above.send(above)
        if self._has_changed:
            self.seen.send(int(self.is_light is True))

    def internal(self) -> None:
        """Wait for the next reading."""
        self._has_changed = False
        self.passivate("waiting")

    def external(self, elapsed: int) -> None:
        """Take the newest reading in."""
        self._since += elapsed
        left, right, up, down = self.voltages[-1].volts
        is_light = (left + right + up + down) / 4 >= self.dark_v
        self._has_changed, self.is_light = is_light != self.is_light, is_light
        aside, above = _difference(right, left), _difference(down, up)
        before, seconds = self.differences, self._since / SECOND
        self._since = 0
        if not is_light:
            self.differences = None
        elif before is None or not seconds:
            self.differences = Motion(aside, 0.0), Motion(above, 0.0)
        else:
            rates = ((aside - before[0].position) / seconds, (above - before[1].position) / seconds)
            self.differences = Motion(aside, rates[0]), Motion(above, rates[1])
        self.activate("seeing")


def _difference(one: float, other: float) -> float:
    """The share of one in both, -1 to 1, however bright they are."""
    total = one + other
    return (one - other) / total if total > 0.0 else 0.0
