"""A number that is not finite is a missing value and a counted fault, for every model of a robot.

Each device-free atomic model of each robot is run twice on the same random values: with NaN and
infinities strewn in, and without them. All that leaves it, and its state at the end, are the same.
An actuator, which such a command stops, says so itself, also while its outputs are disabled.
"""

import math
from contextlib import closing
from enum import Enum
from functools import partial
from random import Random
from typing import Any, get_args, get_type_hints

import pytest
from firmware_drivers.actuator import Actuator
from firmware_drivers.hardware import HardwareModel

from firmware_runtime.board import registry
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.checked import snapshot
from firmware_runtime.devs.classic import ClassicSimulator
from firmware_runtime.devs.engine import Engine
from firmware_runtime.devs.finite import check_of
from firmware_runtime.devs.ports import InPort
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.models.motion import Motion
from firmware_runtime.models.pid import Pid, PidGains
from firmware_runtime.runs.session import Session
from firmware_runtime.runs.start import start_session

ROBOTS = {
    "platform": ("tachobot", []),
    "behind a delay": ("tachobot", ["controller.yaw.smith.delay_s=0.1"]),
    "hovering": ("tachobot", ["controller.mode=free"]),
    "on a path": ("tachobot", ["controller.mode=track"]),
    "detective": ("detective", []),
    "balancing": ("balancing", []),
    "pan and tilt": ("pan_tilt", []),
}
NOT_FINITE = (math.nan, math.inf, -math.inf)
VALUES = 60


def device_free(board: str, overrides: list[str]) -> list[Atomic]:
    """The atomic models of a robot on doubles that know no chip and take numbers."""
    with closing(session_of(board, overrides)) as session:
        return [
            each
            for each in session.executive.simulator.atomics
            if not isinstance(each, HardwareModel) and any(map(check_of, each.in_ports.values()))
        ]


def session_of(board: str, overrides: list[str]) -> Session:
    """A robot on doubles, in virtual time."""
    return start_session(
        registry.load(board, overrides), VirtualClock(), doubles=True, statistics_path=None
    )


def value_of(kind: Any, random: Random, bad: float | None = None) -> Any:  # noqa: ANN401 -- of any port
    """A random value of a type; with `bad` in the place of one of its numbers."""
    if kind is float:
        return random.uniform(-1.0, 1.0) if bad is None else bad
    if kind is int:
        return random.randrange(3)
    if kind is bool:
        return random.random() < 0.8
    if kind is object:
        return 0
    if not issubclass(kind, Enum):
        kinds = list(get_type_hints(kind).values())
        numeric = [n for n, each in enumerate(kinds) if each is float or float in get_args(each)]
        worst = None if bad is None or not numeric else random.choice(numeric)
        return kind(
            *(_field(each, random, bad if n == worst else None) for n, each in enumerate(kinds))
        )
    return random.choice(list(kind))  # an enumeration


def _field(kind: Any, random: Random, bad: float | None) -> Any:  # noqa: ANN401 -- as above
    arguments = [each for each in get_args(kind) if each not in (type(None), Ellipsis)]
    if not arguments:
        return value_of(kind, random, bad)
    if len(arguments) == 1 and get_args(arguments[0]):  # Vector | None
        return _field(arguments[0], random, bad)
    values = [
        value_of(each, random) for each in (arguments * 4 if len(arguments) == 1 else arguments)
    ]
    if bad is not None:
        values[-1] = bad
    return tuple(values)


def run(engine: Engine, script: list[tuple[int, str, Any]]) -> tuple[list[Any], list[str]]:
    """What an atomic model sends, and what it has become, in words in which NaN equals itself."""
    atomic = engine.root
    assert isinstance(atomic, Atomic)
    heard: list[str] = []

    def hear(name: str, at: int, value: object) -> None:
        heard.append(f"{at} {name} {value!r}")

    for port in atomic.out_ports.values():
        engine.listen(port, partial(hear, port.name))
    for at, name, value in script:
        engine.run(at)
        engine.inject(atomic.in_ports[name], value)
        engine.advance(at)
    engine.run(script[-1][0] + SECOND)
    state = snapshot(atomic)
    state.pop("sigma")
    return heard, [
        f"{name} {value!r}" for name, value in state.items() if " at 0x" not in repr(value)
    ]


def scripts(atomic: Atomic, seed: int) -> tuple[list[Any], list[Any], int]:
    """Values at random instants, with bad ones and without; how many are bad."""
    random, whole, sound = Random(seed), [], []  # noqa: S311 -- repeatable
    checked = [port for port in atomic.in_ports.values() if check_of(port)]
    for n in range(VALUES):
        port = random.choice([*atomic.in_ports.values(), *checked])
        at = (n + 1) * 10 * MILLISECOND
        if port in checked and random.random() < 0.4:
            bad = math.nan if port.takes == "infinities" else random.choice(NOT_FINITE)
            whole.append((at, port.name, value_of(port.type, random, bad)))
        else:
            sound.append((at, port.name, value_of(port.type, random)))
            whole.append(sound[-1])
    return whole, sound, len(whole) - len(sound)


def alone(atomic: Atomic, kind: type[Engine] = Simulator) -> Engine:
    """The model by itself."""
    atomic.parent = None
    return kind(atomic)


def of_floats(port: InPort[Any]) -> bool:
    """Whether its values are numbers with a fraction, or records of these."""
    is_record = issubclass(port.type, tuple)
    return port.type is float or (is_record and float in get_type_hints(port.type).values())


class Spoiling:
    """A hook of the loop: from a second on, the estimate of an attitude is no number."""

    def __init__(self, attitude: Atomic) -> None:
        self.attitude = attitude

    def between_steps(self, now: int, left: int) -> None:  # noqa: ARG002 -- a hook's
        if now >= SECOND:
            self.attitude.motion = Motion(math.nan, 0.0)  # type: ignore[attr-defined]


@pytest.mark.slow
@pytest.mark.parametrize("robot", ROBOTS)
def test_no_model_of_a_robot_keeps_a_trace_of_a_number_that_is_not_finite(robot: str) -> None:
    pairs = zip(device_free(*ROBOTS[robot]), device_free(*ROBOTS[robot]), strict=True)
    count = 0
    for with_bad, without in pairs:
        whole, sound, bad = scripts(with_bad, seed=count)
        assert bad > 5
        refused: list[InPort[Any]] = []
        engine = alone(with_bad)
        engine.on_refused = lambda port, _, into=refused: into.append(port)
        assert run(engine, whole) == run(alone(without), sound), with_bad.path
        assert len(refused) == bad
        count += 1
    assert count > 0


@pytest.mark.parametrize("kind", [Simulator, ClassicSimulator])
@pytest.mark.parametrize("robot", ROBOTS)
def test_an_actuator_whose_outputs_are_disabled_reports_a_command_that_is_no_number(
    robot: str, kind: type[Engine]
) -> None:
    with closing(session_of(*ROBOTS[robot])) as session:
        found = [each for each in session.executive.simulator.atomics if isinstance(each, Actuator)]
        assert sum(len(refused(actuator, kind)) for actuator in found) > 0


def refused(actuator: Actuator, kind: type[Engine]) -> list[str]:
    """Send an actuator whose outputs are disabled good and bad numbers; return its faults."""
    actuator.interlock = lambda: False
    engine, said, every = alone(actuator, kind), list[str](), list[str]()
    engine.listen(actuator.fault_out, lambda _, fault: said.append(fault.reason))
    engine.run(2 * SECOND)
    for port in filter(of_floats, actuator.in_ports.values()):
        for bad in (None, *NOT_FINITE, None):
            said.clear()
            engine.inject(port, value_of(port.type, Random(0), bad))  # noqa: S311 -- repeatable
            engine.advance(engine.now)
            engine.run(engine.now + 5 * MILLISECOND)
            assert [f"{bad}" in each for each in said] == [True] * (bad is not None), port.path
            every += said
    return every


@pytest.mark.parametrize("kind", [Simulator, ClassicSimulator])
def test_a_pid_that_missed_a_measurement_answers_the_next_as_if_nothing_had_been(
    kind: type[Engine],
) -> None:
    gains = PidGains(kp=1.0, ki=0.5, kd=0.1, limit=2.0)
    good = [(n * 10 * MILLISECOND, "measurement", Motion(0.3, 0.1)) for n in (1, 2, 4)]
    for bad in (Motion(math.nan, 0.0), Motion(0.0, math.inf)):
        script = [*good[:2], (30 * MILLISECOND, "measurement", bad), good[2]]
        heard, state = run(alone(Pid("pid", gains, 1.0), kind), script)
        assert (heard, state) == run(alone(Pid("pid", gains, 1.0), kind), good)
        assert len(heard) == 3


def test_a_value_that_a_model_misses_is_counted_as_its_fault_and_the_outputs_go_off() -> None:
    session = session_of("tachobot", ["imu.calibration_s=0.1"])
    executive = session.executive
    models = {each.name: each for each in executive.simulator.atomics}
    executive.hooks.append(Spoiling(models["attitude"]))
    executive.run(2 * SECOND)
    figures = executive.statistics.figures()
    session.close()
    for model, port in (("controller.yaw", "measurement"), ("controller.allocation", "yaw")):
        fault = figures.faults[model]["NotFinite"]
        assert fault.count >= 99
        assert f"{model}.{port}: Motion(position=nan" in fault.last
    assert not any(models["thrust_pairs"].duties)  # type: ignore[attr-defined]  # no forces came
