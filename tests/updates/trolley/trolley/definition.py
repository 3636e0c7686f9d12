"""What the runtime asks of a board."""

from firmware_drivers.sonar import Sonar
from firmware_drivers.tables.sonar import MaxbotixTable
from firmware_drivers.tables.treads import SabertoothTable
from firmware_drivers.treads import Treads

from firmware_runtime.board.definition import BoardDefinition
from firmware_runtime.board.faults import SerialDevice
from firmware_runtime.board.robot import Lines, Robot
from firmware_runtime.board.settings import BoardSettings, Positive, Seconds, Settings
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import seconds
from trolley.pace import Pace


class PaceTable(Settings, frozen=True):
    """The controller."""

    period_s: Seconds
    wanted_m: Positive
    per_m: Positive


class TrolleySettings(BoardSettings, frozen=True, kw_only=True):
    """The whole file."""

    treads: SabertoothTable
    eye: MaxbotixTable
    pace: PaceTable


class Trolley(Coupled):
    """eye -> pace -> treads."""

    def __init__(self, settings: TrolleySettings, lines: Lines) -> None:
        super().__init__("trolley")
        treads, eye, pace = settings.treads, settings.eye, settings.pace
        self.drive = treads.chip(lines)
        self.eye = self.add(Sonar("eye", eye.chip(lines), eye.model))
        self.pace = self.add(Pace("pace", seconds(pace.period_s), pace.wanted_m, pace.per_m))
        self.treads = self.add(Treads("treads", self.drive, treads.model, lines.interlock))
        self.couple(self.pace.started, self.eye.start)
        self.couple(self.eye.distance_out, self.pace.distance)
        self.couple(self.pace.speeds, self.treads.speeds)


def serial_devices(settings: TrolleySettings) -> tuple[SerialDevice, ...]:
    """Both chips."""
    return settings.treads.device("treads"), settings.eye.device("eye")


def build(settings: TrolleySettings, lines: Lines) -> Robot:
    """The robot on these ports; nothing is sent yet."""
    model = Trolley(settings, lines)
    return Robot(
        model=model,
        probe=(),
        stop=(model.drive.stop,),
        unseen=(model.drive.place,),
    )


BOARD = BoardDefinition(
    settings=TrolleySettings, build=build, serial_devices=serial_devices, loads=lambda _: {}
)
