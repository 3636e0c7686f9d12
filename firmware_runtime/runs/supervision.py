"""Supervision of a run by itself: hooks that take its right to drive, and the interlock of it all.

Overload       the loop cannot keep up, or takes the machine for itself
SleepWatch     the machine was suspended meanwhile
Commanders     an input port that has a timeout has fallen silent

Another takes nothing: DeviceMessages says when a device fails, and when it works again.
"""

from collections.abc import Callable, Mapping
from time import monotonic_ns, process_time_ns
from typing import Any, Final, Literal, NamedTuple, TypeAlias

from firmware_runtime.board.settings import ExecutiveSettings
from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.ports import InPort
from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.fault_log import carries_faults
from firmware_runtime.executive.outcome import Device
from firmware_runtime.hal.interlock import NotedInterlock
from firmware_runtime.runs.arming import Arming
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.layout import STEP_TIME
from firmware_runtime.system.this_process import slept

WINDOW: Final = 3 * SECOND
"""Ns of real time that a load is taken over."""

STILL: Final = 2 * WINDOW
"""A window that took longer: machine or process stood still, and in the middle of a step, perhaps.
Of that its steps are not judged; the guard and the watchdog see to a step that takes so long."""
ANY_LOAD: Final = 100.0
"""The limit, per cent, that judges nothing."""

Policy: TypeAlias = Literal["yield", "stop"]


def watch_load(
    executive: Executive,
    settings: ExecutiveSettings,
    arming: Arming | None,
    log: Callable[[str], None],
) -> None:
    """Keep a run in real time from taking the machine for itself."""
    limit, is_real = settings.max_load_percent, isinstance(executive.clock, MonotonicClock)
    if is_real and limit < ANY_LOAD:
        Overload(executive, limit, settings.overload, arming, log)


class Overload:
    """A hook: acts once, when the load of a whole window was above `max_load_percent`.

    The load is the larger of two shares of the real time that passes, over `WINDOW`: what steps
    take, waiting for a bus included, since a loop that is always in a step keeps no rate however
    idle the processor; and processor time of the process, since at SCHED_FIFO no ordinary process
    gets that, a login no more than anything else. Both are counted anyway.

    Policy `yield`: SCHED_FIFO is given up until the run ends, and a run that was armed with it is
    disarmed; without it the run goes on as it is. Policy `stop`: the run ends, by overrun. `log`
    gets a sentence about it.
    """

    def __init__(
        self,
        executive: Executive,
        max_load_percent: float,
        policy: Policy,
        arming: Arming | None,
        log: Callable[[str], None],
    ) -> None:
        self._executive = executive
        self._max_load_percent = max_load_percent
        self._policy = policy
        self._arming = arming
        self._log = log
        self._ends_at = 0
        self._begun = _Reading(0, 0, 0, 0)
        executive.hooks.append(self)

    def between_steps(self, now: int, _left: int) -> None:
        """Judge the window that is over, if one is, and begin the next."""
        at = monotonic_ns()
        if at < self._ends_at:
            return
        is_first, self._ends_at = self._ends_at == 0, at + WINDOW
        ended = _Reading(at, now, self._executive.cells[STEP_TIME], process_time_ns())
        begun, self._begun = self._begun, ended
        load_percent = 0.0 if is_first else 100 * _load(begun, ended)
        if load_percent > self._max_load_percent:
            self._ends_at = NEVER
            self._act(
                f"overload: {load_percent:.0f} % of the last {(at - begun.at) / SECOND:.0f} s went "
                "into steps or processor time, more than max_load_percent = "
                f"{self._max_load_percent:g}"
            )

    def _act(self, why: str) -> None:
        if self._policy == "stop":
            self._executive.request_stop(why, RunState.OVERRUN)
            return
        held = self._executive.holds_priority
        if held and self._arming is not None and self._arming.armed:
            self._arming.disarm(why)
        self._executive.give_up_priority()
        what = "gives up SCHED_FIFO until it ends" if held else "has no SCHED_FIFO to give up"
        self._log(f"{why}; the run {what}")


class _Reading(NamedTuple):
    """Real time, the run's, that of its steps, and processor time at the end of a window, ns."""

    at: int
    now: int
    steps: int
    processor: int


def _load(begun: _Reading, ended: _Reading) -> float:
    """The share of a window that went into steps or into processor time."""
    at, now, steps, processor = (b - a for a, b in zip(begun, ended, strict=True))
    of_steps = steps / max(now, 1) if at <= STILL else 0.0
    return max(of_steps, processor / at)


SHORTEST: Final = MILLISECOND
"""Ns: no machine goes to sleep and wakes up sooner."""


def watch_sleep(executive: Executive, arming: Arming) -> None:
    """Have a run in real time notice that its machine slept, where something may be hurt."""
    if isinstance(executive.clock, MonotonicClock) and not arming.is_free:
        executive.hooks.append(SleepWatch(arming))


class SleepWatch:
    """A hook: disarms a run that was armed when its machine went to sleep.

    CLOCK_MONOTONIC stands still meanwhile, so nothing was late and no command is old, though the
    robot drove on, or did not, for hours. CLOCK_BOOTTIME goes on: the distance between the two
    grows by each sleep and by nothing else. Source: clock_gettime(2).
    """

    def __init__(self, arming: Arming) -> None:
        self._arming = arming
        self._slept = slept()

    def between_steps(self, _now: int, _left: int) -> None:
        """Compare the time that the machine has slept with what it was."""
        so_far = slept()
        asleep = so_far - self._slept
        if asleep < SHORTEST:
            return
        self._slept = so_far
        if self._arming.armed:
            self._arming.disarm(f"the machine slept for {asleep / SECOND:.1f} s")


class Commanders:
    """A hook of the run, for input ports that have a timeout, ns: each is commanded by a process.

        nothing came yet --value--> heard --no other for its timeout--> silent --value--> heard

    A port at which nothing has come yet commands nothing. While one is silent the run is disarmed;
    it is armed again once values come. An end without hardware falls silent to the other end, whose
    own timeout then switches off.

    `on_silence` is called with a sentence when one falls silent.
    """

    def __init__(
        self,
        executive: Executive,
        timeouts: Mapping[InPort[Any], int],
        on_silence: Callable[[str], None],
    ) -> None:
        self._executive = executive
        self._timeouts = {port.name: timeout for port, timeout in timeouts.items()}
        self._on_silence = on_silence
        self._silent_at: dict[str, int] = {}
        self._is_silent = False
        for port in timeouts:
            executive.simulator.listen(port, self._listener(port.name))
        executive.hooks.append(self)

    def why_silent(self, now: int) -> str | None:
        """Pre-arm check: which port has had no value for too long; None if all that had any do."""
        for name, at in self._silent_at.items():
            if now >= at:
                return f"no value has come at input {name} for {self._timeouts[name] / SECOND:g} s"
        return None

    def between_steps(self, now: int, _left: int) -> None:
        """Notice a silence as soon as it is one."""
        why, was_silent = self.why_silent(now), self._is_silent
        self._is_silent = why is not None
        if why is not None and not was_silent:
            self._on_silence(why)
        next_at = min((at for at in self._silent_at.values() if at > now), default=NEVER)
        self._executive.poll_by(next_at)

    def _listener(self, name: str) -> Callable[[int, object], None]:
        timeout = self._timeouts[name]

        def note(at: int, _value: object) -> None:
            self._silent_at[name] = at + timeout

        return note


class RightToDrive(NotedInterlock):
    """Interlock of one run: its `arming` decides once it has one.

    Without it, a run that is `unsupervised` may drive, and no other.
    """

    def __init__(self, *, unsupervised: bool) -> None:
        self.arming: Arming | None = None
        self._is_unsupervised = unsupervised

    def __call__(self) -> bool:
        """Return whether outputs may be driven now."""
        arming, answers = self.arming, self.answers
        enabled = self._is_unsupervised if arming is None else arming.interlock()
        if answers is not None:
            answers.append(enabled)
        return enabled

    @property
    def supervision(self) -> Arming | None:
        """Arming of a run that may not drive of itself; None for any other."""
        return None if self.arming is None or self.arming.is_free else self.arming

    def suspend(self, why: str) -> bool:
        """Have the outputs off until all pre-arm checks pass; False for a run without arming."""
        if self.arming is None:
            return False
        self.arming.suspend(why)
        return True


LOOK_EVERY: Final = 100 * MILLISECOND
FAILED_AFTER: Final = 200 * MILLISECOND
"""Ns for which a device must not have worked."""
AGAIN_AFTER: Final = 10 * SECOND
"""Ns from one sentence on a device that fails to the next."""


class DeviceMessages:
    """A hook: `log` gets a sentence when a device fails that had worked, and when it works again.

    A sample missed now and then is no sentence, and a device that fails again and again is one
    every AGAIN_AFTER. One that never came up is for the end of the run to judge. It looks from a
    fault on until all work, so a tick without one costs nothing; always where a device reports no
    faults.
    """

    def __init__(self, executive: Executive, log: Callable[[str], None]) -> None:
        self._log = log
        self._look_at = 0
        self._hooks = executive.hooks
        self._watched: list[_Watched] = []
        for atomic in executive.simulator.atomics:
            if isinstance(atomic, Device):
                ports = [each for each in atomic.out_ports.values() if carries_faults(each)]
                for port in ports:
                    executive.simulator.listen(port, self._watch)
                path = below_root(atomic.path)
                self._watched.append(_Watched(path, atomic, executive, reports_faults=bool(ports)))
        if not self._is_quiet:
            self._watch()

    @property
    def _is_quiet(self) -> bool:
        """Whether nothing is to be said until another fault."""
        return all(watched.is_quiet for watched in self._watched)

    def _watch(self, *_fault: object) -> None:
        if self not in self._hooks:
            self._hooks.append(self)

    def between_steps(self, now: int, _left: int) -> None:
        """Ask the devices, if it is time to."""
        if now < self._look_at or now == NEVER:
            return
        self._look_at = now + LOOK_EVERY
        for watched in self._watched:
            if (sentence := watched.news(now)) is not None:
                self._log(sentence)
        if self._is_quiet:
            self._hooks.remove(self)


class _Watched:
    """One device, and what was said of it."""

    def __init__(
        self, path: str, device: Device, executive: Executive, *, reports_faults: bool
    ) -> None:
        self._path = path
        self._device = device
        self._faults = executive.faults
        self._readiness = executive.readiness
        self._reports_faults = reports_faults
        self._fails_since = NEVER
        """When it was first seen not to work, after it had; NEVER while it works."""
        self._is_said = False
        self._again_at = 0

    @property
    def is_quiet(self) -> bool:
        """Return whether nothing becomes of it without a fault that it reports."""
        return self._reports_faults and self._fails_since == NEVER

    def news(self, now: int) -> str | None:
        """Return a sentence on what has become of it, if that is to be said now."""
        why = self._device.unready()
        if why is None:
            return self._working(now)
        if self._fails_since == NEVER and self._readiness.has_worked(self._device):
            self._fails_since = now
        lasts = now - self._fails_since >= FAILED_AFTER
        if self._is_said or not lasts or now < self._again_at:
            return None
        self._is_said, self._again_at = True, now + AGAIN_AFTER
        last = self._faults.last_of(self._path)
        return f"{self._path} {why}" if last is None else f"{self._path} {why}: {last.sentence}"

    def _working(self, now: int) -> str | None:
        since, was_said = self._fails_since, self._is_said
        self._fails_since, self._is_said = NEVER, False
        if not was_said:
            return None
        return f"{self._path} works again, after {(now - since) / SECOND:.1f} s"
