"""TachoBot's controller: attitude, one PID a coordinate, and the allocation to four pairs.

It knows neither chips nor clocks; the same object runs in simulation and on the robot.
"""

from typing import TYPE_CHECKING

from firmware_drivers.chips.mpu9250_burst import InertialSample
from firmware_drivers.thrust_pairs import Forces

from firmware_boards.tachobot.allocation import Allocation
from firmware_boards.tachobot.attitude import Attitude, gap_of, heading_check
from firmware_boards.tachobot.pid_controller import PidController
from firmware_boards.tachobot.settings import ControllerSettings, FreeSettings
from firmware_runtime.devs.ports import OutPort
from firmware_runtime.devs.time import seconds
from firmware_runtime.models.motion import Motion
from firmware_runtime.models.pid import Pid
from firmware_runtime.models.plant import SecondOrderPlant

if TYPE_CHECKING:
    from firmware_runtime.models.smith_predictor import SmithPredictor

POSITION_PERIODS = 10
"""Control periods after which a position command that was not renewed counts as zero."""


class Controller(PidController[Pid]):
    """sample -> attitude (-> smith) -> yaw (-> delay) -> allocation -> forces; applied -> all.

    A wave stands in for yaw where the settings have one; x and y join in mode `free`. `yaw_plant`
    is what the Smith predictor takes yaw to be, if there is to be one.
    """

    def __init__(
        self,
        name: str,
        settings: ControllerSettings,
        pair_thrust_n: float,
        yaw_plant: SecondOrderPlant,
    ) -> None:
        super().__init__(name, pair_thrust_n)
        self.sample = self.in_port("sample", InertialSample)
        self.enable = self.in_port("enable", bool)
        self.yaw_reference = self.in_port("yaw_reference", float)
        self.forces = self.out_port("forces", Forces)
        is_free = isinstance(settings, FreeSettings)
        compass = seconds(settings.compass_time_constant_s)

        attitude = self.attitude = self.add(
            Attitude("attitude", compass, enabled=not is_free, gap=gap_of(settings))
        )
        yaw = self.yaw = self.add(Pid("yaw", self._gains(settings.yaw), settings.yaw.reference_rad))
        timeout = POSITION_PERIODS * seconds(settings.period_s)
        allocation = self.add(Allocation("allocation", pair_thrust_n, timeout))

        if settings.compass_time_constant_s:
            check = self.add(heading_check(settings))
            self.couple(self.sample, check.rate)
            self.couple(self.sample, check.value)
            self.couple(check.agrees_out, attitude.trusted)
        self.couple(self.sample, attitude.sample)
        self.couple(self.enable, attitude.enable)
        self.couple(self.applied, attitude.applied)
        self.couple(self.yaw_reference, yaw.reference_in)
        self.couple(self._predicted(settings, yaw_plant), yaw.measurement)
        self.couple(attitude.yaw, allocation.yaw)
        command = self._commanded(yaw, settings)
        delayed = self._delayed(command, settings.yaw.delay_s)
        contradiction = self._couple_yaw(delayed, attitude.yaw, allocation, settings.movement_check)
        self.couple(contradiction, attitude.contradiction)
        self.couple(self.unsteered, attitude.contradiction)
        self.couple(allocation.forces_out, self.forces)
        if self._smith is not None:
            self.couple(yaw.command, self._smith.command)
            self.couple(self.applied, self._smith.applied_in)
        self._pids["yaw"] = yaw
        if isinstance(settings, FreeSettings):
            self._add_position(settings, allocation)
        self._couple_applied(allocation)

    def _predicted(self, settings: ControllerSettings, plant: SecondOrderPlant) -> OutPort[Motion]:
        """The port at which the yaw leaves that is controlled: predicted, or as estimated."""
        self._smith: SmithPredictor | None = None
        if settings.yaw.smith is None:
            return self.attitude.yaw
        self._smith = smith = self.add(_smith(plant, settings.yaw.smith.delay_s))
        self.couple(self.attitude.yaw, smith.measurement)
        return smith.predicted

    def _commanded(self, yaw: Pid, settings: ControllerSettings) -> OutPort[float]:
        """The port at which the yaw command leaves: the PID's, or a wave's in open loop."""
        stated = settings.yaw.wave
        if stated is None:
            return yaw.command
        from firmware_runtime.models.square_wave import (  # noqa: PLC0415 -- few runs have one
            SquareWave,
            Wave,
        )

        period, begin = seconds(stated.period_s), seconds(stated.begin_s)
        wave = Wave(stated.amplitude_n, period, begin, stated.cycles)
        source = self.add(SquareWave("yaw_wave", Motion, wave))
        self.couple(self.attitude.yaw, source.tick)
        self.couple(self.applied, source.applied_in)
        return source.level_out

    def _add_position(self, settings: FreeSettings, allocation: Allocation) -> None:
        """PIDs for x and y, fed from outside: nothing on board measures where the robot is."""
        self.x_position = self.in_port("x_position", Motion)
        self.y_position = self.in_port("y_position", Motion)
        x = self.add(Pid("x", self._gains(settings.x), settings.x.reference_m))
        y = self.add(Pid("y", self._gains(settings.y), settings.y.reference_m))
        self._pids.update(x=x, y=y)
        self.couple(self.x_position, x.measurement)
        self.couple(self.y_position, y.measurement)
        self.couple(x.command, allocation.x_n)
        self.couple(y.command, allocation.y_n)


def _smith(plant: SecondOrderPlant, delay_s: float) -> "SmithPredictor":
    from firmware_runtime.models.smith_predictor import (  # noqa: PLC0415 -- few runs have one
        SmithPredictor,
    )

    return SmithPredictor("yaw_smith", plant, seconds(delay_s))
