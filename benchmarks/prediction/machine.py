"""A seeded computer in virtual time, on which models, waking and wires take their time.

The executive, its accounts and statistics are the product's; the clock is this one. Each model has
an own time (log-normal, 7 to 150 us by its median) and seldom a stall in it; whole steps are slower
or faster together, and seldom twice as slow; a waking is late (log-normal), seldom much. What a
transaction takes on its wire passes, too: a thread waits for it.
"""

from collections.abc import Callable, Sequence
from math import exp
from random import Random
from typing import Any

from msgspec.structs import replace

from firmware_runtime.board.configuration import configuration_of
from firmware_runtime.board.registry import Board
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.coupled import with_all_below
from firmware_runtime.devs.functions import Functions, Wrapped
from firmware_runtime.devs.ports import InPort
from firmware_runtime.devs.time import MICROSECOND, SECOND
from firmware_runtime.executive.account import Step
from firmware_runtime.executive.clocks import WorldClock
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.outcome import Outcome
from firmware_runtime.executive.process import ProcessSettings
from firmware_runtime.hal.accounted_bus import AccountedBus
from firmware_runtime.runs.open_lines import open_lines
from firmware_runtime.runs.session import Task
from firmware_runtime.statistics.comparison import merged
from firmware_runtime.statistics.statistics import Statistics
from sim_doubles.rigs.board_rig import rig_for

STRETCH = 5 * SECOND


class Machine:
    """What things take on one computer: by its number always the same."""

    def __init__(self, number: int) -> None:
        random = Random(number)  # noqa: S311 -- no secret
        self._number = number
        self._wakes = random.uniform(40, 150), random.uniform(0.15, 0.5), random.uniform(0, 0.003)
        self._together = random.uniform(0.03, 0.15), random.uniform(0, 0.002)
        self._models: dict[str, tuple[float, float, float, float]] = {}

    def lateness_ns(self, random: Random) -> int:
        """Return how late a waking is."""
        median, sigma, seldom = self._wakes
        late = median * exp(random.gauss(0, sigma))
        return round(MICROSECOND * (late + _stall(random, seldom, 600)))

    def together(self, random: Random) -> float:
        """Return by how much all models of a step are slower."""
        sigma, seldom = self._together
        return exp(random.gauss(0, sigma)) * (2 if random.random() < seldom else 1)

    def own_ns(self, model: str, random: Random) -> int:
        """Return the own time of a model in a step."""
        if model not in self._models:
            one = Random(f"{self._number} {model}")  # noqa: S311
            median, sigma = 7 * exp(one.uniform(0, 3)), one.uniform(0.05, 0.3)
            self._models[model] = (median, sigma, one.uniform(0, 0.004), one.uniform(50, 300))
        median, sigma, seldom, mean = self._models[model]
        taken = median * exp(random.gauss(0, sigma))
        return round(MICROSECOND * (taken + _stall(random, seldom, mean)))


def _stall(random: Random, seldom: float, mean: float) -> float:
    return random.expovariate(1 / mean) if random.random() < seldom else 0.0


class MachineClock:
    """Time of such a computer: it passes while models run, and while the loop waits."""

    speed: float = 1.0

    def __init__(self, machine: Machine, random: Random) -> None:
        self._machine, self._random = machine, random
        self._now = 0

    def start(self, at: int) -> None:
        """Count from `at`."""
        self._now = at

    def now(self) -> int:
        """Return the present instant, ns."""
        return self._now

    def spend(self, ns: int) -> None:
        """Let time pass."""
        self._now += ns

    def wait(self, until: int, _sources: Sequence[Any]) -> list[Any]:
        """Sleep until an instant, and wake late; what is past already is no sleep."""
        if until > self._now:
            self._now = until + self._machine.lateness_ns(self._random)
        return []


class Charge:
    """A tap that lets each model of a step take its time, and notes when the step is over."""

    def __init__(
        self, machine: Machine, clock: MachineClock, random: Random, own: set[str]
    ) -> None:
        self.responses: list[int] = []
        self._machine, self._clock, self._random, self._own = machine, clock, random, own
        self._charged: set[str] = set()
        self._buses: Sequence[AccountedBus] = ()
        self._together, self._busy_ns = 1.0, 0
        self._step: Step | None = None

    def wait_for(self, buses: Sequence[AccountedBus]) -> None:
        """Charge what is on these wires from now on: not what found the chips before the run."""
        self._buses = buses
        self._busy_ns = self._busy()

    def watch(self, step: Step) -> None:
        """Read the ends of steps from there."""
        self._step = step

    def instrument(self, atomic: Atomic, functions: Functions) -> Functions:
        """Let a model of the robot take time; the world has none."""
        path = below_root(atomic.path)
        if path not in self._own:
            return functions

        def timed(function: Callable[..., None]) -> Callable[..., None]:
            def call(*arguments: int) -> None:
                function(*arguments)
                self._charge(path)

            return call

        confluent = functions.confluent
        return Wrapped(
            atomic,
            timed(functions.output),
            timed(functions.internal),
            timed(functions.external),
            None if confluent is None else timed(confluent),
        )

    def _charge(self, path: str) -> None:
        if path not in self._charged:
            self._charged.add(path)
            own_ns = self._machine.own_ns(path, self._random)
            self._clock.spend(round(self._together * own_ns))
        busy_ns = self._busy()
        self._clock.spend(busy_ns - self._busy_ns)
        self._busy_ns = busy_ns

    def _busy(self) -> int:
        return sum(bus.busy_ns for bus in self._buses)

    def begin(self, _at: int) -> None:
        """Begin a step: nothing has been charged."""
        self._charged.clear()
        self._together = self._machine.together(self._random)

    def end(self, at: int, _next_at: int) -> None:
        """Note how long after its instant the step was over."""
        if self._charged and self._step is not None:
            self.responses.append(self._step.ended - at)

    def entered(self, _port: InPort[object], _value: object) -> None:
        """Nothing is noted of inputs."""

    def go_on(self, _until: int) -> None:
        """Nothing is to be prepared."""

    def arm(self, *, armed: bool) -> None:
        """Outputs are driven from the start."""

    def exit(self, exit_models: Callable[[], list[Exception]]) -> list[Exception]:
        """Let the models exit."""
        return exit_models()

    def finish(self, _outcome: Outcome, _at: int) -> None:
        """Nothing is to be closed."""


class Runs:
    """Runs of a board's doubles on such a computer, one after the other, of so many steps in all.

    Each ends with its robot's task, if that has an end. `statistics` are those of all.
    """

    def __init__(
        self, board: Board, machine: Machine, seed: int, steps: int, *, wires: bool
    ) -> None:
        random = Random(seed)  # noqa: S311 -- no secret
        responses: list[int] = []
        counted: list[Statistics] = []
        while len(responses) < steps:
            charge, statistics = _run(board, machine, random, steps - len(responses), wires=wires)
            responses += charge.responses
            counted.append(statistics)
        self.responses = sorted(responses)
        self.statistics = counted[0] if len(counted) == 1 else merged(counted)

    def exceeded_by(self, share: float) -> int:
        """Return what that share of the steps' responses exceeds, ns."""
        return self.responses[-1 - int(share * len(self.responses))]


def _run(
    board: Board, machine: Machine, random: Random, steps: int, *, wires: bool
) -> tuple[Charge, Statistics]:
    """Run a board until its task is over, or for so many steps."""
    clock, world_now = MachineClock(machine, random), WorldClock()
    rig = rig_for(board, world_now)
    lines = open_lines(board, rig, time=world_now)
    robot = board.build(lines)
    own = {below_root(each.path) for each in with_all_below(robot.model)}
    charge = Charge(machine, clock, random, own)
    rig.attach(robot.model)
    configuration = replace(
        configuration_of(board, robot.model, lines), tap=charge, process=ProcessSettings()
    )
    executive = Executive(robot.model, clock, robot.make_safe, configuration, world_now)
    Task(executive, robot)
    robot.find_chips()
    if wires:  # on doubles nothing waits for them
        charge.wait_for([bus for bus in lines.buses.values() if isinstance(bus, AccountedBus)])
    until = 0
    while len(charge.responses) < steps and not executive.is_over:
        until += STRETCH
        executive.run_on(until)
    executive.end()
    return charge, executive.statistics
