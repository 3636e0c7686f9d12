"""The detective robot's rig: the chips that board.toml chooses, and the arena that ties them."""

import math
from collections.abc import Mapping

import msgspec
from firmware_boards.detective.mission import Mission
from firmware_boards.detective.settings import DetectiveSettings
from firmware_boards.detective.wiring import DetectiveRobot
from firmware_drivers.tables.sonar import MaxbotixTable

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.ports import OutPort
from firmware_runtime.devs.time import NEVER, SECOND, seconds
from firmware_runtime.hal.budget import WireClock
from firmware_runtime.models.state_diagram import StateDiagram
from firmware_runtime.view.parts import Page, Plane
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.rigs.board_rig import BoardRig
from sim_doubles.rigs.devices import add_compass, add_sonar, add_treads
from sim_doubles.worlds.arena import Arena, ArenaParameters, bridge_drive
from sim_doubles.worlds.arena_judge import ArenaJudge
from sim_doubles.worlds.arena_log import ArenaLog
from sim_doubles.worlds.arena_page import arena_page, arena_plane
from sim_doubles.worlds.arena_probe import ArenaProbe

NEAR_M = (0.05, 0.5)
"""A robot that stopped nearer or farther than this before the target has not found it."""

MOST_OF_STATED = 1.5
"""So many times as fast as stated a tread is told something else."""
STEP = 1 / 127
"""A step of the speed of either chip."""


class DetectiveRig(BoardRig):
    """The doubles, each on the line and at the address that board.toml gives it."""

    def __init__(self, settings: DetectiveSettings, clock: WireClock) -> None:
        super().__init__(settings.buses, clock, settings.output_enable)
        self._settings = settings
        radar = settings.radar_motor
        self.radar = Pca9685Double(self.now, radar.address, true_osc_hz=radar.osc_hz)
        self.connect(radar.bus, self.radar, name="radar_motor")
        self.motors = add_treads(settings.treads, self)
        self.arena = Arena(
            ArenaParameters(**msgspec.structs.asdict(settings.world)),
            wheel_angles=self._wheel_angles,
            wheels_change_at=self.motors.next_change_at,
            head_drive=self._head_drive,
        )
        self.radar.before_change = self.motors.before_change = self.catch_up
        self.log = ArenaLog(self.arena)
        self._judge = ArenaJudge(self.arena, self.log, settings.radar_sonar.threshold_m)
        self._is_pushed = False
        self._mission: Mission | None = None
        add_sonar(settings.radar_sonar, self, self.log.radar_echoes)
        add_sonar(settings.body_sonar, self, self.log.body_echoes)
        world = settings.world
        add_compass(
            settings.radar_compass,
            self,
            self.arena.radar_bearing_deg,
            _instant(world.radar_compass_stuck_s),
        )
        add_compass(
            settings.body_compass,
            self,
            self.arena.body_bearing_deg,
            _instant(world.body_compass_stuck_s),
        )
        self._probe = ArenaProbe(self.arena, self.now, self.catch_up)

    push_unit = "rad anticlockwise"
    said_within_s = 0.5
    """What its treads have turned is read so often (`treads.refresh_s`)."""
    healed_within_s = 1.0
    """Each chip is tried ten times a second, and no mission ends of one that failed once."""
    bears_reading_of = ("radar_motor", "treads", "body_sonar", "body_compass", "radar_compass")
    """Not the radar's sonar: an echo that stops the head, and that no other hears, ends it."""

    @property
    def also_in(self) -> tuple[str, ...]:
        """Its target on the other side, or its head at the other end, in an empty arena."""
        world = self._settings.world
        if any((world.obstacles, world.walls, world.low_obstacles, world.low_walls)):
            return ()
        x, y = world.target
        return (
            f"world.target={[2 * world.start[0] - x, y]}",
            f"world.head_start_deg={-world.head_start_deg}",
        )

    @property
    def borne(self) -> Mapping[str, float]:
        """Rad and m, where it drives straight on: it turns to what its radar sees after that."""
        probe = self._probe
        places = (probe.x_m, probe.y_m, probe.distance_m)
        return {probe.heading_rad.path: 0.35, **{place.path: 0.2 for place in places}}

    @property
    def off_within_s(self) -> Mapping[str, float]:
        """Its mission ends of so many faults in a row, a tenth of a second apart at the most.

        A sonar on a serial line is heard less often.
        """
        settings = self._settings
        sonars = {"radar_sonar": settings.radar_sonar, "body_sonar": settings.body_sonar}
        on_buses = (name for name, of in sonars.items() if not isinstance(of, MaxbotixTable))
        needed = (*on_buses, "radar_compass", "body_compass", "radar_motor")
        return dict.fromkeys(needed, 0.1 * settings.mission.faults + 0.2)

    @property
    def ends_within_s(self) -> Mapping[str, float]:
        """Treads that do not turn as told say so once a second, and so many times."""
        return {"treads": self._settings.mission.faults + 2.0}

    @property
    def unknowable(self) -> tuple[str, ...]:
        """Faults of the radar's sonar that may be no target: nothing else reaches as far.

        It stays at no echo; one that stays at an echo is found by its driver. Or it sends the
        greatest number that it has, where that stands for none.
        """
        kinds = ["freeze", "freeze-axis"]
        if isinstance(self._settings.radar_sonar, MaxbotixTable):
            kinds.append("full-scale")
        return tuple(f"{kind}:radar_sonar" for kind in kinds)

    @property
    def shown(self) -> OutPort[float]:
        """Return the distance to the target."""
        return self._probe.distance_m

    def truth(self) -> dict[str, object]:
        """The true pose and distance, as the probe sends them."""
        self.catch_up()
        at, probe = self.now(), self._probe
        pose = self.arena.pose(at)
        return {
            probe.x_m.path: pose.x_m,
            probe.y_m.path: pose.y_m,
            probe.heading_rad.path: pose.heading_rad,
            probe.distance_m.path: self.arena.distance_to_target(at),
        }

    def judge(self) -> str | None:
        """Return what no fault excuses: that it has run into something, or lies of its target."""
        self.catch_up()
        at = self.now()
        if self.arena.collided and not self._is_pushed:
            return "it has run into something"
        away_m = self.arena.distance_to_target(at)
        if self._says_found and not NEAR_M[0] < away_m < NEAR_M[1]:
            return f"it says that it has found its target, and stands {away_m:.2f} m away"
        return None

    def lost(self) -> str | None:
        """Return that its mission has failed, where its run goes on all the same."""
        ending = None if self._mission is None else self._mission.ending
        waits = self._settings.mission.on_failure == "wait"
        is_lost = waits and ending is not None and ending.failed
        return "its mission has failed" if is_lost else None

    def missed(self) -> str | None:
        """Return what goes wrong in a mission without faults."""
        self.catch_up()
        at = self.now()
        share, stated = max(map(abs, self.motors.shares(at))), self._settings.treads.speed
        if share > MOST_OF_STATED * stated + STEP:
            return f"its treads turn at {share:.2f} of full speed, and {stated:g} is stated"
        return self._judge.missed(at)

    @property
    def _says_found(self) -> bool:
        ending = None if self._mission is None else self._mission.ending
        return ending is not None and not ending.failed

    @property
    def plane(self) -> Plane:
        """Return the arena with the robot in it, from above."""
        return arena_plane(self.arena.parameters)

    def attach(self, robot: Coupled) -> None:
        """Add the arena's probe; it looks whenever the body's compass is read."""
        assert isinstance(robot, DetectiveRobot)  # noqa: S101 -- a rig belongs to its board
        robot.add(self._probe)
        self._mission = robot.mission
        robot.couple(robot.body_compass.heading_out, self._probe.tick)
        self._watch(robot.model.components["MovingSystem"], "movementController")
        self._watch(robot.model.components["RadarSystem"], "radarController")

    def result(self, elapsed: int, own: Mapping[str, object]) -> dict[str, object]:
        """Return the mission's end: by the robot's word, and by the true state of the arena."""
        at = self.now()
        stopped_m = self.arena.distance_to_target(at)
        says_so = own.get("found") is True
        heading_deg = math.degrees(self.arena.pose(at).heading_rad)
        return {
            "found": says_so and NEAR_M[0] < stopped_m < NEAR_M[1] and not self.arena.collided,
            "stopped_m": stopped_m,
            "turned_deg": heading_deg - (90.0 - self._settings.world.start_bearing_deg),
            "time_s": elapsed / SECOND,
        }

    @property
    def outputs(self) -> dict[str, int]:
        """Return how many outputs of the radar's chip are on, and how many treads are driven."""
        return {**super().outputs, "treads": sum(self.motors.driven(self.now()))}

    def levels(self, at: int) -> dict[str, float]:
        """The duty of each output of the radar's chip, and how fast the motors turn, in rad/s."""
        left, right = self.motors.speeds_rad_s(at)
        return {**super().levels(at), "treads.left": left, "treads.right": right}

    def next_change_at(self, at: int) -> int:
        """The next step of a tread's ramp, or the instant at which silence stops the treads."""
        return self.motors.next_change_at(at)

    def draw(self, until: int, own: Mapping[str, object], reason: str) -> Page:
        """The run up to an instant and its outcome."""
        title = "Detective robot in its arena"
        outcome = self._outcome(self.result(until, own), reason)
        return arena_page(self.log, until, title, outcome, "movementController")

    def _outcome(self, result: Mapping[str, object], reason: str) -> str:
        found = "found the target" if result["found"] else "did not find the target"
        hit = ", hit something on its way" if self.arena.collided else ""
        stands = f"stands {result['stopped_m']:.2f} m from it after {result['time_s']:.1f} s"
        return f"It {found}{hit}, and {stands}: {reason}."

    def _watch(self, system: Component, name: str) -> None:
        """Let a controller's states go into the log."""
        controller = system.components[name] if isinstance(system, Coupled) else None
        if isinstance(controller, StateDiagram):
            controller.watch = lambda state: self.log.enter(self.now(), name, state)

    # The world ----------------------------------------------------------------------------------

    @property
    def world(self) -> Arena:
        """The arena with the robot in it."""
        return self.arena

    def _wheel_angles(self, at: int) -> tuple[float, float]:
        """Return the angles of the right and the left wheel; motor 1 drives the left."""
        left, right = self.motors.turned_rad(at)
        return right, left

    def _head_drive(self) -> float:
        table, duty = self._settings.radar_motor, self.radar.duty
        return bridge_drive(duty(table.pwm_channel), duty(table.in1), duty(table.in2))

    @property
    def is_driven(self) -> bool:
        """Whether treads turn or the head's motor drives; what holds the head is a brake."""
        return any(self.motors.driven(self.now())) or self._head_drive() != 0.0

    def push(self, amount: float) -> None:
        """Turn it where it stands: something shoved it."""
        self._is_pushed = True
        self.arena.push(self.now(), amount)

    def hold(self, *, is_held: bool) -> None:
        """Keep it where it stands: something has caught it, and its treads slip."""
        self.arena.hold(self.now(), is_held=is_held)

    def catch_up(self) -> None:
        """Let the sensors take what they still have to take, then the arena go on, up to now."""
        super().catch_up()
        self.arena.advance(self.now())


def _instant(stated_s: float | None) -> int:
    """Return the instant at which a compass hangs, ns; one without an instant never does."""
    return NEVER if stated_s is None or stated_s == math.inf else seconds(stated_s)
