"""The rig: the head's chips as doubles on their bus, tied to servos, photocells and a light."""

from collections.abc import Mapping
from statistics import fmean
from typing import TYPE_CHECKING

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.ports import OutPort
from firmware_runtime.devs.time import SECOND
from firmware_runtime.hal.budget import WireClock
from pan_tilt.settings import PanTiltSettings, ServoTable
from pan_tilt.wiring import PanTilt
from pan_tilt.world import SQUINT_RAD, Light, Probe
from sim_doubles.chips.ads1115 import Ads1115Double
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.rigs.board_rig import BoardRig
from sim_doubles.worlds.servo import ServoParameters, ServoPlant, pulse_of

if TYPE_CHECKING:
    from firmware_runtime.view.parts import Plane

ON_TARGET_RAD = 0.1
"""More than this, on average, is beside the light."""
SWEEP = 6 * SECOND
"""Ns that the head takes to sweep to and fro: then it has found its light, if it can."""
TREMBLING = 0.5
"""Share of its greatest rate that no light makes it turn at for long."""


class PanTiltRig(BoardRig):
    """The doubles, each on the bus and at the address that board.toml gives it."""

    def __init__(self, settings: PanTiltSettings, clock: WireClock) -> None:
        eyes, servos = settings.eyes, settings.servos
        self._settings = settings
        super().__init__(settings.buses, clock, settings.output_enable)
        self.pwm = Pca9685Double(clock, servos.address, true_osc_hz=servos.osc_hz)
        self.pan, self.tilt = self._servo(servos.pan), self._servo(servos.tilt)
        self.light = Light(settings.world)
        self.adc = Ads1115Double(clock, eyes.address, inputs=self._voltages)
        self.pwm.before_change = self.catch_up
        self.connect(eyes.bus, self.adc)
        self.connect(servos.bus, self.pwm, name="servos")
        self._probe = Probe(lambda: (self._error_rad(), self.pan.angle_rad(self.now())))
        self._follows_since: int | None = None
        """Since when it has had nothing to do but to look at its light."""
        self._errors_rad: list[float] = []
        self._pan_rad = self._way_rad = 0.0

    push_unit = "rad of pan"
    bears_push = 1.0
    recovered_within_s = 3.0
    """A light that it lost it finds in a sweep."""
    healed_within_s = 1.0
    """Each chip is tried ten times a second, and is up with the first answer."""
    bears_reading_of = ("eyes", "servos")
    unknowable = ("scale:eyes", "freeze-axis:eyes")
    """Another light would look the same to its photocells. One that reads the same for good is
    known by that it lacks noise: mostly in time, but not always (1 of 1,500)."""

    @property
    def also_in(self) -> tuple[str, ...]:
        """A light that swings to beyond the end of its pan."""
        return (f"world.azimuth_rad={self._settings.servos.pan.most_rad - 0.035:.4g}",)

    @property
    def shown(self) -> OutPort[float]:
        """How far beside the light the head looks."""
        return self._probe.error_rad

    @property
    def plane(self) -> "Plane":
        """Return the head from above, with what it sees."""
        from firmware_runtime.view.parts import Body, Bound, Plane, Ray, Shape  # noqa: PLC0415 -- for pages

        head = Body(
            "the head",
            [
                Shape("circle", [(0.0, 0.0)], 0.05, look="body", name="the head"),
                Shape("polygon", [(0.05, 0.0), (0.02, 0.02), (0.02, -0.02)], look="nose"),
            ],
            heading_rad=Bound("world.pan_rad"),
            rays=[Ray((0.0, 0.0), SQUINT_RAD, 0.4, name="what its photocells see")],
        )
        return Plane(
            title="The head from above", bodies=[head], across_ends=(-0.4, 0.4), up_ends=(-0.4, 0.4)
        )

    def truth(self) -> dict[str, object]:
        """Where the head truly looks, as the probe sends it."""
        self.catch_up()
        probe = self._probe
        pan_rad = self.pan.angle_rad(self.now())
        return {probe.error_rad.path: self._error_rad(), probe.pan_rad.path: pan_rad}

    def missed(self) -> str | None:
        """Return that it looks beside its light, or trembles, after a sweep's time to find it."""
        self.catch_up()
        at, before_rad = self.now(), self._pan_rad
        self._pan_rad = self.pan.angle_rad(at)
        if not any(self.outputs.values()) or not self._can_reach(at):
            self._follows_since = None
            return None
        if self._follows_since is None:
            self._follows_since, self._errors_rad, self._way_rad = at, [], 0.0
        followed = at - self._follows_since - SWEEP
        if followed <= 0:
            return None
        self._errors_rad.append(self._error_rad())
        self._way_rad += abs(self._pan_rad - before_rad)
        if followed <= SWEEP:
            return None
        if (mean_rad := fmean(self._errors_rad)) > ON_TARGET_RAD:
            return f"it looks {mean_rad:.2f} rad beside its light on average"
        rate_rad_s = self._way_rad * SECOND / followed
        if rate_rad_s > TREMBLING * self._settings.controller.most_rad_s:
            return f"it turns to and fro at {rate_rad_s:.2f} rad/s on average"
        return None

    def attach(self, robot: Coupled) -> None:
        """Add the world's probe, which looks with every reading."""
        assert isinstance(robot, PanTilt)  # noqa: S101 -- a rig belongs to its board
        robot.add(self._probe)
        robot.couple(robot.voltages, self._probe.tick)

    def push(self, amount: float) -> None:
        """Turn the head aside by force."""
        self.pan.push(amount)

    def hold(self, *, is_held: bool) -> None:
        """Keep the head from turning, both ways."""
        for servo in (self.pan, self.tilt):
            servo.hold(is_held=is_held)

    def catch_up(self) -> None:
        """Let the converter take what it still has to take, then the servos turn, up to now."""
        super().catch_up()
        for servo in (self.pan, self.tilt):
            servo.advance(self.now())

    def result(self, elapsed: int, own: Mapping[str, object]) -> dict[str, object]:  # noqa: ARG002
        """How far beside the light the head looks, and whether it is on target."""
        self.catch_up()
        error_rad = self._error_rad()
        shines = self.light.shines(self.now())
        return {**own, "error_rad": error_rad, "on_target": shines and error_rad <= ON_TARGET_RAD}

    def _servo(self, table: ServoTable) -> ServoPlant:
        given = ServoParameters(
            least_rad=table.least_rad,
            most_rad=table.most_rad,
            least_pulse_us=table.least_pulse_us,
            most_pulse_us=table.most_pulse_us,
        )
        return ServoPlant(given, pulse_of(self.pwm, table.channel))

    def _voltages(self, at: int) -> list[float]:
        return self.light.voltages(at, self.pan.angle_rad(at), self.tilt.angle_rad(at))

    def _can_reach(self, at: int) -> bool:
        """Return whether the light shines where the head can turn to."""
        azimuth, elevation = self.light.direction(at)
        pan, tilt = self._settings.servos.pan, self._settings.servos.tilt
        return (
            self.light.shines(at)
            and pan.least_rad <= azimuth <= pan.most_rad
            and tilt.least_rad <= elevation <= tilt.most_rad
        )

    def _error_rad(self) -> float:
        at = self.now()
        return self.light.error(at, self.pan.angle_rad(at), self.tilt.angle_rad(at))
