"""The contract of a board: what a package says of a kind of robot, and what it may leave out.

An entry point of the group `firmware_runtime.boards` names a `BoardDefinition`, such as
`rover = "rover.definition:BOARD"`, in a module that has board.toml beside it. It may name the
module instead: then `BOARD` is looked up there, or else `SETTINGS` and `build`, and whichever of
`devices`, `serial_devices`, `loads`, `faults`, `RETUNABLE`, `OPTIONAL_COMPONENTS`,
`DOUBLES_RUN_S`, `EXPERIMENTS`, `INPUTS`, `PLANT`, `event_model` and `result_text` there are.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from math import inf
from pathlib import Path
from types import ModuleType
from typing import Any, Generic, Literal, TypeVar

from msgspec import Struct, ValidationError, convert, field

from firmware_runtime.board.experiments import Experiment, Plant, experiment_faults, plant_fault
from firmware_runtime.board.faults import Device, SerialDevice, bus_loads
from firmware_runtime.board.robot import Lines, Robot
from firmware_runtime.board.settings import BoardSettings
from firmware_runtime.devs.component import Component
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.budget import BusLoad

S = TypeVar("S")
DOUBLES_RUN_S = 10.0

_WORDS = {
    "SETTINGS": "settings",
    "RETUNABLE": "retunable",
    "OPTIONAL_COMPONENTS": "optional_components",
    "DOUBLES_RUN_S": "doubles_run_s",
    "EXPERIMENTS": "experiments",
    "INPUTS": "inputs",
    "PLANT": "plant",
}
"""How a module calls what is no function."""
_FUNCTIONS = ("build", "devices", "serial_devices", "loads", "faults", "event_model", "result_text")
_MAY_BE_NONE = ("event_model", "result_text")


def _nothing(_settings: object) -> tuple[()]:
    return ()


def _no_loads(settings: Any) -> dict[str, BusLoad]:  # noqa: ANN401 -- any board's settings
    """Each bus, without any load."""
    return bus_loads(settings.buses, ())


class BoardDefinition(Struct, Generic[S], frozen=True, kw_only=True):
    """A kind of robot. `settings` and `build` are demanded; the rest has defaults.

    The functions are called with the settings as read from board.toml. Raises SettingError for what
    is no schema of a board or no function.
    """

    settings: type[S]
    """The schema of board.toml: derived from `firmware_runtime.board.settings.BoardSettings`."""
    build: Callable[[S, Lines], Robot]
    """The robot on these lines; sends nothing yet."""
    devices: Callable[[S], Sequence[Device]] = _nothing
    """Every chip on an I2C bus that the board needs; for `doctor`, `probe` and `deploy`."""
    serial_devices: Callable[[S], Sequence[SerialDevice]] = _nothing
    """Every chip on a serial port that the board needs."""
    loads: Callable[[S], Mapping[str, BusLoad]] = _no_loads
    """What recurs on each bus; not called where `faults` finds any."""
    faults: Callable[[S], Sequence[str]] = _nothing
    """Everything wrong that no single value shows, a sentence each, with its key.

    Unknown lines, clashes of addresses and lines that no device is on are found without it.
    """
    event_model: Callable[[S, Path | None], Component] | None = None
    """The model alone, its own or that of a `.ma` file, if event files can be run on it."""
    retunable: Mapping[str, Sequence[str]] | Sequence[str] = ()
    """Keys that a running robot takes up by `Robot.retune`, `*` for any word, by the component that
    does: each end of a robot in two processes has its own. A list has all of them at both ends."""
    optional_components: Sequence[str] = ()
    """Components that the top model has with some settings only; [roles] may name them.

    Also ports of components, such as `model.Out4`, which [link] may name.
    """
    doubles_run_s: float = DOUBLES_RUN_S
    """How long a run on doubles takes unless `--for` says."""
    experiments: Mapping[str, Experiment] = field(default_factory=dict)
    """What `firmware-runtime experiment` can do with this board, by name."""
    inputs: Mapping[str, float | Literal["hold"]] = field(default_factory=dict)
    """Input ports of the top model by name: s of silence until outputs are off, or `hold`."""
    result_text: Callable[[Mapping[str, Any]], str] | None = None
    """What the robot did, in a sentence, as the first of the last lines of a run says it.

    It is called with the result of the run: that of the rig, on doubles, or of `Robot.result`.
    """
    plant: Plant | None = None
    """The body that it moves, for `identify` and `tune`; None where there is none of their kind."""

    def __post_init__(self) -> None:
        _check_schema(self.settings)
        for name in _FUNCTIONS:
            value = getattr(self, name)
            if not (callable(value) or (name in _MAY_BE_NONE and value is None)):
                raise SettingError(f"{value!r}: expected a function", where=name)
        _check_values(self.retunable, self.doubles_run_s)
        _check_names(self.optional_components)
        _check_experiments(self.experiments)
        _check_inputs(self.inputs)
        if (fault := plant_fault(self.plant)) is not None:
            raise SettingError(fault)

    @property
    def gains(self) -> Mapping[str, Sequence[str]]:
        """The retunable keys by the component that takes them up; empty where none is named."""
        return self.retunable if isinstance(self.retunable, Mapping) else {}

    @property
    def retunable_keys(self) -> Sequence[str]:
        """Return all retunable keys, each once."""
        if not isinstance(self.retunable, Mapping):
            return self.retunable
        return tuple(dict.fromkeys(key for keys in self.retunable.values() for key in keys))


def _check_values(retunable: object, length: object) -> None:
    """Refuse what are no retunable keys, or no length of a run on doubles."""
    lists = retunable.values() if isinstance(retunable, Mapping) else [retunable]
    for keys in lists:
        if not (isinstance(keys, list | tuple) and all(isinstance(key, str) for key in keys)):
            raise SettingError(f"{keys!r}: expected keys, in a list", where="retunable")
    if not (isinstance(length, int | float) and length > 0):
        raise SettingError(f"{length!r}: expected seconds, above 0", where="doubles_run_s")


def _check_names(names: object) -> None:
    """Refuse what is no list of components."""
    if not (isinstance(names, list | tuple) and all(isinstance(name, str) for name in names)):
        raise SettingError(f"{names!r}: expected names, in a list", where="optional_components")


def _check_experiments(experiments: object) -> None:
    """Refuse what are no experiments by name."""
    if faults := list(experiment_faults(experiments)):
        raise SettingError("; ".join(faults))


def _check_inputs(inputs: object) -> None:
    """Refuse what says of no port how long it may be silent."""
    if not isinstance(inputs, Mapping):
        raise SettingError(f"{inputs!r}: expected timeouts by port", where="inputs")
    for name, stated in inputs.items():
        is_timeout = isinstance(stated, int | float) and 0 < stated < inf
        if not (isinstance(name, str) and (is_timeout or stated == "hold")):
            raise SettingError(
                f"{name!r}: {stated!r}: expected seconds above 0, or 'hold'", where="inputs"
            )


def _check_schema(schema: object) -> None:
    """Refuse what a board.toml cannot be read by."""
    if not (isinstance(schema, type) and issubclass(schema, Struct)):
        raise SettingError(f"{schema!r}: expected a subclass of BoardSettings", where="settings")
    missing = set(BoardSettings.__struct_fields__) - set(schema.__struct_fields__)
    if missing:
        without = f"{schema.__name__} has no {', '.join(sorted(missing))}"
        raise SettingError(without, where="settings", expected="a subclass of BoardSettings")
    with suppress(ValidationError):  # of the values, which are not asked for yet
        _convert_nothing(schema)


def _convert_nothing(schema: type[Struct]) -> None:
    """Have msgspec read every type of a schema. Raises SettingError for one that it refuses."""
    try:
        convert({}, schema)
    except (TypeError, NameError, AttributeError) as error:
        raise SettingError(f"{schema.__name__}: {error}", where="settings") from error


def definition_of(found: object) -> BoardDefinition[Any]:
    """The definition that an entry point leads to, or that its module spells out.

    Raises SettingError for anything else, and for a module without `SETTINGS` or `build`.
    """
    if isinstance(found, BoardDefinition):
        return found
    if isinstance(stated := getattr(found, "BOARD", None), BoardDefinition):
        return stated
    if not isinstance(found, ModuleType):
        raise SettingError("expected a BoardDefinition or a module", where=type(found).__name__)
    missing = [name for name in ("SETTINGS", "build") if not hasattr(found, name)]
    if missing:
        raise SettingError(f"module {found.__name__} has no {' and no '.join(missing)}")
    words = _WORDS | {name: name for name in _FUNCTIONS}
    values = {to: getattr(found, name) for name, to in words.items() if hasattr(found, name)}
    return BoardDefinition(**values)
