"""What crosses the cut around a part goes by the same name in every recording."""

from pathlib import Path

import pytest

from firmware_runtime import open_board
from firmware_runtime.blackbox.found import recording_beside
from firmware_runtime.blackbox.models import output_ports, own_atomics
from firmware_runtime.board.registry import load
from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.part import part_of
from firmware_runtime.devs.ports import OutPort
from firmware_runtime.identification.events import kept, recorded
from firmware_runtime.part_recording.cut import Cut, cut_around
from firmware_runtime.part_recording.of_board import components, cut_of
from firmware_runtime.recording.values import made
from tests.support.devs_models import Clock, Log


class Inside(Coupled):
    """Two clocks within: `one` leaves by `single`, both by `both`; `straight` passes through."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.inlet = self.in_port("inlet", int)
        self.single = self.out_port("single", int)
        self.both = self.out_port("both", int)
        self.straight = self.out_port("straight", int)
        self.inner_and_inlet = self.out_port("inner_and_inlet", int)
        one, two, log = self.add(Clock("one", 3)), self.add(Clock("two", 5)), self.add(Log("log"))
        self.couple(one.ticks, self.single)
        self.couple(one.ticks, self.both)
        self.couple(two.ticks, self.both)
        self.couple(self.inlet, self.straight)
        self.couple(one.ticks, self.inner_and_inlet)
        self.couple(self.inlet, self.inner_and_inlet)
        self.couple(self.inlet, log.values)


def cut(source: str, *, returns: bool = False) -> Cut:
    """Around `part`, which takes one port of `sensor`, and has all its own taken by `motor`."""
    whole = Coupled("robot")
    sensor, part = whole.add(Inside("sensor")), whole.add(Inside("part"))
    motor = whole.add(Log("motor"))
    port: OutPort[int] = getattr(sensor, source)
    if returns:
        whole.couple(part.single, sensor.inlet)
    whole.couple(port, part.inlet)
    for each in (part.single, part.both, part.straight):
        whole.couple(each, motor.values)
    return cut_around(whole, ["part"])


def names(found: Cut) -> dict[str, str]:
    return {crossing: each.name for crossing, each in found.entrances.items()}


def test_what_leaves_goes_by_who_sends_it_and_what_passes_through_by_its_exit() -> None:
    assert list(cut("single").leaving) == ["part.one.ticks", "part.two.ticks", "part.straight"]


@pytest.mark.parametrize(
    ("source", "name"), [("single", "sensor.one.ticks"), ("both", "sensor.both")]
)
def test_what_enters_goes_by_who_sends_it_if_that_is_one(source: str, name: str) -> None:
    assert names(cut(source)) == {f"sensor.{source}": name}


def test_a_part_that_runs_alone_has_the_names_it_has_in_a_whole_that_sends_it_nothing() -> None:
    def whole() -> Coupled:
        root = Coupled("robot")
        silent, part = Coupled("silent"), Inside("part")
        root.add(silent)
        root.add(part)
        root.couple(silent.out_port("out", int), part.inlet)
        root.couple(part.inner_and_inlet, root.add(Log("motor")).values)
        return root

    alone = part_of(whole(), ["part"]).model
    leaving = [list(cut_around(each, ["part"]).leaving) for each in (whole(), alone)]
    assert leaving == [["part.inner_and_inlet"], ["part.inner_and_inlet"]]


def test_what_comes_back_into_the_part_is_told_from_what_left_it() -> None:
    found = cut("straight", returns=True)
    assert names(found) == {"sensor.straight": "sensor.straight"}
    assert "part.one.ticks" in found.leaving


def test_what_one_port_sends_through_two_is_told_apart() -> None:
    whole = Coupled("robot")
    sensor, log = whole.add(Inside("sensor")), whole.add(Log("part"))
    whole.couple(sensor.single, log.values)
    whole.couple(sensor.both, log.values)
    found = names(cut_around(whole, ["part"]))
    assert found == {"sensor.single": "sensor.single", "sensor.both": "sensor.both"}


@pytest.mark.parametrize("board", ["tachobot", "detective"])
@pytest.mark.parametrize("role", ["controller", "robot"])
def test_a_part_has_the_names_of_the_whole_and_of_the_run_whether_or_not_it_runs_alone(
    board: str, role: str
) -> None:
    loaded = load(board)
    whole = loaded.unconnected().model
    known = {below_root(port.path) for port in output_ports(own_atomics(whole))} | {*whole.in_ports}
    of_whole = cut_of(loaded, role, whole)
    alone = part_of(loaded.unconnected().model, components(loaded, role))
    of_part = cut_of(loaded, role, alone.model)
    assert names(of_whole) == names(of_part)
    assert list(of_whole.leaving) == list(of_part.leaving)
    assert known >= {*names(of_whole).values(), *of_whole.leaving}
    assert list(of_part.entrances) == [
        below_root(port.path).replace(":", ".") for port in alone.model.in_ports.values()
    ]


@pytest.mark.slow
def test_both_recordings_of_a_run_have_the_same_values_under_the_same_names(
    tmp_path: Path,
) -> None:
    statistics, part = tmp_path / "run.statistics", tmp_path / "part.recording"
    with open_board(
        "tachobot", doubles=True, clock="virtual", statistics=statistics, record=part
    ) as robot:
        robot.run(1.0)
    of_part = [(each.at_s, each.port, made(each.value)) for each in recorded(part)]
    of_run = [tuple(each) for each in kept(recording_beside(statistics))]
    crossed = {port for _, port, _ in of_part}
    assert crossed == {"imu.sample", "controller.allocation.forces"}
    for port in crossed:
        values = [each for each in of_part if each[1] == port]
        assert values
        assert values == [each for each in of_run if each[1] == port]
