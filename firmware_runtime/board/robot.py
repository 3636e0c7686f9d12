"""A robot ready to run: its model, and how to find its chips and to switch it off.

Lines are I2C buses, serial ports and an enable line, named by board.toml.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, Final, NamedTuple

from msgspec import Struct, field

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled, with_all_below
from firmware_runtime.devs.ports import OutPort
from firmware_runtime.errors import ConfigError, FirmwareRuntimeError, text_of
from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.interlock import EnableLine, Interlock, always_enabled
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.hal.unopened_lines import AbsentBus, AbsentPort
from firmware_runtime.hal.wire_errors import HalError


class Lines(Struct, frozen=True):
    """Real ones, doubles, or absent ones: a board's wiring sees no difference."""

    buses: Mapping[str, I2cBus]
    ports: Mapping[str, SerialPort] = field(default_factory=dict)
    interlock: Interlock = always_enabled
    """Output interlock, checked before every write that could."""
    enable: EnableLine | None = None
    """What lets the PWM outputs through, where it is wired."""


def absent_lines(buses: Iterable[str], ports: Iterable[str] = ()) -> Lines:
    """Lines of these names on which nothing can be sent, for a robot that is only built."""
    return Lines(
        {name: AbsentBus(name) for name in buses}, {name: AbsentPort(name) for name in ports}
    )


class Ending(NamedTuple):
    """Ending of a run: its reason, and whether something went wrong."""

    reason: str
    failed: bool


def _keep(_settings: object) -> None:
    """Nothing is retunable."""


def _are_functions(value: object) -> bool:
    return isinstance(value, Sequence) and all(map(callable, value))


def _are_sentences(value: object) -> bool:
    return isinstance(value, list | tuple) and all(isinstance(each, str) for each in value)


def _may_be_port(value: object) -> bool:
    return isinstance(value, OutPort | None)


_PARTS: Final[Mapping[str, tuple[Callable[[object], bool], str]]] = {
    **dict.fromkeys(("probe", "stop", "still_on"), (_are_functions, "functions")),
    **dict.fromkeys(("result", "retune"), (callable, "a function")),
    **dict.fromkeys(("ended", "shown"), (_may_be_port, "an OutPort or None")),
    **dict.fromkeys(("warnings", "unseen"), (_are_sentences, "sentences, in a list")),
    "result_from": (_are_sentences, "names of components, in a list"),
}
"""What each part of a robot has to be, and how a sentence says so."""


def declaring(model: Coupled, what: str) -> tuple[str, ...]:
    """Return the components that declare `lines` or `drives`, or have one below that does.

    `lines` are the buses and ports that a component is on, `drives` is True where it moves
    something. In order of declaration.
    """
    return tuple(
        name
        for name, component in model.components.items()
        if any(getattr(each, what, False) for each in with_all_below(component))
    )


class Robot(Struct, frozen=True):
    """Robot made by a board's wiring of settings and buses: a model, probes, stops, and more."""

    model: Coupled
    probe: Sequence[Callable[[], None]]
    """In order: silences what could interfere, then asks each chip who it is. Raises HalError."""
    stop: Sequence[Callable[[], None]]
    """Each writes one chip's safe state, which is full-off, not neutral. Raises HalError."""
    result: Callable[[], dict[str, object]] = dict
    """How the run ended, by what the robot itself knows; None where it knows nothing."""
    result_from: Sequence[str] = ()
    """Components that `result` reads: one end of a robot in two processes has none without them."""
    ended: OutPort[Ending] | None = None
    """Where the model says that its task is over, if it ever does."""
    ends_on_failure: bool = True
    """Whether a task that failed ends the run; otherwise it goes on with everything stopped."""
    retune: Callable[[Any], None] = _keep
    """Takes up gains and limits from new settings of the board, while the robot runs."""
    warnings: Sequence[str] = ()
    """What works less well than it should, found while the chips were brought up."""
    shown: OutPort[float] | None = None
    """The port whose values a person wants to see over time; on doubles the rig has the say."""
    still_on: Sequence[Callable[[], str | None]] = ()
    """Each reads one chip back: what it still drives, in a sentence. Raises HalError."""
    unseen: Sequence[str] = ()
    """What drives something and cannot be read back."""

    def fault(self) -> str | None:
        """Return what it has that can be neither run nor switched off, in a sentence."""
        if not isinstance(self.model, Component):
            return f"model: {self.model!r}: expected a Coupled"
        for part, (is_sound, expected) in _PARTS.items():
            if not is_sound(value := getattr(self, part)):
                return f"{part}: {value!r}: expected {expected}"
        return None

    def find_chips(self) -> None:
        """Raise the HalError of the first chip that is missing or another one; actuate nothing.

        Raises ConfigError for a step that has a defect.
        """
        for step in self.probe:
            with self._named("probe"):
                step()

    def own_result(self) -> dict[str, object]:
        """Return how the run ended, by the robot itself. Raises ConfigError for a defect."""
        with self._named("result"):
            return dict(self.result())

    @contextmanager
    def _named(self, part: str) -> Iterator[None]:
        """Raise ConfigError for what a part raises that is no sentence of ours yet."""
        try:
            yield
        except FirmwareRuntimeError:
            raise
        except Exception as error:
            found = f"{part}: {type(error).__name__}: {text_of(error)}"
            raise ConfigError.of_one(f"robot {self.model.name}", found) from error

    def outputs_on(self) -> list[str]:
        """Return what is on, or cannot be read back at the moment; one sentence each."""
        found: list[str] = []
        for read_back in self.still_on:
            try:
                on = read_back()
            except Exception as error:  # noqa: BLE001 -- a defect must not hide the next chip
                on = f"{text_of(error)}; not read back"
            if on is not None:
                found.append(on)
        return found

    def make_safe(self) -> list[str]:
        """Write every safe state, each on its own; return what failed, one sentence each."""
        failures: list[str] = []
        for stop in self.stop:
            try:
                stop()
            except HalError as error:
                failures.append(text_of(error))
            except BaseException as error:  # noqa: BLE001 -- nothing must keep the next chip on
                failures.append(f"{type(error).__name__}: {text_of(error)}")
        return failures
