"""The robot's side: what is handed over, and that it switches off."""

from underwater.winch.double import WinchDouble
from underwater.winch.haul import Haul
from underwater.winch.motor import WinchMotor
from underwater.winch.ruler import Ruler

from firmware_runtime.board.robot import Lines, Robot
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import MILLISECOND
from sim_doubles.i2c_bus import I2cBusDouble


class Cableway(Coupled):
    """The part of a `wiring.py` that has to do with the winch."""

    def __init__(self, lines: Lines) -> None:
        super().__init__("cableway")
        self.chip = WinchMotor(lines.buses["i2c1"])
        self.power = self.in_port("power", float)
        self.ruler = self.add(Ruler("ruler", self.chip, 20 * MILLISECOND))
        self.haul = self.add(Haul("haul", self.chip, 100 * MILLISECOND, lines.interlock))
        self.couple(self.power, self.haul.power_in)


def build(lines: Lines) -> Robot:
    """The part of a `definition.py`."""
    model = Cableway(lines)
    return Robot(
        model=model,
        probe=(model.chip.identify,),
        stop=(model.chip.stop,),
        still_on=(model.chip.still_on,),
    )


def test_the_robot_sees_that_the_motor_is_on_and_switches_it_off() -> None:
    double = WinchDouble(lambda: 0, world={"place_m": 0.0})
    robot = build(Lines({"i2c1": I2cBusDouble("i2c1", lambda: 0, [double])}))
    robot.find_chips()
    assert robot.outputs_on() == []
    double.put("CONTROL", 1)
    assert robot.outputs_on() == ["Winch at 0x1e on i2c1: the motor is on"]
    assert (robot.make_safe(), double.is_on, robot.outputs_on()) == ([], False, [])
