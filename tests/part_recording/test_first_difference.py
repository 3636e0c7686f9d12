"""A changed model, a changed input and a changed gain are found, with time, port and field."""

from msgspec.structs import replace as with_changed

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.part import part_of
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.part_recording.comparison import Comparison, compare
from firmware_runtime.part_recording.cut import cut_around
from firmware_runtime.part_recording.recorder import Recorder
from firmware_runtime.part_recording.recording import Recording
from firmware_runtime.part_recording.records import Entered
from firmware_runtime.part_recording.replay import replay
from tests.support.devs_models import Clock, Log
from tests.support.recorded_models import KeptFrames, header_of, recording_of


class Sum(Clock):
    """Sends the sum of what has come so far times a gain, every 10 ns."""

    def __init__(self, name: str, gain: int = 1) -> None:
        super().__init__(name, 10)
        self.inlet = self.in_port("inlet", int)
        self.gain = gain
        self.sum = 0

    def output(self) -> None:
        self.ticks.send(self.gain * self.sum)

    def external(self, elapsed: int) -> None:
        self.sum += sum(self.inlet)
        self.continue_(elapsed)


class Robot(Coupled):
    """sensor -> controller -> motor; a gain may change while it runs."""

    def __init__(self, controller: Sum) -> None:
        super().__init__("robot")
        self.sensor = self.add(Clock("sensor", 3))
        self.controller = self.add(controller)
        self.motor = self.add(Log("motor"))
        self.couple(self.sensor.ticks, controller.inlet)
        self.couple(controller.ticks, self.motor.values)

    def retune(self, gain: int) -> None:
        self.controller.gain = gain


def recorded() -> Recording:
    """A run of 60 ns: the gain becomes 5 after 32 ns, the event at 40 ns is put off to 44 ns."""
    sink, robot = KeptFrames(), Robot(Sum("controller"))
    simulator, cut = Simulator(robot), cut_around(robot, ["controller"])
    recorder = Recorder(simulator, cut, header_of(cut), sink, is_real_time=False)
    while (at := simulator.next_at) <= 60:
        simulator.advance(at)
        if at == 30:
            robot.retune(5)
            recorder.retuned(5)
        if at == 39:
            simulator.postpone(robot.controller, 44)
        recorder.between_steps(0, 0)
    assert recorder.close("ended", "") is None
    return recording_of(sink)


def compared(recording: Recording, controller: Sum) -> Comparison:
    robot = Robot(controller)
    part = part_of(robot, ["controller"])
    return compare(recording, replay(recording, part.model, robot.retune))


def test_gains_and_late_events_of_the_run_are_those_of_the_replay() -> None:
    comparison = compared(recorded(), Sum("controller"))
    assert comparison.is_equal
    assert comparison.events == 5


def test_a_changed_gain_is_found_with_its_field() -> None:
    comparison = compared(recorded(), Sum("controller", gain=2))
    assert comparison.first is not None
    assert comparison.first.as_json(comparison.state) == {
        "t_ns": 10,
        "port": "controller.ticks",
        "recorded": 3,
        "replayed": 6,
        "state": {"field": "controller.gain", "t_ns": 3, "recorded": 1, "replayed": 2},
    }
    assert comparison.differences == 2 + 1  # the last before the gain was changed at 30 ns


def test_changed_code_is_found_with_the_field_it_left_another() -> None:
    class Forgetful(Sum):
        def internal(self) -> None:
            super().internal()
            if self.count == 2:
                self.sum = 0

    comparison = compared(recorded(), Forgetful("controller"))
    assert comparison.first is not None
    assert comparison.state is not None
    assert (comparison.first.at, comparison.first.port) == (30, "controller.ticks")
    assert (comparison.state.at, comparison.state.field) == (20, "controller.sum")
    assert not comparison.is_equal


def test_a_changed_input_is_found_at_the_next_output() -> None:
    recording = recorded()
    records = [
        with_changed(record, value=99)
        if isinstance(record, Entered) and record.at == 15
        else record
        for record in recording.records
    ]
    changed = Recording(recording.header, records, 0, recording.ended)
    comparison = compared(changed, Sum("controller"))
    assert comparison.first is not None
    assert comparison.state is not None
    assert comparison.first.at == 20
    assert (comparison.state.at, comparison.state.field) == (15, "controller.sum")


def test_an_output_that_only_one_side_has_is_a_difference() -> None:
    comparison = compared(recorded(), Silent("controller"))
    assert comparison.first is not None
    assert comparison.first.as_json(None)["replayed"] == "no event"
    assert comparison.differences == comparison.events == 5


class Silent(Sum):
    def output(self) -> None:
        pass


class Failing(Sum):
    def internal(self) -> None:
        raise ZeroDivisionError


def test_a_replay_that_fails_is_no_equal_one() -> None:
    comparison = compared(recorded(), Failing("controller"))
    assert comparison.fault is not None
    assert not comparison.is_equal


def test_a_recording_without_an_output_is_no_proof() -> None:
    recording = recorded()
    records = [each for each in recording.records if each.at == 3]
    comparison = compared(Recording(recording.header, records, 0, None), Sum("controller"))
    assert not comparison.is_equal
