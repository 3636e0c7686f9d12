"""The ledger: after a step, all that is to be counted goes into the statistics file in one section.

What lines count themselves is copied, and what each device took in the step is noted.

During a step nothing is written, so a process killed in the middle of one leaves whole numbers. A
late step is counted with the others, at once; why it was late is found in the slack after it.
"""

from itertools import islice
from struct import Struct
from time import monotonic_ns, process_time_ns

from firmware_runtime.devs.time import MILLISECOND, NEVER
from firmware_runtime.executive.clocks import Clock, MonotonicClock
from firmware_runtime.executive.configuration import Bus, Port
from firmware_runtime.executive.inbox import Inbox
from firmware_runtime.executive.late_steps import AGAIN, LateSteps
from firmware_runtime.executive.profiler import Profiler
from firmware_runtime.executive.progress import Progress
from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.histogram import Cells, Histogram, record_all
from firmware_runtime.statistics.history import Lately, Timeline
from firmware_runtime.statistics.layout import (
    ACKNOWLEDGED,
    ARMED,
    BUS,
    CPU,
    DEVICES,
    ELAPSED,
    HEARTBEAT,
    INPUTS_DROPPED,
    SEQUENCE,
    SERIAL,
    STATE,
    STEP_HISTOGRAM,
    STEPS,
    WRITTEN,
    YIELDED,
    Layout,
)
from firmware_runtime.statistics.statistics import Statistics

FEW = 5
"""Steps after which it is known how long one takes."""
SETTLING = 100 * MILLISECOND
"""When a run reads its counters for the first time after its start; then each second."""
_OF_BUS = Struct(f"{len(BUS)}q")
_OF_PORT = Struct(f"{len(SERIAL)}q")


class Ledger:
    """Writes steps, idle moments and the end of a run into the file.

    What would be due after the last instant that belongs to the run (`go_on`) is not counted.
    """

    def __init__(
        self,
        file: StatisticsFile,
        profiler: Profiler,
        inbox: Inbox,
        clock: Clock,
        progress: Progress,
    ) -> None:
        cells, layout = file.cells, file.layout
        self.file = file
        self._until = NEVER
        self._step = profiler.step
        self._agenda = profiler.simulator.agenda
        self._accounting = profiler.accounting
        self._progress = progress
        self._garbage = profiler.garbage
        self._inbox = inbox
        self._faults = profiler.faults
        self._watches = [
            (layout.deadline(index), watch) for index, watch in enumerate(profiler.watches)
        ]
        self._buses = [
            BusMeter(bus, cells, layout, index) for index, bus in enumerate(profiler.buses)
        ]
        self._ports = [
            PortMeter(port, cells, layout, index) for index, port in enumerate(profiler.ports)
        ]
        self._faults.count_in(cells, layout)
        self._step_times = Histogram(cells[STEP_HISTOGRAM])
        self._steps = 0
        self._previous_end = 0
        self._cpu_time = CpuTime(clock)
        profiler.accounting.count_in(cells, layout)
        self._timeline = Timeline(cells[layout.timeline], self._growing)
        self._look_at = SETTLING
        """When the next second is over, or the counters are to be read for the first time."""
        self.late = LateSteps(file, profiler, clock, self._buses)

    def commit(self, arrival_at: int) -> int:
        """Write the step that has just ended; return when the next event is due.

        The next value that has arrived is due at `arrival_at`.
        """
        file, timeline, step, progress = self.file, self._timeline, self._step, self._progress
        cells, until, agenda = file.cells, self._until, self._agenda
        ended = step.ended = step.laps.read() - step.epoch
        step_time = ended - step.started
        if ended >= self._look_at:
            self._look(ended)
        cells[SEQUENCE] = file.sequence + 1  # as `open_section`
        samples: list[object] = [self._step_times, step_time]
        latest = self._accounting.settle(ended if ended <= until else until + 1, samples)
        record_all(samples)
        self._steps = cells[STEPS] = self._steps + 1
        self._read_counters()
        if step_time > timeline.step_max:
            timeline.step_max = step_time
        spent = ended - max(step.at, self._previous_end)
        if latest is not None and (
            latest.in_episode
            or latest.lateness > timeline.lateness_max
            or latest.lateness + step_time > self.late.worst.smallest
        ):
            if latest.lateness > timeline.lateness_max:
                timeline.lateness_max = latest.lateness
            self.late.note(latest, self._previous_end, spent, self._steps)
        elif spent > self.late.slow:
            self.late.pass_over(spent)
        self._garbage.spent = 0
        due, model = agenda.heap[0]
        if agenda.due_at[model] != due or arrival_at < due:
            due = min(agenda.next_at(), arrival_at)
        lag = 0 if due >= ended and progress.is_level else progress.note(ended, due)
        cells[ELAPSED] = self._previous_end = ended  # as `close_section`
        now_ns = monotonic_ns()
        cells[HEARTBEAT] = now_ns - lag
        if lag > 0:
            cells[WRITTEN] = now_ns
        file.sequence = cells[SEQUENCE] = file.sequence + 2
        return due

    def use_slack(self, left: int) -> None:
        """Find out why steps were late, if that fits into the `left` ns to the next event."""
        if not self.late.use_slack(left, self._steps):
            self._look_at = min(self._look_at, self._step.ended + AGAIN)

    def arm(self, *, armed: bool, epoch: int) -> None:
        """Note whether the run may drive its outputs, and which epoch it has seen."""
        self.file.open_section()
        self.file.cells[ARMED] = armed
        self.file.cells[ACKNOWLEDGED] = epoch
        self.file.close_section_as_it_was()

    def give_up_priority(self, now: int) -> None:
        """Note that the run is an ordinary process from now on."""
        self.file.open_section()
        self.file.cells[YIELDED] = now
        self.file.close_section(now)

    def statistics(self) -> Statistics:
        """A copy of what has been counted so far."""
        return self.file.statistics()

    def lately(self, since: int) -> Lately:
        """What became of activations since then, or up to a second before; reads a few cells."""
        return self._timeline.lately(since)

    def idle(self, now: int) -> None:
        """Show that the loop is alive while nothing is due."""
        self._progress.idle()
        self.file.open_section()
        self.file.close_section(now)

    def stand_still(self) -> None:
        """Note that nothing is due any more, without a sign of life."""
        self.file.open_section()
        self.file.cells[WRITTEN] = monotonic_ns()
        self.file.close_section_as_it_was()

    def pause(self, now: int) -> None:
        """Note that the run stands still at `now`: nothing becomes overdue until it goes on."""
        file = self.file
        self._cpu_time.pause()
        self.late.close()
        file.open_section()
        self._read_counters()
        file.cells[ELAPSED] = now
        file.cells[HEARTBEAT] = file.cells[WRITTEN] = 0
        file.close_section_as_it_was()

    def go_on(self, until: int) -> None:
        """The run goes on, or begins, to instant `until`; processor time of a pause is not its."""
        self._until = until
        self._cpu_time.go_on()
        self.late.open(self._steps)

    def finish(self, state: RunState, now: int, reason: str) -> None:
        """Write how the run ended; what was due by then, and has not run, is skipped."""
        file = self.file
        self.late.close()
        file.open_section()
        self._accounting.end(min(now, self._until))
        for _, watch in self._watches:
            watch.end(now)
        self._read_counters()
        self._timeline.close(now)
        file.cells[ARMED] = False
        file.cells[STATE] = state
        text = file.cells[file.layout.reason].cast("B")
        text[:] = reason.encode(errors="backslashreplace")[: len(text)].ljust(len(text), b"\0")
        file.close_section(now)

    def _read_counters(self) -> None:
        """Copy what lines, deadlines, faults and the inbox count themselves."""
        cells = self.file.cells
        if self._faults.pending:
            self._faults.write()
        cells[INPUTS_DROPPED] = self._inbox.dropped
        for bus in self._buses:
            bus.read()
        for port in self._ports:
            port.read()
        for first, watch in self._watches:
            cells[first] = watch.misses
            cells[first + 1] = watch.samples
            cells[first + 2] = watch.answers

    def _look(self, ended: int) -> None:
        """Close the timeline's second if it is over; let the counters be read in slack."""
        if ended >= self._timeline.closes_at:
            self.file.open_section()
            self._timeline.close(ended)
            self.file.close_section_as_it_was()
        if self._steps >= FEW:
            self.late.learn(self._step_times.sum // self._steps)
        self._look_at = self._timeline.closes_at
        self.late.ask_for_reading()

    def _growing(self) -> list[int]:
        """The counters whose growth over time is kept; once a second."""
        cells = self.file.cells
        cells[CPU] = self._cpu_time.spent()
        busy = sum(meter.busy_ns for meter in self._buses)
        return [*self._accounting.totals(), self._steps, busy, cells[CPU]]


class BusMeter:
    """Reads one bus after every step."""

    def __init__(self, bus: Bus, cells: Cells, layout: Layout, index: int) -> None:
        first = layout.bus(index)
        self._bus = bus
        self._block = cells[first : first + len(BUS)].cast("B")
        self.spent = [0] * DEVICES
        """The time each device with a place took in the last step, ns."""
        self._before = [0] * DEVICES
        self.read()  # what went over the bus before the run is in no step

    def read(self) -> None:
        """Copy the counters, and note what each device took since the last reading."""
        bus, spent, before = self._bus, self.spent, self._before
        _OF_BUS.pack_into(
            self._block, 0, bus.transactions, bus.bytes, bus.errors, bus.retries, bus.busy_ns
        )
        for index, device in enumerate(islice(bus.by_address.values(), DEVICES)):
            busy = device.busy_ns
            spent[index] = busy - before[index]
            before[index] = busy

    @property
    def busy_ns(self) -> int:
        """Time on the wire so far."""
        return self._bus.busy_ns

    @property
    def retries(self) -> int:
        """Attempts made again so far."""
        return self._bus.retries

    def addresses(self) -> list[int]:
        """Those of the devices with a place, filled up with zeros."""
        found = list(islice(self._bus.by_address, DEVICES))
        return found + [0] * (DEVICES - len(found))


class PortMeter:
    """Reads one serial port after every step."""

    def __init__(self, port: Port, cells: Cells, layout: Layout, index: int) -> None:
        first = layout.port(index)
        self._port = port
        self._block = cells[first : first + len(SERIAL)].cast("B")
        self.read()  # what went over the port before the run is in it, too

    def read(self) -> None:
        """Copy the counters."""
        port = self._port
        _OF_PORT.pack_into(
            self._block,
            0,
            port.writes,
            port.bytes_written,
            port.bytes_read,
            port.errors,
            port.writing_ns,
            port.reading_ns,
        )


class CpuTime:
    """Processor time of the run, without that of its pauses, ns.

    None passes on a clock that is not the machine's: in virtual time equal runs have equal
    statistics, whatever they cost.
    """

    def __init__(self, clock: Clock) -> None:
        self._now = process_time_ns if isinstance(clock, MonotonicClock) else int
        self._began_with = self._now()
        self._paused_with: int | None = None

    def spent(self) -> int:
        """So far."""
        return self._now() - self._began_with

    def pause(self) -> None:
        """Count no more for a while."""
        self._paused_with = self._now()

    def go_on(self) -> None:
        """Count again after a pause, if there was one."""
        if self._paused_with is not None:
            self._began_with += self._now() - self._paused_with
            self._paused_with = None
