"""A Smith predictor as an atomic model: a controller behind a known delay acts as if it had none.

It stands between measurement and controller, and receives the controller's commands. A model of
the plant without delay says what the commands of the last `delay` will do once they are through;
the controller gets what was measured plus that. The delay may lie on the way to the plant or back.

    predicted = measured + model now - model one delay ago

Source: O. J. M. Smith, "Closer control of loops with dead time", Chemical Engineering Progress 53,
1957. Begun from the measurement it is the predictor of Manitius and Olbrot, "Finite spectrum
assignment problem for systems with delays", IEEE Transactions on Automatic Control 24, 1979.
"""

from collections import deque
from collections.abc import Iterator

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.time import SECOND
from firmware_runtime.models.delay import whole_ns
from firmware_runtime.models.motion import Applied, Motion
from firmware_runtime.models.plant import PlantModel, State, travelled


class SmithPredictor(Atomic):
    """Answers every measurement with the predicted one, at the same instant.

    waiting --measurement?--> predicting (0) --predicted!--> waiting; command? is kept meanwhile

    Couple `predicted` to the controller's measurement, and the controller's command to `command` as
    well as to the plant. Before the first command it was 0, and so it is while an actuator says at
    `applied` that it applies nothing: what it says is as old as the delay, as is what it is about,
    so it holds for all commands that are kept.

    With `from_measurement` the model of one delay ago is put where the plant was measured, so that
    it never drifts away: for a plant that integrates, as a body without a spring does, nothing else
    is stable. A constant disturbance then leaves the prediction off by what it does within one
    delay. Without it, as Smith has it, the model runs on commands alone; no such offset is left,
    but the plant must come to rest by itself.
    """

    def __init__(
        self, name: str, plant: PlantModel, delay: int, *, from_measurement: bool = True
    ) -> None:
        super().__init__(name)
        self.measurement = self.in_port("measurement", Motion)
        self.command = self.in_port("command", float)
        self.applied_in = self.in_port("applied", Applied)
        self.predicted = self.out_port("predicted", Motion)
        self.plant = plant
        self.delay = ns = whole_ns(self, "delay", delay)
        self.from_measurement = from_measurement
        self.prediction: Motion | None = None
        self.commands: deque[tuple[int, float]] = deque([(-ns, 0.0)])
        """When each of the last `delay` was given, and the one in force before."""
        self.applied = Applied.ALL
        self._now = 0
        self._was: State = plant.rest
        self._was_at = -ns

    def output(self) -> None:
        """Send the prediction."""
        if self.prediction is not None:
            self.predicted.send(self.prediction)

    def internal(self) -> None:
        """Wait for the next measurement."""
        self.passivate("waiting")

    def external(self, elapsed: int) -> None:
        """Answer a measurement; keep a command. The last of each counts."""
        self._now += elapsed
        if self.applied_in:
            self.applied = self.applied_in[-1]
        if self.measurement:
            self.prediction = self._predict(self.measurement[-1])
        if self.command:
            self.commands.append((self._now, self.command[-1]))
        if self.measurement:
            self.activate("predicting")
        else:
            self.continue_(elapsed)

    def _predict(self, measured: Motion) -> Motion:
        """Bring the model to one delay ago, then through the commands since."""
        if not self.delay:
            return measured
        self._catch_up(self._now - self.delay)
        if self.from_measurement:
            self._was = (*measured, *self._was[2:])
        was = self._was
        now = travelled(self.plant, was, list(self._held(self._was_at, self._now)))
        return Motion(measured.position + now[0] - was[0], measured.rate + now[1] - was[1])

    def _catch_up(self, at: int) -> None:
        self._was = travelled(self.plant, self._was, list(self._held(self._was_at, at)))
        self._was_at = at
        while len(self.commands) > 1 and self.commands[1][0] <= at:
            self.commands.popleft()

    def _held(self, begin: int, end: int) -> Iterator[tuple[float, float]]:
        """Each command, and for how many seconds between these instants it was held."""
        if self.applied is Applied.NOTHING:
            yield 0.0, (end - begin) / SECOND
            return
        until = [given for given, _ in self.commands][1:]
        for (given, command), over in zip(self.commands, [*until, end], strict=True):
            first, last = max(begin, given), min(end, over)
            if first < last:
                yield command, (last - first) / SECOND
