"""A model alone on any clock: no board, no chips, nothing to switch off."""

from collections.abc import Iterable, Mapping, Sequence
from os import PathLike
from types import MappingProxyType
from typing import Any, TypeAlias, cast

from msgspec.structs import replace

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.ports import InPort, Listener, OutPort
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.clocks import Clock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.executive import DEFAULT, Executive
from firmware_runtime.links.dover.dover import DoverBlocks, DoverLink
from firmware_runtime.runs.open_run import OpenRun, RunResult
from firmware_runtime.runs.options import (
    ClockName,
    clock_faults,
    clock_name,
    clock_of,
    demand,
    end_after,
    path_of,
)
from firmware_runtime.statistics.paths import check_ending

Inputs: TypeAlias = Iterable[tuple[float, InPort[Any], object]]
"""What arrives at the model's input ports: at which second, where, and the value."""
Listeners: TypeAlias = Mapping[OutPort[Any], Listener[Any]]
"""What is called for every value that leaves a port: with the instant in ns, and the value."""

_NO_LISTENERS: Listeners = MappingProxyType({})


def open_model(
    model: Component,
    *,
    clock: ClockName | Clock = "monotonic",
    speed: float | None = None,
    statistics: str | PathLike[str] | None = None,
    configuration: Configuration = DEFAULT,
) -> OpenRun:
    """A model ready to run, once or in stretches; close it, or use it as a context manager.

    `speed` is how many times as fast the scaled clock goes. `statistics` is where other processes,
    such as `firmware-runtime top FILE`, can watch the run. `configuration` has overrun policies,
    deadlines and the system settings. Blocks of `models.dover` speak with the network, but in
    virtual time. Raises ConfigError, and ModelError for a model that cannot be simulated.
    """
    if not isinstance(model, Component):
        raise ConfigError("run", [f"{model!r}: expected a model, atomic or coupled"])
    name = clock_name(clock, speed)
    if faults := clock_faults(name, speed, doubles=True):
        raise ConfigError("run", faults)
    is_configuration = isinstance(configuration, Configuration)
    demand("configuration", configuration, "a Configuration", is_sound=is_configuration)
    if (path := path_of("statistics", statistics)) is not None:
        check_ending(path)
        configuration = replace(configuration, statistics_path=path)
    chosen = clock_of(clock, speed)
    blocks = DoverBlocks(model, chosen)
    executive = Executive(model, chosen, configuration=configuration)
    return OpenRun(executive, DoverLink(blocks, executive) if blocks else None)


def run(  # noqa: PLR0913 -- each may be left out, and has a name
    model: Component,
    *,
    for_s: float | None = None,
    clock: ClockName | Clock = "monotonic",
    speed: float | None = None,
    inputs: Inputs = (),
    listen: Listeners = _NO_LISTENERS,
    statistics: str | PathLike[str] | None = None,
    configuration: Configuration = DEFAULT,
) -> RunResult:
    """Run a model for so many seconds of its time; without a number, until it is stopped.

    Virtual time without a number ends when nothing is due any more. What the model is then can be
    read from its attributes. Ctrl-C ends the run in order: one without a number returns, else
    KeyboardInterrupt is raised. Raises ModelError for a bug in the model, and what `open_model`
    does.
    """
    end_after(0, for_s)
    planned, listeners = _planned(inputs), _listeners(listen)
    with open_model(
        model, clock=clock, speed=speed, statistics=statistics, configuration=configuration
    ) as opened:
        for at_s, into, value in planned:
            opened.plan(at_s, into, value)
        for port, listener in listeners.items():
            opened.listen(port, listener)
        result = opened.run(for_s)
        return opened.close() or result


def _planned(inputs: object) -> Sequence[tuple[float, InPort[Any], object]]:
    """The inputs, once. Raises ConfigError with every one that is none."""
    expected = "(seconds, port, value)"
    if not isinstance(inputs, Iterable):
        raise ConfigError("inputs", [f"{inputs!r}: expected {expected} each"])
    planned = list(inputs)
    strange = [each for each in planned if not (isinstance(each, tuple | list) and len(each) == 3)]
    if strange:
        raise ConfigError("inputs", [f"{each!r}: expected {expected}" for each in strange])
    return planned


def _listeners(listen: object) -> Listeners:
    """The listeners by their ports. Raises ConfigError for what is none."""
    is_mapping = isinstance(listen, Mapping)
    demand("listen", listen, "functions by their ports", is_sound=is_mapping)
    listeners = cast("Mapping[OutPort[Any], object]", listen)
    faults = [f"{each!r}: expected a function" for each in listeners.values() if not callable(each)]
    if faults:
        raise ConfigError("listen", faults)
    return cast("Listeners", listen)
