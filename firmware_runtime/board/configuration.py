"""Configuration of the loop by a board's settings: policies, deadlines, lines, process, inputs.

Input ports of the top model: a value comes from another process (`send`, a bridge, ROS 2), which
may end. So each input port of a robot that has outputs has a timeout: outputs are off from then
until the next value comes. A port of references, settings or events is declared to `HOLD`: its last
value counts until there is another.
"""

from collections.abc import Collection, Iterable, Mapping
from typing import Final, Literal, TypeAlias

from firmware_runtime.board.registry import Board
from firmware_runtime.board.robot import Lines, Robot
from firmware_runtime.board.settings import (
    ExecutiveSettings,
    ModelPolicy,
    PathDeadlineSettings,
    StopPolicy,
)
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import Component, below_root
from firmware_runtime.devs.coupled import Coupled, ports_below, with_all_below
from firmware_runtime.devs.ports import OutPort
from firmware_runtime.devs.time import MICROSECOND, SECOND, seconds
from firmware_runtime.errors import ConfigError, did_you_mean
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.deadlines import PathDeadline
from firmware_runtime.executive.policy import ActivationPolicy
from firmware_runtime.executive.process import ProcessSettings
from firmware_runtime.hal.accounted_bus import AccountedBus
from firmware_runtime.hal.accounted_port import AccountedPort

TIMEOUT_S: Final = 0.5
"""Of a port of which nothing is declared."""
HOLD: Final = "hold"

Inputs: TypeAlias = Mapping[str, float | Literal["hold"]]
"""By the name of an input port of the top model, its timeout in seconds, or `HOLD`."""


def input_timeouts(board: Board, robot: Robot) -> dict[str, int | None]:
    """The timeout of each input port of the board's whole robot, ns; None where it holds.

    A robot without outputs has none to switch off.
    """
    return {
        name: _timeout(board.inputs.get(name, TIMEOUT_S)) if robot.stop else None
        for name in robot.model.in_ports
    }


def described(name: str, timeout: int | None) -> str:
    """Return what the silence of a port does, a few words."""
    if timeout is None:
        return f"input {name}: holds its last value"
    return f"input {name}: outputs are off {timeout / SECOND:g} s after its last value"


def _timeout(stated: float | str) -> int | None:
    return None if isinstance(stated, str) else seconds(stated)


def configuration_of(
    board: Board, model: Component, lines: Lines, elsewhere: Collection[str] = ()
) -> Configuration:
    """Return the configuration of the loop that runs this model on these lines.

    What names a component that runs `elsewhere`, in another process, is left to that. Raises
    ConfigError, listing all deadlines that name what the model has not.
    """
    settings = board.settings

    def is_here(path: str) -> bool:
        return path.split(".", maxsplit=1)[0] not in elsewhere

    overruns = {path: each for path, each in settings.overruns.items() if is_here(path)}
    both = [each for each in settings.deadlines if is_here(each.source) and is_here(each.actuator)]
    return Configuration(
        policies={path: _activation_policy(each) for path, each in overruns.items()},
        deadlines=_deadlines(model, both),
        buses=tuple(bus for bus in lines.buses.values() if isinstance(bus, AccountedBus)),
        ports=tuple(port for port in lines.ports.values() if isinstance(port, AccountedPort)),
        process=_process(settings.executive),
        switch_off_for=seconds(settings.executive.switch_off_s),
        max_lag=seconds(settings.executive.max_lag_s),
        worst=settings.executive.worst,
    )


def find_component(root: Component, path: str) -> Component | None:
    """The component at a path such as `controller.yaw`, below `root`; None if there is none."""
    found: Component | None = root
    for name in path.split("."):
        found = found.components.get(name) if isinstance(found, Coupled) else None
    return found


def find_out_port(root: Component, path: str) -> OutPort[object] | None:
    """The output port at a path such as `imu.sample`; None if there is none."""
    owner, _, name = path.rpartition(".")
    component = find_component(root, owner) if owner else root
    return None if component is None else component.out_ports.get(name)


def _atomics(root: Component) -> list[str]:
    """Paths of all atomic models, as `find_component` takes them."""
    return [below_root(each.path) for each in with_all_below(root) if isinstance(each, Atomic)]


def _deadlines(root: Component, stated: Iterable[PathDeadlineSettings]) -> tuple[PathDeadline, ...]:
    deadlines: list[PathDeadline] = []
    faults: list[str] = []
    for each in stated:
        port, actuator = find_out_port(root, each.source), find_component(root, each.actuator)
        if port is None:
            faults.append(
                f"deadlines.source: {each.source!r}: no such output port; expected one that "
                f"`firmware-runtime show` shows{did_you_mean(each.source, ports_below(root))}"
            )
        if not isinstance(actuator, Atomic):
            faults.append(
                f"deadlines.actuator: {each.actuator!r}: no such atomic model; expected one that "
                f"`firmware-runtime show` shows{did_you_mean(each.actuator, _atomics(root))}"
            )
        elif port is not None:
            name = f"{each.source} -> {each.actuator}"
            within = round(each.within_us * MICROSECOND)
            deadlines.append(PathDeadline(name, port, actuator, within))
    if faults:
        raise ConfigError(root.name, faults)
    return tuple(deadlines)


def _activation_policy(late: ModelPolicy) -> ActivationPolicy:
    stop_after_us = late.stop_after_us if isinstance(late, StopPolicy) else None
    return ActivationPolicy(late.policy, late.tolerance_us, stop_after_us)


def _process(settings: ExecutiveSettings) -> ProcessSettings:
    return ProcessSettings(
        fifo_priority=settings.fifo_priority,
        lock_memory=settings.lock_memory,
        cpus=settings.cpus,
        timer_slack_ns=settings.timer_slack_ns,
        freeze_garbage=settings.freeze_garbage,
        spin_us=settings.spin_us,
        keep_cpu_awake=settings.keep_cpu_awake,
    )
