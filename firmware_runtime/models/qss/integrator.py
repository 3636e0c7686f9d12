"""What the quantized integrators have in common: ports, quantum, reset, and the guard of steps.

A quantized integrator knows two polynomials of time: the state x, the integral of its input, and
the quantized state q, one degree less, which is what the others see. Where x and q come to differ
by the quantum, q becomes a new segment, which is sent; nothing happens in between. A system of such
integrators solves the disturbed equation x' = f(q), |q - x| <= quantum: for linear systems the
error is therefore bounded at all times (`bound`).

Source: Cellier and Kofman, Continuous System Simulation, Springer 2006, chapters 11 and 12.
"""

from abc import abstractmethod
from math import isfinite
from typing import ClassVar, Final

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.errors import ModelError
from firmware_runtime.devs.time import NEVER
from firmware_runtime.models.qss.segment import LONGEST_S, NANO, Segment

RESOLUTION: Final = 2.0**-46
"""The smallest relative quantum: below it a float hardly resolves the state."""


class Integrator(Atomic):
    """Sends q whenever it differs from x by the quantum; subclasses know degree and rule.

    integrating (until |x - q| = quantum) --out!--> integrating
    integrating --derivative?--> integrating | --reset?--> integrating (0)

    `out` carries q; `state`, if `sends_state`, the exact x whenever its polynomial has changed. The
    quantum, in the unit of x, is `max(quantum, relative_quantum * |x|)`. A value at `reset` becomes
    x at that instant. `steps` counts the segments of q. A step of less than 1 ns is refused with a
    ModelError, as is a derivative of a higher degree than the method takes into account.
    """

    order: ClassVar[int]
    """How many coefficients the segments at `derivative` and `out` have."""
    _is_explicit: ClassVar[bool] = True

    def __init__(
        self, name: str, initial: float, quantum: float, *, relative_quantum: float = 0.0
    ) -> None:
        super().__init__(name)
        self._check(initial, quantum, relative_quantum)
        self.derivative = self.in_port("derivative", Segment)
        self.reset = self.in_port("reset", Segment)
        self.out = self.out_port("out", Segment)
        self.state = self.out_port("state", Segment)
        self.quantum = float(quantum)
        self.relative_quantum = max(float(relative_quantum), RESOLUTION)
        self.sends_state = False
        self.steps = 0
        self._at = 0
        self._x = float(initial)
        self._width = self._quantum_at(self._x)
        self._announces = False
        self._requantizes = True
        self._restarts = True

    def initialize(self) -> None:
        """Send the initial value at once."""
        self._announces = self.sends_state
        self.activate("integrating")

    def output(self) -> None:
        """Send what has changed: the state's polynomial, or the quantized state."""
        seconds = self.sigma * NANO
        if self._announces:
            self.state.send(self.segment_after(seconds))
        if self._requantizes:
            self.out.send(self._quantized_after(seconds))

    def value_at(self, at: int) -> float:
        """The state x at an instant, in ns, from the last transition to the next."""
        return self.segment_after((at - self._at) * NANO)[0]

    @abstractmethod
    def segment_after(self, seconds: float) -> Segment:
        """The polynomial of x from so many seconds after the last transition on."""

    @abstractmethod
    def _quantized_after(self, seconds: float) -> Segment:
        """The segment of q to be sent then."""

    def _restart(self, value: float) -> None:
        """Let x be `value`; q follows at once."""
        if not isfinite(value):
            raise ModelError(f"{self.path}: reset to {value!r}; expected a finite number")
        self._x = value
        self._restarts = True

    def _plan(self, seconds: float) -> None:
        """After input: announce the new polynomial if that is wanted, then wait.

        At the start q is sent again with each further coefficient that becomes known.
        """
        if self._at == 0 and self.steps < self.order and self._is_explicit:
            self._restarts = True
        self._announces = self.sends_state
        self._requantizes = not self._announces
        self.sigma = 0 if self._announces or self._restarts else self._whole(seconds)

    def _plan_quantized(self, seconds: float) -> None:
        """After an announcement: wait until q must be renewed, perhaps not at all."""
        self._announces = False
        self._requantizes = True
        self.sigma = 0 if self._restarts else self._whole(seconds)

    def _plan_step(self, seconds: float) -> None:
        """After q was renewed: a step that time cannot resolve would repeat without end."""
        self._announces = self._restarts = False
        if seconds < NANO:
            raise ModelError(
                f"{self.path}: a step of {seconds:.2g} s with a quantum of {self._width:.3g}; "
                "expected 1 ns or more: choose a larger quantum, or LIQSS2 for a stiff system"
            )
        self.sigma = self._whole(seconds)

    def _whole(self, seconds: float) -> int:
        """Rounded down, so that |x - q| stays within the quantum."""
        if seconds < LONGEST_S:
            return int(seconds * 1e9)
        if seconds != seconds:  # noqa: PLR0124 -- that is what NaN is
            raise ModelError(f"{self.path}: its derivative is no number; expected a finite one")
        return NEVER

    def _refuse_degree(self) -> None:
        raise ModelError(
            f"{self.path}: {type(self).__name__} received a derivative of degree {self.order}; "
            f"expected {self.order} coefficients: give the block that feeds it order={self.order}"
        )

    def _quantum_at(self, value: float) -> float:
        return max(self.quantum, self.relative_quantum * abs(value))

    def _check(self, initial: float, quantum: float, relative_quantum: float) -> None:
        if not isfinite(initial):
            raise ModelError(f"{self.path}: initial is {initial!r}; expected a finite number")
        if not (isfinite(quantum) and quantum > 0.0):
            raise ModelError(f"{self.path}: quantum is {quantum!r}; expected a number above 0")
        if not 0.0 <= relative_quantum < 1.0:
            fault = f"relative_quantum is {relative_quantum!r}; expected 0 or more, below 1"
            raise ModelError(f"{self.path}: {fault}")
