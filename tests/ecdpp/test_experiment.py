from pathlib import Path

import pytest

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.model_errors import ModelFailure
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.ecdpp.event_file import Event
from firmware_runtime.ecdpp.experiment import (
    AFTERMATH,
    Experiment,
    OutputLine,
    OutputRecord,
    end_of,
    run_events,
    write_outputs,
)
from firmware_runtime.models.delay import Delay


class Copies(Atomic):
    """Puts out what came in, at once, on `Zulu` before `Alpha`."""

    def __init__(self) -> None:
        super().__init__("copies")
        self.first = self.in_port("first", float)
        self.second = self.in_port("second", float)
        self.zulu = self.out_port("Zulu", float)
        self.alpha = self.out_port("Alpha", float)
        self.held: list[float] = []

    def external(self, elapsed: int) -> None:
        assert elapsed >= 0
        self.held = [*self.first, *self.second]
        self.activate()

    def output(self) -> None:
        for value in self.held:
            self.zulu.send(value)
            self.alpha.send(value)


class Ticker(Atomic):
    """Sends True every second, without end."""

    def __init__(self) -> None:
        super().__init__("ticker")
        self.tick = self.out_port("tick", bool)
        self.sigma = SECOND

    def initialize(self) -> None:
        self.hold_in("ticking", SECOND)

    def output(self) -> None:
        self.tick.send(True)

    def internal(self) -> None:
        self.initialize()

    def exit(self) -> None:
        raise OSError("device lost")


def played(*events: Event, until: int | None = None) -> list[str]:
    return [str(line) for line in run_events(Copies(), events, until, checked=True)]


def test_lines_of_one_instant_are_in_order_of_port_name_and_then_of_sending() -> None:
    lines = played(Event(0, "second", 2.0), Event(0, "first", 1.5), Event(5, "first", 3.0))
    assert lines == [
        "00:00:00:000 alpha 1.5",
        "00:00:00:000 alpha 2",
        "00:00:00:000 zulu 1.5",
        "00:00:00:000 zulu 2",
        "00:00:00:000 alpha 3",
        "00:00:00:000 zulu 3",
    ]


def test_events_play_at_their_instants() -> None:
    lines = played(
        Event(0, "first", 1.0), Event(SECOND, "first", 2.0), Event(SECOND, "second", 3.0)
    )
    assert [line for line in lines if "alpha" in line] == [
        "00:00:00:000 alpha 1",
        "00:00:01:000 alpha 2",
        "00:00:01:000 alpha 3",
    ]


def test_a_run_ends_with_the_instant_it_was_given() -> None:
    events = [Event(at * MILLISECOND, "first", 1.0) for at in (1, 2, 3)]
    assert len(played(*events, until=2 * MILLISECOND)) == 4
    assert len(played(*events, until=2 * MILLISECOND - 1)) == 2


def test_a_run_without_a_stated_end_goes_on_a_while_after_the_last_event() -> None:
    assert end_of([]) == AFTERMATH
    delay = Delay("delay", float, 3 * SECOND)
    [line] = run_events(delay, [Event(7 * SECOND, "in", 1.0)])
    assert line.at == 10 * SECOND


def test_a_failing_exit_is_not_hidden() -> None:
    with pytest.raises(ModelFailure, match=r"experiment\.ticker .* device lost"):
        run_events(Ticker(), [])


def test_an_experiment_runs_again_from_the_start() -> None:
    experiment = Experiment(Copies(), [Event(MILLISECOND, "first", 1.0)])
    for _ in range(2):
        simulator = Simulator(experiment)
        record = OutputRecord(simulator)
        simulator.run(SECOND)
        assert [line.port for line in record.lines] == ["alpha", "zulu"]


@pytest.mark.parametrize(
    ("value", "text"),
    [(1, "1"), (1.0, "1"), (-2.0, "-2"), (0.25, "0.25"), (True, "1"), (False, "0"), ("on", "on")],
)
def test_values_are_written_as_numbers_where_they_are_numbers(value: object, text: str) -> None:
    assert str(OutputLine(0, "out", value)) == f"00:00:00:000 out {text}"


def test_times_have_three_digits_of_milliseconds_and_finer_ones_are_cut() -> None:
    at = ((25 * 60 + 1) * 60 + 2) * SECOND + 3 * MILLISECOND + 999_999
    assert str(OutputLine(at, "out", 1)) == "25:01:02:003 out 1"


def test_an_output_file_has_one_line_each(tmp_path: Path) -> None:
    path = tmp_path / "mission.out"
    write_outputs(path, [OutputLine(0, "a", 1), OutputLine(SECOND, "b", 2.5)])
    assert path.read_bytes() == b"00:00:00:000 a 1\n00:00:01:000 b 2.5\n"
    write_outputs(path, [])
    assert path.read_bytes() == b""
