"""A rig: a board's chips as doubles on their buses, tied to its world."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.ports import OutPort
from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.interlock import EnableLine
from firmware_runtime.hal.serial import SerialPort

if TYPE_CHECKING:
    from firmware_runtime.view.parts import Page


class Doubles(Protocol):
    """Doubles on their lines, in this process or in another one."""

    @property
    def buses(self) -> Mapping[str, I2cBus]:
        """The buses by their names in board.toml."""

    @property
    def ports(self) -> Mapping[str, SerialPort]:
        """The serial ports by their names in board.toml."""

    @property
    def enable(self) -> EnableLine | None:
        """Line that lets the PWM outputs through, if the board has one."""

    def result(self, elapsed: int, own: Mapping[str, object]) -> dict[str, object]:
        """Return how a run of `elapsed` ns ended, by the true state of the world now.

        `own` is what the robot itself knows about it.
        """

    @property
    def outputs(self) -> dict[str, int]:
        """Number of outputs that are on, by actuating chip."""


class Rig(Doubles, Protocol):
    """Doubles in this process, and the world behind them.

    A rig with an attribute `world` lets programs look at that, see `firmware_runtime.open_board`.
    One with an attribute `plane`, a `firmware_runtime.view.parts.Plane` whose bodies are bound to
    ports, shows its world from above on a page that is alive.
    """

    @property
    def shown(self) -> OutPort[float] | None:
        """The port whose values a person wants to see over time, if there is one."""

    def attach(self, robot: Coupled) -> None:
        """Add the world's probe beside the robot's own models."""

    def catch_up(self) -> None:
        """Let sensors that sample by themselves take what they have to, and the world go on."""

    def levels(self, at: int) -> dict[str, float]:
        """Return how each output stands at `at`, not in the past: a share of its time, or rad/s."""

    def next_change_at(self, at: int) -> int:
        """The first instant after `at` at which an output changes if its chip is left alone."""


@runtime_checkable
class Drawn(Protocol):
    """A rig that can show a run as a page."""

    def draw(self, until: int, own: Mapping[str, object], reason: str) -> "Page":
        """The run up to an instant, and how it ended.

        `own` is what the robot itself knows about that, `reason` why the run was over.
        """


@runtime_checkable
class Truthful(Protocol):
    """A rig that says how its world truly is: what its probe would send, for those who look on."""

    def truth(self) -> dict[str, object]:
        """Return the values of the probe's ports now, by their paths below the robot."""


@runtime_checkable
class Pushable(Protocol):
    """A rig whose robot can be pushed."""

    push_unit: str
    """Unit and direction of a push, such as `rad/s of yaw`."""

    def catch_up(self) -> None:
        """Let the world go on up to now."""

    def push(self, amount: float) -> None:
        """Push the robot now: an impulse; the world has been brought up to now."""


@runtime_checkable
class Holdable(Protocol):
    """A rig whose robot can be held, as by a hand or by something that it is caught in."""

    def catch_up(self) -> None:
        """Let the world go on up to now."""

    def hold(self, *, is_held: bool) -> None:
        """Hold the robot where it is from now on, or let go of it; the world is up to now."""


@runtime_checkable
class Driven(Protocol):
    """A rig that knows whether something is moved, where outputs alone do not say it."""

    @property
    def is_driven(self) -> bool:
        """Whether outputs move something; a brake does not."""


@runtime_checkable
class Losable(Protocol):
    """A rig whose robot can come to a state that it cannot leave by itself, such as on its side."""

    def lost(self) -> str | None:
        """Return why its robot cannot go on, a sentence; None while it can."""


@runtime_checkable
class Judging(Protocol):
    """A rig with an oracle of its own for campaigns of faults (`firmware_runtime.lab.campaign`)."""

    def judge(self) -> str | None:
        """Return what is wrong with its world now, a sentence; None where nothing is."""


@runtime_checkable
class Purposeful(Protocol):
    """A rig that knows what its robot is for: a mission without any fault has to come to that."""

    def missed(self) -> str | None:
        """Return what its robot should have done by now and has not, a sentence; else None."""


@runtime_checkable
class Noted(Protocol):
    """A line of doubles that notes what a real chip would ignore, refuse or leave undefined."""

    @property
    def warnings(self) -> Sequence[str]:
        """Return these notes, a sentence each."""
