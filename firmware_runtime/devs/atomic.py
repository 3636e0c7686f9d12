"""The atomic model: state in plain attributes, five functions, and the field's verbs for time."""

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.time import NEVER


class Atomic(Component):
    """Subclass, declare ports in `__init__`, write the functions the model needs.

    `output` (lambda) is called first and only sends; then exactly one of `internal` (the time
    advance ran out), `external` (input arrived `elapsed` ns after the last transition) or
    `confluent` (both at once) changes the state. The state includes `phase`, a word for people,
    and `sigma`, the time advance in ns; set them with `hold_in`, `passivate`, `activate`, or
    assign `sigma` alone.

    A model whose activations recur with a fixed period states it in `period` (ns), however many
    phases a period has: the executive then accounts for its activations by the clock, and may skip
    whole periods when the loop is late.
    """

    period: int = NEVER

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.phase = "passive"
        self.sigma: int = NEVER

    # The DEVS functions -------------------------------------------------------------------------

    def initialize(self) -> None:
        """Set the initial state; called once, at time zero of the run."""

    def output(self) -> None:
        """Send outputs; must not change the state (lambda)."""

    def internal(self) -> None:
        """The time advance ran out (delta int); by default, wait for input."""
        self.passivate()

    def external(self, elapsed: int) -> None:
        """Input is in the ports, `elapsed` ns after the last transition (delta ext)."""
        self.continue_(elapsed)

    def confluent(self) -> None:
        """Input arrived in the very instant the time advance ran out: internal, then external."""
        self.internal()
        self.external(0)

    def time_advance(self) -> int:
        """Nanoseconds from the last transition to the next internal one."""
        return self.sigma

    def exit(self) -> None:
        """The run has ended, whatever the reason; called once, in reverse order of declaration."""

    # The life of a state ------------------------------------------------------------------------

    def hold_in(self, phase: str, duration: int) -> None:
        """Stay in a phase for `duration` ns."""
        self.phase = phase
        self.sigma = duration

    def activate(self, phase: str = "active") -> None:
        """Go on at this very instant."""
        self.phase = phase
        self.sigma = 0

    def passivate(self, phase: str = "passive") -> None:
        """Wait for input."""
        self.phase = phase
        self.sigma = NEVER

    def continue_(self, elapsed: int) -> None:
        """Keep the phase and what is left of its duration."""
        if self.sigma != NEVER:
            self.sigma -= elapsed
