"""One activation is one period, whatever phases lie in between; and models without a period."""

from functools import partial

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import MICROSECOND, MILLISECOND, NEVER, SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.policy import ActivationPolicy
from firmware_runtime.statistics import file_header
from firmware_runtime.statistics.summary import periods_not_kept
from tests.support.executives import Run
from tests.support.periodic_models import Actuator, Sampler
from tests.support.phased_models import FIFTY_HZ, PERIODS, Board, Phased, Sporadic, deadlines
from tests.support.stalling_clock import StallingClock

PERIOD = 20 * MILLISECOND
UNTIL = 4 * SECOND


@pytest.fixture(autouse=True)
def no_time_passes_but_the_clocks(monkeypatch: pytest.MonkeyPatch) -> None:
    """A reader adds the real time since a run under way last wrote; a busy machine has some."""
    monkeypatch.setattr(file_header, "monotonic_ns", lambda: 0)


def test_a_50_hz_model_of_three_phases_has_201_activations_in_4_s() -> None:
    sensor = Phased("sensor", PERIOD, FIFTY_HZ)
    run = Run(sensor, VirtualClock())
    run.until(UNTIL)
    assert sensor.transitions == 3 * 200 + 2  # trigger and wait have no time between them
    assert run.counts("sensor") == (201, 201, 0, 0)
    assert run.model("sensor")["irregular"] == 0


def test_its_own_time_is_that_of_all_phases_and_its_lateness_that_of_the_first() -> None:
    sensor, clock = Phased("sensor", PERIOD, FIFTY_HZ), StallingClock({2: 300 * MICROSECOND})
    sensor.work = lambda number: clock.spend(MILLISECOND * (1 + number % 3))
    run = Run(sensor, clock)
    run.until(PERIOD * 5 - 1)
    sensor_counted = run.model("sensor")
    assert run.counts("sensor") == (5, 5, 0, 0)
    assert sensor_counted["step_us"]["max"] == sensor_counted["step_us"]["mean"] == 6000
    assert sensor_counted["lateness_us"]["max"] == 300
    assert sensor_counted["load"] == pytest.approx(0.3, rel=0.01)


def test_after_a_stall_the_late_period_runs_once_and_whole_periods_are_dropped() -> None:
    sensor = Phased("sensor", PERIOD, FIFTY_HZ)
    run = Run(sensor, StallingClock({10: 500 * MILLISECOND}))
    run.until(UNTIL)
    assert run.counts("sensor")[0] == 201
    assert run.counts("sensor")[1] == sensor.cycles
    assert run.counts("sensor")[2] == 24
    assert run.model("sensor")["irregular"] == 0


def test_a_model_that_does_not_keep_its_period_is_named_and_counted_by_the_clock() -> None:
    sensor = Phased("sensor", PERIOD, (0, 6 * MILLISECOND, 20 * MILLISECOND))  # 26 ms in truth
    run = Run(sensor, VirtualClock())
    run.until(UNTIL)
    scheduled, executed = run.counts("sensor")[:2]
    assert executed == sensor.cycles
    assert abs(scheduled - deadlines(0, PERIOD, UNTIL)) <= 1
    counted = run.json()
    assert counted["models"]["sensor"]["irregular"] == executed - 1
    assert counted["models"]["sensor"]["returned_after_us"] == 26_000
    assert run.figures().not_keeping_period == ["sensor"]
    (sentence,) = periods_not_kept(run.figures())
    assert "20 ms" in sentence
    assert "26 ms" in sentence


def test_a_bring_up_that_shifts_the_phase_once_is_no_contradiction() -> None:
    class BroughtUp(Phased):
        """Two steps of a bring-up before its cycle begins, at 13 ms."""

        is_up = False

        def internal(self) -> None:
            if self.is_up:
                super().internal()
            else:
                self.is_up = self.phase == "waiting more"
                self.hold_in("waiting more", 10 * MILLISECOND if self.is_up else 3 * MILLISECOND)

    run = Run(BroughtUp("sensor", PERIOD, FIFTY_HZ), VirtualClock())
    run.until(UNTIL)
    counted = run.json()
    assert counted["models"]["sensor"]["irregular"] <= 1
    assert abs(counted["scheduled"] - deadlines(0, PERIOD, UNTIL)) <= 1
    assert run.figures().not_keeping_period == []


class Drifting(Sampler):
    """Comes back a third of a period too late each time, but for a nanosecond in three."""

    def internal(self) -> None:
        super().internal()
        self.hold_in("waiting", self.period + self.period // 3)


def test_what_a_model_has_slipped_before_an_input_moves_it_is_forgotten() -> None:
    robot, clock = Fed(Drifting("sampler")), StallingClock()
    run = Run(robot, clock)
    clock.at(30 * MILLISECOND, partial(run.executive.inbox.post, robot.command, 20 * MILLISECOND))
    run.until(95 * MILLISECOND)  # at 0, 13, 27, 50, 63, 77 and 90 ms
    assert run.counts("sampler") == (7, 7, 0, 0)


def test_it_is_forgotten_too_where_an_input_brings_an_activation_forward() -> None:
    sampler = Sampler("sampler")
    spans = iter((sampler.period + 1, *[sampler.period] * 2, 2 * sampler.period - 1))
    robot, clock = Fed(sampler), StallingClock()
    sampler.work = lambda _number: setattr(sampler, "period", next(spans, NEVER))
    run = Run(robot, clock)
    clock.at(15 * MILLISECOND, partial(run.executive.inbox.post, robot.command, 2 * MILLISECOND))
    run.until(50 * MILLISECOND)  # at 0, 10, 17, 27 and 47 ms: but for a nanosecond never a period
    assert run.counts("sampler") == (5, 5, 0, 0)


def test_an_activation_that_an_input_has_a_passive_model_book_is_due_like_any_other() -> None:
    def fail(_number: int) -> None:
        raise ValueError

    robot, clock = Fed(Sampler("sampler", offset=NEVER)), StallingClock()
    robot.sampler.work = fail
    run = Run(robot, clock)
    clock.at(3 * MILLISECOND, partial(run.executive.inbox.post, robot.command, 4 * MILLISECOND))
    run.until(SECOND)
    assert run.counts("sampler") == (1, 0, 1, 0)


def test_a_sporadic_model_has_its_events_and_its_reactions() -> None:
    class Fed(Coupled):
        def __init__(self) -> None:
            super().__init__("robot")
            self.command = self.in_port("command", int)
            self.sporadic = self.add(Sporadic("sporadic", 5 * MILLISECOND))
            self.couple(self.command, self.sporadic.command)

    robot, clock = Fed(), StallingClock({2: 3 * MILLISECOND})
    run = Run(robot, clock)
    for at in (10, 20, 40, 43):  # the last one comes before what the one before it had booked
        clock.at(at * MILLISECOND, partial(run.executive.inbox.post, robot.command, at))
    run.until(SECOND)
    counted = run.model("sporadic")
    assert robot.sporadic.acted == [10, 20, 43]
    assert run.counts("sporadic") == (3, 3, 0, 0)
    assert counted["reactions"] == robot.sporadic.answered == 4
    assert (counted["kind"], counted["period_us"]) == ("event", None)
    assert counted["overruns"] == 1
    assert counted["lateness_us"]["max"] == 3000


def test_an_event_is_one_however_soon_after_its_booking_it_is() -> None:
    phased = Phased("phased", NEVER, (1, MILLISECOND))
    run = Run(phased, VirtualClock())
    run.until(10)
    assert run.counts("phased") == (2, 2, 0, 0)


def test_an_event_is_one_however_soon_after_the_input_that_books_it() -> None:
    robot, clock = Fed(Sampler("sampler", NEVER, NEVER)), StallingClock()
    run = Run(robot, clock)
    clock.at(MILLISECOND, partial(run.executive.inbox.post, robot.command, 1))
    run.until(SECOND)
    assert run.counts("sampler") == (1, 1, 0, 0)


def test_an_event_that_was_due_when_the_run_ended_is_skipped() -> None:
    class Once(Actuator):
        def initialize(self) -> None:
            self.hold_in("waiting", MILLISECOND)

        def internal(self) -> None:
            raise ValueError

    run = Run(Once("once"), VirtualClock())
    run.until(SECOND)
    assert run.counts("once") == (1, 0, 1, 0)


class Fed(Coupled):
    """A sampler that an input moves."""

    def __init__(self, sampler: Sampler) -> None:
        super().__init__("robot")
        self.command = self.in_port("command", int)
        self.sampler = self.add(sampler)
        self.couple(self.command, sampler.replan)


@st.composite
def _phases(draw: st.DrawFn) -> tuple[int, ...]:
    """Durations, zeros among them, of a whole period."""
    parts = draw(st.lists(st.integers(0, 5 * MILLISECOND), min_size=0, max_size=5))
    return (*parts, draw(st.integers(MILLISECOND // 2, 5 * MILLISECOND)))


@pytest.mark.slow
@settings(max_examples=50)
@given(
    phases=_phases(),
    begin_at=st.integers(0, 9 * MILLISECOND),
    until=st.integers(0, 60 * MILLISECOND),
)
def test_any_structure_of_phases_is_scheduled_as_the_clock_says(
    phases: tuple[int, ...], begin_at: int, until: int
) -> None:
    sensor = Phased("sensor", sum(phases), phases, begin_at=begin_at)
    run = Run(sensor, VirtualClock())
    run.until(until)
    expected = deadlines(begin_at, sum(phases), until)
    assert run.counts("sensor") == (expected, expected, 0, 0)
    assert run.model("sensor")["irregular"] == 0


@pytest.mark.slow
@settings(max_examples=40)
@given(
    phases=_phases(),
    stalls=st.dictionaries(st.integers(0, 60), st.integers(1, 40 * MILLISECOND), max_size=5),
    policy=st.sampled_from(["skip", "catch-up"]),
)
def test_no_stall_hides_a_period_whatever_its_phases(
    phases: tuple[int, ...], stalls: dict[int, int], policy: str
) -> None:
    until = 80 * MILLISECOND
    sensor = Phased("sensor", sum(phases), phases)
    policies = {"sensor": ActivationPolicy(policy)}  # type: ignore[arg-type]
    run = Run(sensor, StallingClock(stalls), Configuration(policies=policies, max_lag=NEVER))
    run.until(until)
    scheduled, executed, skipped, coalesced = run.counts("sensor")
    assert scheduled == deadlines(0, sum(phases), until) == executed + skipped
    assert coalesced == 0
    assert executed == sensor.cycles
    assert policy == "skip" or skipped <= 1


@pytest.mark.parametrize("stalls", [{}, {50: 90_000_000, 300: 7_000_000, 301: 400_000_000}])
def test_seven_models_of_incommensurate_periods_are_counted_exactly(
    stalls: dict[int, int],
) -> None:
    board, clock = Board(), StallingClock(stalls)
    run = Run(board, clock)
    commands = range(3, 1000, 97)
    for number in commands:
        post = partial(run.executive.inbox.post, board.command, number)
        clock.at(number * MILLISECOND, post)
    run.until(SECOND)
    for model, period in zip(board.periodic, PERIODS, strict=True):
        scheduled, executed, skipped, coalesced = run.counts(model.name)
        assert scheduled == deadlines(0, period, SECOND) == executed + skipped
        assert coalesced == 0
        assert executed == model.cycles
    assert run.counts("sporadic")[1] == len(board.sporadic.acted)
    total, executed, skipped, coalesced = run.counts()
    assert total == executed + skipped + coalesced
    assert list(run.json()["models"]) == [*(model.name for model in board.periodic), "sporadic"]


@pytest.mark.parametrize("period", [0, -1, 2.5, True])
def test_a_period_that_is_no_time_is_refused(period: int) -> None:
    with pytest.raises(ConfigError):
        Run(Phased("sensor", period, FIFTY_HZ), VirtualClock())


@pytest.mark.parametrize("policy", ["skip", "catch-up"])
def test_what_is_due_and_will_run_waits_and_what_will_not_is_skipped(policy: str) -> None:
    sampler, clock = Sampler("imu"), StallingClock()
    policies = {"imu": ActivationPolicy(policy)}  # type: ignore[arg-type]
    run = Run(sampler, clock, Configuration(policies=policies))
    seen: list[tuple[int, int, int]] = []

    def work(number: int) -> None:
        if number == 10:
            clock.spend(95 * MILLISECOND)
        if number == 11:
            model = run.model("imu")
            seen.append((model["scheduled"], model["waiting"], clock.now() // MILLISECOND))

    sampler.work = work
    run.until(SECOND)
    late, on_time = (11, 9, 195), (20, 0, 200)
    assert seen == [on_time if policy == "skip" else late]


class Beside(Coupled):
    """A 50 Hz sensor, and a model that keeps the loop busy once, `busy_at` ns after the start."""

    def __init__(self, clock: StallingClock, busy_at: int, busy_for: int) -> None:
        super().__init__("robot")
        self.busy = self.add(Phased("busy", SECOND, (SECOND,), begin_at=busy_at))
        self.sensor = self.add(Phased("sensor", PERIOD, FIFTY_HZ))
        self.busy.work = lambda _number: clock.spend(busy_for)


def readings(robot: Beside, clock: StallingClock, until: int) -> list[tuple[int, ...]]:
    """What is run, skipped and waiting, as read at each transition of the sensor."""
    run = Run(robot, clock)
    seen: list[tuple[int, ...]] = []

    def look(_number: int) -> None:
        model = run.model("sensor")
        seen.append((model["run"], model["skipped"], model["waiting"]))

    robot.sensor.work = look
    run.until(until)
    scheduled, executed, skipped, _ = run.counts("sensor")
    assert scheduled == executed + skipped == deadlines(0, PERIOD, until)
    return seen


def test_no_counter_goes_back_while_a_late_model_is_within_its_period() -> None:
    clock = StallingClock()
    seen = readings(Beside(clock, 15 * MILLISECOND, 95 * MILLISECOND), clock, SECOND - 1)
    # five deadlines have passed at 110 ms; of the first, phases are still to come in the third
    assert seen[3:7] == [(1, 4, 1), (1, 4, 1), (2, 4, 0), (2, 4, 0)]


def test_what_would_be_due_after_the_end_of_the_run_counts_at_no_instant() -> None:
    clock = StallingClock()
    seen = readings(Beside(clock, 95 * MILLISECOND, 95 * MILLISECOND), clock, 119 * MILLISECOND)
    assert {sum(reading) for reading in seen[15:]} == {6}  # at 190 ms, of a run of 119 ms


@pytest.mark.parametrize(("begins_again", "counted"), [(0, (9, 9, 0, 0)), (1, (9, 8, 0, 1))])
def test_an_overdue_event_that_an_answer_leaves_in_place_is_counted_once(
    begins_again: int, counted: tuple[int, ...]
) -> None:
    class Beacon(Actuator):
        """Acts every 10 ms; answers an input at once, and goes on or begins again."""

        left = 0
        acted = 0

        def initialize(self) -> None:
            self.hold_in("waiting", 10 * MILLISECOND)

        def external(self, elapsed: int) -> None:
            self.left = 10 * MILLISECOND if begins_again else self.sigma - elapsed
            self.hold_in("answering", 0)

        def internal(self) -> None:
            self.acted += self.phase == "waiting"
            left = self.left if self.phase == "answering" else 10 * MILLISECOND
            self.hold_in("waiting", left)

    class Fed(Coupled):
        def __init__(self) -> None:
            super().__init__("robot")
            self.command = self.in_port("command", int)
            self.beacon = self.add(Beacon("beacon"))
            self.busy = self.add(Phased("busy", SECOND, (SECOND,), begin_at=9 * MILLISECOND))
            self.couple(self.command, self.beacon.command)

    robot, clock = Fed(), StallingClock()
    robot.busy.work = lambda _number: clock.spend(6 * MILLISECOND)
    run = Run(robot, clock)
    post = partial(run.executive.inbox.post, robot.command, 1)
    clock.at(9_500_000, post)  # handled at 15 ms, when the event at 10 ms is due already
    run.until(99 * MILLISECOND)
    assert run.counts("beacon") == counted
    assert robot.beacon.acted == counted[1]
    assert run.model("beacon")["reactions"] == 1


@pytest.mark.parametrize("phases", [(PERIOD,), (6 * MILLISECOND, 14 * MILLISECOND), FIFTY_HZ])
@pytest.mark.parametrize("restart_after", [0, 2 * MILLISECOND])
def test_an_input_that_begins_the_cycle_again_moves_the_deadlines(
    phases: tuple[int, ...], restart_after: int
) -> None:
    class Restarted(Phased):
        """Its cycle begins again soon after an input."""

        def __init__(self) -> None:
            super().__init__("sensor", PERIOD, phases)
            self.command = self.in_port("command", int)

        def external(self, elapsed: int) -> None:  # noqa: ARG002 -- it forgets what it had booked
            self.transitions = 0
            self.hold_in("beginning again", restart_after)

    class Fed(Coupled):
        def __init__(self) -> None:
            super().__init__("robot")
            self.command = self.in_port("command", int)
            self.sensor = self.add(Restarted())
            self.couple(self.command, self.sensor.command)

    robot, clock = Fed(), StallingClock()
    run = Run(robot, clock)
    restarts = range(25 * MILLISECOND + 1, SECOND, 25 * MILLISECOND)
    for at in restarts:
        clock.at(at, partial(run.executive.inbox.post, robot.command, 1))
    run.until(SECOND)
    counted = run.json()
    assert counted["models"]["sensor"]["irregular"] == 0
    assert run.figures().not_keeping_period == []
    assert counted["skipped"] == counted["coalesced"] == 0
    assert len(restarts) <= counted["scheduled"] <= 2 * len(restarts) + 2
