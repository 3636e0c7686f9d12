"""One robot put together for one run: board, buses or rig, model, executive."""

from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

from firmware_runtime.board.ending import Ending
from firmware_runtime.board.registry import Board
from firmware_runtime.board.rig import Doubles, Rig
from firmware_runtime.board.robot import Robot
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.ports import OutPort
from firmware_runtime.devs.time import MICROSECOND, seconds
from firmware_runtime.errors import ConfigError, text_of
from firmware_runtime.executive.clocks import Clock, MonotonicClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.deadlines import PathDeadline
from firmware_runtime.executive.loop import Executive
from firmware_runtime.executive.policy import ActivationPolicy
from firmware_runtime.executive.process import ProcessSettings
from firmware_runtime.executive.world_clock import OutsideClock, WorldClock
from firmware_runtime.hal.accounted_bus import AccountedBus
from firmware_runtime.hal.errors import HalError
from firmware_runtime.hal.interlock import always_enabled
from firmware_runtime.links.ports_socket import PortsSocket
from firmware_runtime.runs.arming import Arming
from firmware_runtime.runs.control import Answer, ControlSocket
from firmware_runtime.runs.kept_by_run import keep_clear_of_other_runs
from firmware_runtime.runs.lines import close_lines, open_lines
from firmware_runtime.runs.outputs import switched_off
from firmware_runtime.runs.prearm_checks import objections_to
from firmware_runtime.runs.rigs import rig_for, served_doubles
from firmware_runtime.runs.settings_in_force import forget_settings, keep_settings
from firmware_runtime.statistics.companions import Companion


class Session:
    """A robot whose chips have answered, ready to run.

    `doubles` are made for the run (True), served at a path, or None on the real robot; `rig` is
    there only if they were made. A supervised run may drive its outputs only while it is armed, see
    `arming`; any other always. Raises ConfigError for settings that do not fit the model,
    StatisticsFileError if another robot's run keeps its statistics at that path, and HalError when
    a bus or chip is missing; nothing was actuated then.
    """

    def __init__(
        self,
        board: Board,
        clock: Clock,
        *,
        doubles: bool | Path,
        statistics_path: Path | None,
        arming: Arming | None = None,
    ) -> None:
        self.board = board
        self._doubles = doubles
        self.arming = arming
        self._statistics_path = statistics_path
        self._executive: Executive | None = None
        # the instant that doubles and their world live in, ns since the start of the run
        self.world_now = WorldClock() if doubles is True else OutsideClock(clock.now)
        self.rig: Rig | None = None
        self.doubles: Doubles | None = None
        if isinstance(doubles, Path):
            self.doubles = served_doubles(board, doubles)
        elif doubles:
            self.doubles = self.rig = rig_for(board, self.world_now)
        interlock = always_enabled if arming is None else arming.interlock
        self._lines = open_lines(board, self.doubles, interlock, self.world_now)
        self.replaced: str | None = None
        """What is wrong with the file that this run's statistics replace, if it is damaged."""
        if statistics_path is not None:
            self.replaced = keep_clear_of_other_runs(statistics_path)
        self._control = None if arming is None else self._listen(arming, statistics_path)
        self.robot: Robot = board.build(self._lines)
        self._ports: PortsSocket | None = None
        if statistics_path is not None and isinstance(clock, MonotonicClock):
            self._ports = PortsSocket(Companion.PORTS.beside(statistics_path), self.robot.model)
        if self.rig is not None:
            self.rig.attach(self.robot.model)
        self._executive = Executive(
            self.robot.model,
            clock,
            self._make_safe,
            self._configuration(statistics_path),
            self.world_now,
        )
        if self._ports is not None:
            self._ports.attach(self._executive)
        if arming is not None:
            max_late_percent = board.settings.arming.max_late_percent
            objections = objections_to(self._executive, max_late_percent)
            arming.attach(
                self._executive, self._make_safe, objections, partial(self._enable, enabled=True)
            )
        self.ending: Ending | None = None
        if self.robot.ended is not None:
            self._executive.simulator.listen(self.robot.ended, self._end)
        self.robot.find_chips()
        if arming is None:
            self._enable(enabled=True)

    @property
    def supervision(self) -> Arming | None:
        """What lets a run drive that may not drive of itself; None for any other."""
        return None if self.arming is None or self.arming.is_free else self.arming

    @property
    def shown(self) -> OutPort[float] | None:
        """The port whose values a person wants to see over time, if there is one."""
        return self.robot.shown if self.rig is None else self.rig.shown

    @property
    def has_failed(self) -> bool:
        """Whether the robot itself ended the run because something went wrong."""
        return self.ending is not None and self.ending.failed

    @property
    def executive(self) -> Executive:
        """The loop that runs the robot."""
        assert self._executive is not None  # noqa: S101 -- set before construction ends
        return self._executive

    def result(self) -> dict[str, object]:
        """How the run ended: the world's truth on doubles, else what the robot itself knows."""
        own = self.robot.result()
        if self.doubles is not None:
            with suppress(HalError):  # whoever served them has gone
                return self.doubles.result(self.world_now.step_at, own)
        return own

    def outputs(self) -> dict[str, int] | None:
        """How many outputs of each chip are on; None where nobody can tell."""
        if self.doubles is not None:
            with suppress(HalError):  # whoever served them has gone
                return self.doubles.outputs
        return None

    def keep_settings(self) -> None:
        """Leave word of the outputs that will be driven; not of those within this process."""
        if self._statistics_path is not None and self._doubles is not True:
            keep_settings(self.board, self._statistics_path)

    def forget_settings(self) -> None:
        """All outputs are off."""
        if self._statistics_path is not None and self._doubles is not True:
            forget_settings(self._statistics_path)

    def close(self) -> None:
        """Release the buses; nobody can ask anything of the run any more."""
        close_lines(self._lines)
        for asked in (self._control, self._ports):
            if asked is not None:
                asked.close()

    def _enable(self, *, enabled: bool) -> None:
        """Let outputs through or not, where a line decides. Raises HalError."""
        if self._lines.enable is not None:
            self._lines.enable.set(enabled)

    def _make_safe(self) -> list[str]:
        """Disable all outputs at once where a line can, then write full-off to every chip."""
        failed: list[str] = []
        try:
            self._enable(enabled=False)
        except HalError as error:
            failed.append(text_of(error))
        return [*failed, *self.robot.make_safe()]

    def _listen(self, arming: Arming, statistics_path: Path | None) -> ControlSocket | None:
        """Take requests to arm and disarm, if the run has a place where it can be found."""
        if statistics_path is None:
            return None

        def arm() -> Answer:
            return {"refused": arming.request(self.executive.clock.now()), "armed": arming.armed}

        def disarm() -> Answer:
            return {"not_safe": arming.disarm("asked for"), "armed": arming.armed}

        return ControlSocket(
            Companion.CONTROL.beside(statistics_path), {"arm": arm, "disarm": disarm}
        )

    def _end(self, _at: int, ending: Ending) -> None:
        if ending.failed and not self.robot.ends_on_failure:
            return
        self.ending = ending
        self.executive.request_stop(ending.reason)

    def _configuration(self, statistics_path: Path | None) -> Configuration:
        settings = self.board.settings
        return Configuration(
            policies={
                path: ActivationPolicy(each.policy, each.tolerance_us, each.stop_after_us)
                for path, each in settings.overruns.items()
            },
            deadlines=_deadlines(self.robot.model, settings),
            buses=tuple(bus for bus in self._lines.buses.values() if isinstance(bus, AccountedBus)),
            process=_process(settings.executive),
            statistics_path=statistics_path,
            switch_off_for=seconds(settings.executive.switch_off_s),
            sources=[each for each in (self._control, self._ports) if each is not None],
            armed_at_start=self.arming is None,
            max_lag=seconds(settings.executive.max_lag_s),
            worst=settings.executive.worst,
            recorded_spans=settings.executive.recorded_spans,
            conditions=self._conditions(),
        )

    def _conditions(self) -> dict[str, Any]:
        """The board, and how a guard would switch it off; doubles made for the run have none."""
        conditions = {"board": self.board.name, "board_sha256": self.board.fingerprint}
        if self._doubles is True:
            return conditions
        served = self._doubles or None
        return {**conditions, "switched_off": switched_off(self.board, served)}


def find_component(root: Component, path: str) -> Component | None:
    """The component at a path such as `controller.yaw`, below `root`; None if there is none."""
    found: Component | None = root
    for name in path.split("."):
        found = found.components.get(name) if isinstance(found, Coupled) else None
    return found


def find_out_port(root: Component, path: str) -> OutPort[Any] | None:
    """The output port at a path such as `imu.sample`; None if there is none."""
    owner, _, name = path.rpartition(".")
    component = find_component(root, owner) if owner else root
    return None if component is None else component.out_ports.get(name)


def _deadlines(root: Component, settings: Any) -> tuple[PathDeadline, ...]:  # noqa: ANN401
    deadlines: list[PathDeadline] = []
    faults: list[str] = []
    for each in settings.deadlines:
        port, actuator = find_out_port(root, each.source), find_component(root, each.actuator)
        if port is None:
            faults.append(f"deadlines.source: {each.source!r}: the model has no such output port")
        elif not isinstance(actuator, Atomic):
            faults.append(f"deadlines.actuator: {each.actuator!r}: the model has no such atomic")
        else:
            name = f"{each.source} -> {each.actuator}"
            within = round(each.within_us * MICROSECOND)
            deadlines.append(PathDeadline(name, port, actuator, within))
    if faults:
        raise ConfigError(root.name, faults)
    return tuple(deadlines)


def _process(settings: Any) -> ProcessSettings:  # noqa: ANN401
    return ProcessSettings(
        fifo_priority=settings.fifo_priority,
        lock_memory=settings.lock_memory,
        cpus=settings.cpus,
        timer_slack_ns=settings.timer_slack_ns,
        freeze_garbage=settings.freeze_garbage,
        spin_us=settings.spin_us,
        keep_cpu_awake=settings.keep_cpu_awake,
    )
