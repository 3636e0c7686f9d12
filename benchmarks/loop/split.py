"""Where the time of TachoBot's steps goes: the runtime, its models, its drivers, its doubles.

A stopwatch always runs for exactly one label, so the parts add up to the time that has passed. It
is switched by the functions it watches, and itself takes about a third of a microsecond each time:

- `double`: within the bus of doubles, the plant behind it included, and the world's probe;
- `driver`: within a chip driver, the accounted bus included;
- `model`: within the models' functions;
- `waiting`: within the clock's wait;
- `runtime`: everything else, the kernel, the accounting and the loop.
"""

from collections import defaultdict
from collections.abc import Callable
from time import monotonic_ns
from typing import Any, TypeVar

from firmware_boards.tachobot.wiring import Tachobot

from benchmarks.loop.rates import assignments
from firmware_runtime.board import registry
from firmware_runtime.board.registry import Board
from firmware_runtime.board.robot import Lines
from firmware_runtime.devs.time import seconds
from firmware_runtime.devs.wiring import Wiring
from firmware_runtime.executive.clocks import MonotonicClock, WorldClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.process import ProcessSettings
from firmware_runtime.hal.accounted_bus import AccountedBus
from sim_doubles.rigs.board_rig import rig_for

R = TypeVar("R")

BUS = "i2c1"
WAITING, RUNTIME = "waiting", "runtime"
KINDS = (RUNTIME, "model", "driver", "double")
WORLD = "world"
"""The probe of the plant: a model that no robot has."""


class Stopwatch:
    """Divides time among labels; `spent` has the ns of each."""

    def __init__(self, label: str) -> None:
        self.spent: defaultdict[str, int] = defaultdict(int)
        self._label = label
        self._since = monotonic_ns()

    def watch(self, target: object, label: str, *names: str) -> None:
        """From now on, run for `label` within these functions of an object."""
        for name in names:
            setattr(target, name, self._watched(label, getattr(target, name)))

    def clear(self) -> None:
        """Forget what was spent."""
        self.spent.clear()

    def _watched(self, label: str, function: Callable[..., R]) -> Callable[..., R]:
        def call(*arguments: object) -> R:
            outside = self._switch_to(label)
            try:
                return function(*arguments)
            finally:
                self._switch_to(outside)

        return call

    def _switch_to(self, label: str) -> str:
        """Run for another label; return the one before."""
        before, now = self._label, monotonic_ns()
        self.spent[before] += now - self._since
        self._label, self._since = label, now
        return before


class WatchedTachobot:
    """TachoBot on doubles, put together as a session does, each part under the stopwatch.

    `ticks` counts the samples of its IMU after the first, which clears the watch: by then it is up
    and calibrated.
    """

    def __init__(self, board: Board) -> None:
        self.ticks = -1
        self.stopwatch = watch = Stopwatch(RUNTIME)
        world_now = WorldClock()
        bench = rig_for(board, world_now)
        watch.watch(bench.buses[BUS], f"double {BUS}", "transaction")
        speed_hz = round(board.settings.buses[BUS].speed_hz)
        bus = AccountedBus(bench.buses[BUS], speed_hz, time=world_now)
        robot = board.build(Lines({BUS: bus}, {}))
        bench.attach(robot.model)
        assert isinstance(robot.model, Tachobot)  # noqa: S101 -- the board says so
        self._watch_models(robot.model)
        clock = MonotonicClock()
        watch.watch(clock, WAITING, "wait")
        executive = Executive(
            robot.model, clock, robot.make_safe, _configuration(board, bus), world_now
        )
        executive.simulator.listen(robot.model.imu.sample, self._count)
        robot.find_chips()
        self.run = executive.run

    def _watch_models(self, model: Tachobot) -> None:
        watch = self.stopwatch.watch
        for atomic in Wiring(model).atomics:
            name = atomic.path.removeprefix(f"{model.path}.")
            label = f"double {name}" if name == WORLD else f"model {name}"
            watch(atomic, label, "output", "internal", "external")
        watch(model.imu_chip, "driver mpu9250", "read_sample", "check_magnetometer")
        watch(model.thrust_chip, "driver pca9685", "set_duties", "stop_all")

    def _count(self, _at: int, _sample: object) -> None:
        if self.ticks < 0:
            self.stopwatch.clear()
        self.ticks += 1


def _configuration(board: Board, bus: AccountedBus) -> Configuration:
    """What the board asks for, as far as it bears on the time of a step."""
    settings = board.settings.executive
    return Configuration(
        buses=(bus,),
        process=ProcessSettings(
            fifo_priority=settings.fifo_priority,
            freeze_garbage=settings.freeze_garbage,
            timer_slack_ns=settings.timer_slack_ns,
        ),
    )


def split(rate_hz: int, run_s: float) -> dict[str, Any]:
    """Microseconds a tick by label, in steady state; and the share of a processor that it takes."""
    board = registry.load("tachobot", assignments(rate_hz))
    robot = WatchedTachobot(board)
    robot.run(seconds(run_s))
    spent = dict(robot.stopwatch.spent)
    total = sum(spent.values())
    waiting = spent.pop(WAITING, 0)
    parts = {label: ns / robot.ticks / 1000 for label, ns in sorted(spent.items())}
    return {
        "rate_hz": rate_hz,
        "ticks": robot.ticks,
        "busy": 1 - waiting / total,
        "us": parts,
        "kinds_us": {
            kind: sum(us for label, us in parts.items() if label.split()[0] == kind)
            for kind in KINDS
        },
    }
