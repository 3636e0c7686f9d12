"""`robot.port(path)`: what passes a port; names that there are not; how things show themselves."""

import sys
from dataclasses import dataclass

import pytest

from firmware_runtime import (
    SECOND,
    Atomic,
    ConfigError,
    Coupled,
    FirmwareRuntimeError,
    UnknownName,
    open_board,
    open_model,
)
from firmware_runtime.system.packages import install_command


@dataclass(frozen=True)
class Place:
    """A value with parts."""

    x: float
    turns: tuple[int, int]


class Walker(Atomic):
    """Sends where it is each second."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.place = self.out_port("place", Place)
        self.pace = self.in_port("pace", float)
        self._x = 0.0
        self._pace = 1.0

    def initialize(self) -> None:
        """Begin."""
        self.hold_in("walking", SECOND)

    def output(self) -> None:
        """Say where it is."""
        self.place.send(Place(self._x, (1, 2)))

    def internal(self) -> None:
        """Go on."""
        self._x += self._pace
        self.hold_in("walking", SECOND)

    def external(self, elapsed: int) -> None:
        """Walk at another pace."""
        self._pace = self.pace[-1]
        self.continue_(elapsed)


def walk() -> Coupled:
    model = Coupled("walk")
    walker = model.add(Walker("walker"))
    model.couple(model.in_port("pace", float), walker.pace)
    return model


def test_a_port_has_what_passed_it_since_it_was_asked_for() -> None:
    model = walk()
    with open_model(model, clock="virtual") as run:
        run.run(1.0)
        place, pace = run.port("walker.place"), run.port("pace")
        assert repr(place) == "<PortValues walker.place: no Place since 1 s>"
        run.plan(2.5, model.in_ports["pace"], 3.0)
        run.run(3.0)
        assert run.port("walker.place") is place
    assert place.times_s() == [2.0, 3.0, 4.0]
    assert [each.x for each in place.values()] == [1.0, 2.0, 5.0]
    assert (pace.times_s(), pace.values()) == ([2.5], [3.0])
    assert repr(place) == "<PortValues walker.place: 3 of Place, 2 s to 4 s>"


@pytest.mark.slow
def test_a_data_frame_has_a_column_for_each_part() -> None:
    with open_model(walk(), clock="virtual") as run:
        place, pace = run.port("walker.place"), run.port("pace")
        run.post(run.port("pace").port, 2.0)  # type: ignore[arg-type] # an input port
        run.run(2.0)
    frame = place.to_dataframe()
    assert frame.index.name == "t_s"
    assert list(frame.columns) == ["x", "turns.0", "turns.1"]
    assert frame["x"].tolist() == [0.0, 2.0]
    assert pace.to_dataframe()["value"].tolist() == [2.0]


def test_without_pandas_the_command_that_installs_it_is_said(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with open_model(walk(), clock="virtual") as run:
        place = run.port("walker.place")
        run.run(1.0)
    with pytest.raises(ConfigError) as refused:
        place.to_dataframe()
    assert install_command("pandas") in str(refused.value)


@pytest.mark.slow
def test_a_name_that_there_is_not_is_answered_with_the_nearest() -> None:
    with open_board("tachobot", doubles=True, clock="virtual") as robot:
        yaw = robot.port("controller.yaw.command_n")
        robot.run(3.0)
        model = robot.model
        for look, sentence in (
            (lambda: robot.port("controller.yaw.comand_n"), "controller.yaw.command_n?"),
            (lambda: model.components["controler"], "no component 'controler' (did you mean "),
            (lambda: model.components["imu"].out_ports["sampel"], "no port 'sampel' (did you mean"),
            (lambda: model.in_ports["yaw"], "expected one of yaw_reference"),
            (lambda: robot.statistics.models["imo"], "no model 'imo' (did you mean imu?)"),
        ):
            with pytest.raises(UnknownName) as unknown:
                look()
            assert sentence in str(unknown.value)
            assert isinstance(unknown.value, KeyError | FirmwareRuntimeError)
        assert len(yaw) == len(yaw.values()) > 100
        assert repr(robot) == "<OpenBoard tachobot: open, at 3 s>"
        assert repr(model.components["imu"]).endswith(" imu>")
        assert repr(robot.statistics).startswith("<Figures of ")
        assert len(repr(robot.statistics)) < 150
    assert repr(robot) == "<OpenBoard tachobot: over, at 3 s>"
