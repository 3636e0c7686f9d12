"""A file that was cut off or damaged is read up to its last whole batch."""

from pathlib import Path

import msgspec
import pytest

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.errors import ConfigError
from firmware_runtime.part_recording.cut import cut_around
from firmware_runtime.part_recording.frames import frame
from firmware_runtime.part_recording.recorder import Recorder
from firmware_runtime.part_recording.recording import read_recording
from firmware_runtime.part_recording.records import Left
from firmware_runtime.recording.file_kind import PART_MAGIC
from firmware_runtime.recording.values import pack
from tests.support.devs_models import Clock, Echo, Log
from tests.support.recorded_models import KeptFrames, header_of, recording_of


class Robot(Coupled):
    """sensor -> controller -> motor."""

    def __init__(self) -> None:
        super().__init__("robot")
        self.sensor = self.add(Clock("sensor", 10))
        self.controller = self.add(Echo("controller"))
        self.motor = self.add(Log("motor"))
        self.couple(self.sensor.ticks, self.controller.inlet)
        self.couple(self.controller.outlet, self.motor.values)


def recorded(sink: KeptFrames, until: int = 50) -> Recorder:
    robot = Robot()
    simulator, cut = Simulator(robot), cut_around(robot, ["controller"])
    recorder = Recorder(simulator, cut, header_of(cut), sink, is_real_time=False)
    for at in range(10, until + 1, 10):
        simulator.advance(at)
        recorder.between_steps(0, 0)
    return recorder


def test_a_file_cut_off_anywhere_holds_everything_before_the_cut(tmp_path: Path) -> None:
    sink = KeptFrames()
    recorded(sink).close("ended", "")
    whole = recording_of(sink)
    assert not whole.is_cut
    path = tmp_path / "cut.recording"
    header_ends = len(PART_MAGIC + frame(pack(msgspec.to_builtins(whole.header))))
    lengths = []
    for size in range(header_ends, len(sink.content), 7):
        path.write_bytes(sink.content[:size])
        cut = read_recording(path)
        assert cut.records == whole.records[: len(cut.records)]
        assert cut.incomplete() == "the file ends before the run did"
        lengths.append(len(cut.records))
    assert lengths == sorted(lengths)
    assert len(set(lengths)) > 4


def test_a_damaged_batch_ends_what_can_be_known(tmp_path: Path) -> None:
    sink = KeptFrames()
    recorded(sink).close("ended", "")
    sink.content[-3] ^= 1
    path = tmp_path / "damaged.recording"
    path.write_bytes(sink.content)
    assert read_recording(path).is_cut


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"FWRREC",
        b"something else, and long enough for a header",
        PART_MAGIC,
        PART_MAGIC + b"\xff" * 40,
        PART_MAGIC + frame(b"\xc0"),
        PART_MAGIC + frame(b"\x81\xa6format\x01"),
    ],
)
def test_what_is_no_recording_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "other.recording"
    path.write_bytes(content)
    with pytest.raises(ConfigError):
        read_recording(path)


def test_a_recording_of_another_format_is_refused(tmp_path: Path) -> None:
    robot = Robot()
    header = msgspec.to_builtins(header_of(cut_around(robot, ["controller"])))
    of_before = {key: each for key, each in header.items() if key != "crossings"} | {"format": 1}
    path = tmp_path / "other.recording"
    path.write_bytes(PART_MAGIC + frame(pack(of_before)))
    with pytest.raises(ConfigError, match="format 1; expected 2"):
        read_recording(path)


def test_a_text_that_cannot_be_written_is_dropped_counted_and_said() -> None:
    class Speaker(Clock):
        """Says what UTF-8 has not, and has it in its state."""

        def __init__(self) -> None:
            super().__init__("controller", 10)
            self.said = self.out_port("said", str)
            self.heard = {"\udcff": "\udcff"}

        def output(self) -> None:
            self.said.send("\udcff" if self.count == 1 else "sound")

    robot, sink = Coupled("robot"), KeptFrames()
    speaker, log = robot.add(Speaker()), robot.add(Log("motor"))
    robot.couple(speaker.said, log.in_port("words", str))
    simulator, cut = Simulator(robot), cut_around(robot, ["controller"])
    recorder = Recorder(simulator, cut, header_of(cut), sink, is_real_time=False)
    for at in (10, 20, 30):
        simulator.advance(at)
        recorder.between_steps(0, 0)
    fault = recorder.close("failed", "a reason \udcff")
    recording = recording_of(sink)
    assert fault is not None
    assert "a text cannot be recorded" in fault
    assert recorder.dropped == recording.missing == 1
    assert [each.at for each in recording.records if isinstance(each, Left)] == [10, 30]
    assert recording.ended is not None
    assert recording.ended.reason == "a reason \\udcff"


def test_what_the_writer_does_not_take_is_counted_and_said() -> None:
    sink = KeptFrames()
    recorder = recorded(sink)
    sink.has_room = False
    recorder.retuned(1.0)
    recorder.between_steps(0, 0)
    sink.has_room = True
    assert recorder.close("ended", "") is not None
    assert recorder.dropped == recording_of(sink).missing > 0
