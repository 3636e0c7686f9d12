"""Mistakes that are made in a copy of the project: its campaigns find them, in three lines at most.

A mistake is found where a campaign has a finding that the same sample of the same space has not
without it; the space is that of the device which the mistake is about. As it should be is: all, or
all but one.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final, NamedTuple

from firmware_runtime.board import registry
from firmware_runtime.hal.strike import KINDS, OF_NO_DEVICE
from tests.reliability.results import ROOT, Result, ends_at
from tests.vm.commands import show

PACKAGES: Final = (
    "firmware_runtime",
    "drivers/firmware_drivers",
    "boards/firmware_boards",
    "sim_doubles",
    "examples/pan_tilt/pan_tilt",
    "examples/balancing/balancing",
)
CHIPS: Final = "drivers/firmware_drivers/chips/"
MODELS: Final = "drivers/firmware_drivers/"
BOARDS: Final = "boards/firmware_boards/"
HEAD: Final = "examples/pan_tilt/pan_tilt/"
STANDS: Final = "examples/balancing/balancing/"
RUNS: Final = 300
MOST_LINES: Final = 3


class Mistake(NamedTuple):
    """Lines of a file that are others, the board that shows it, and the device that is struck."""

    board: str
    device: str
    """Or the kind, of one that strikes no device. Empty: its missions go wrong by themselves, and
    nothing is struck."""
    file: str
    old: str
    new: str


MISTAKES: Final[Mapping[str, Mistake]] = {
    "a stale sample is passed on where there is none": Mistake(
        "tachobot",
        "imu",
        f"{MODELS}imu.py",
        "            sample = self.chip.read_sample(self.bias)\n",
        "            try:\n"
        "                sample = self.kept = self.chip.read_sample(self.bias)\n"
        "            except HalError:\n"
        '                if (sample := getattr(self, "kept", None)) is None:\n'
        "                    raise\n",
    ),
    "a compass that stands still is left out, and nothing says so": Mistake(
        "detective",
        "body_compass",
        f"{MODELS}compass.py",
        "        except HalError as error:\n            self.note(error)\n        else:\n",
        "        except HalError as error:\n"
        '            if type(error).__name__ != "Stuck":\n'
        "                self.note(error)\n"
        "        else:\n",
    ),
    "a magnetometer that hangs is not said": Mistake(
        "tachobot",
        "imu",
        f"{MODELS}imu.py",
        "        self.faults.append(fault)\n        return True\n",
        "        return False\n",
    ),
    "the acceleration of a body that leans has the other sign": Mistake(
        "balancing",
        "push",
        f"{STANDS}rolling.py",
        "along * cosine + up * sine",
        "along * cosine - up * sine",
    ),
    "the gyro is not compared with the compass": Mistake(
        "tachobot",
        "imu",
        f"{BOARDS}tachobot/controller.py",
        "        if settings.compass_time_constant_s:\n            check",
        "        if False:\n            check",
    ),
    "a failed write of thrust is no fault": Mistake(
        "tachobot",
        "thrust_pairs",
        f"{MODELS}thrust_pairs.py",
        "        except HalError as error:\n            self.fail(error)\n",
        "        except HalError:\n            pass\n",
    ),
    "a PCA9685 that was reset is not brought up again": Mistake(
        "tachobot",
        "thrust_pairs",
        f"{CHIPS}pca9685.py",
        "        if found != expected:\n",
        "        if False:\n",
    ),
    "the sign of the compass is turned": Mistake(
        "tachobot",
        "",
        f"{BOARDS}tachobot/attitude.py",
        "    return atan2(-field[1], field[0])",
        "    return atan2(field[1], field[0])",
    ),
    "two axes of the gyro are swapped": Mistake(
        "tachobot",
        "",
        f"{CHIPS}mpu9250_burst.py",
        "rate[j] * qy - bias_y, rate[k] * qz - bias_z)",
        "rate[k] * qz - bias_z, rate[j] * qy - bias_y)",
    ),
    "an IMU that was reset is not brought up again": Mistake(
        "tachobot",
        "imu",
        f"{MODELS}imu.py",
        "self.consecutive_faults % FAULTS_BEFORE_BRING_UP == 0\n",
        "False\n",
    ),
    "a time before another try is a hundred times as long": Mistake(
        "tachobot",
        "imu",
        f"{MODELS}hardware.py",
        "RETRY_AFTER = 100_000_000\n",
        "RETRY_AFTER = 10_000_000_000\n",
    ),
    "two pairs of propellers are exchanged": Mistake(
        "tachobot",
        "",
        f"{BOARDS}tachobot/allocation.py",
        "b * yaw_n + 0.0, c * yaw_n + 0.0, d * yaw_n + 0.0), 1.0",
        "b * yaw_n + 0.0, d * yaw_n + 0.0, c * yaw_n + 0.0), 1.0",
    ),
    "the bias of the gyro is added": Mistake(
        "tachobot",
        "",
        f"{CHIPS}mpu9250_burst.py",
        "rate[k] * qz - bias_z)",
        "rate[k] * qz + bias_z)",
    ),
    "a good reading does not reset the count of failed ones": Mistake(
        "tachobot",
        "imu",
        f"{MODELS}imu.py",
        "                self.consecutive_faults = 0\n",
        "                self._has_worked = True\n",
    ),
    "thrust goes on twice as long where forces do not come": Mistake(
        "tachobot",
        "imu",
        f"{BOARDS}tachobot/wiring.py",
        "        timeout=seconds(thrust.timeout_s),\n",
        "        timeout=2 * seconds(thrust.timeout_s),\n",
    ),
    "the control runs at half its rate": Mistake(
        "tachobot",
        "",
        f"{BOARDS}tachobot/wiring.py",
        'Imu("imu", self.imu_chip, control_period(settings), ',
        'Imu("imu", self.imu_chip, 2 * control_period(settings), ',
    ),
    "a step of a bring-up that fails is not reported": Mistake(
        "tachobot",
        "imu",
        f"{MODELS}hardware.py",
        '            self.note(error)\n            self.activate("bring_up_failed")\n',
        '            self.activate("bring_up_failed")\n',
    ),
    "an MD25 that was reset is not noticed": Mistake(
        "detective",
        "treads",
        f"{CHIPS}md25.py",
        "        self._is_up = (acceleration, mode) == (self._acceleration, UNSIGNED)\n",
        "        self._is_up = True\n",
    ),
    "the check of a wheel goes on from before it was stopped": Mistake(
        "detective",
        "treads",
        f"{MODELS}treads.py",
        '        """Stop both."""\n'
        "        for wheel in self._wheels:\n"
        "            wheel.begin_again()\n",
        '        """Stop both."""\n',
    ),
    "both treads are swapped": Mistake(
        "detective",
        "",
        f"{CHIPS}md25.py",
        "STOP + round(left * FULL), STOP + round(right * FULL))",
        "STOP + round(right * FULL), STOP + round(left * FULL))",
    ),
    "a compass that fails gives its last heading": Mistake(
        "detective",
        "body_compass",
        f"{MODELS}compass.py",
        "            bearing = self.chip.read_bearing()\n",
        "            try:\n"
        "                bearing = self.kept = self.chip.read_bearing()\n"
        "            except HalError:\n"
        "                bearing = self.kept\n",
    ),
    "a compass that fails says so, and sends its last heading all the same": Mistake(
        "detective",
        "body_compass",
        f"{MODELS}compass.py",
        "            self.heading_out.send(self.heading)\n",
        "            self.heading_out.send(self.heading)\n"
        "            self.kept = self.heading\n"
        '        elif self.faults and hasattr(self, "kept"):\n'
        "            self.heading_out.send(self.kept)\n",
    ),
    "the check of wheels against their command is removed": Mistake(
        "detective",
        "treads",
        f"{MODELS}treads.py",
        "        if report is None or not self._wheels:\n",
        "        if True:\n",
    ),
    "a tread that turns unasked does not end the mission": Mistake(
        "detective",
        "treads",
        f"{BOARDS}detective/mission.py",
        " or fault.kind == Runaway.__name__",
        "",
    ),
    "a sonar that has failed pings a third as often from then on": Mistake(
        "detective",
        "body_sonar",
        f"{MODELS}sonar.py",
        "interval - self._since_ping))\n\n    def _fail(self, error: HalError) -> None:\n",
        "interval * getattr(self, 'times', 1) - self._since_ping))\n\n"
        "    def _fail(self, error: HalError) -> None:\n"
        "        self.times = 3\n",
    ),
    "what enters the radar's beam is found one ping too late": Mistake(
        "detective",
        "",
        f"{MODELS}sonar.py",
        "self.is_detection = self._near_pings >= due",
        "self.is_detection = self._near_pings > due",
    ),
    "it turns the longer way to its target": Mistake(
        "detective",
        "",
        f"{BOARDS}detective/angles.py",
        "return 0 < grown < 180 or (grown == 180 and heading > target)",
        "return 180 < grown or (grown == 180 and heading > target)",
    ),
    "two photocells are exchanged": Mistake(
        "pan_tilt",
        "",
        f"{HEAD}wiring.py",
        '("AIN0", "AIN1", "AIN2", "AIN3")',
        '("AIN0", "AIN2", "AIN1", "AIN3")',
    ),
    "a head that comes no nearer to its light is not told that it follows": Mistake(
        "pan_tilt",
        "servos",
        f"{HEAD}controller.py",
        "            self.couple(self.mode.follow_out, check.follow)\n",
        "            pass\n",
    ),
    "a place is fed back with the other sign": Mistake(
        "balancing",
        "",
        f"{STANDS}lean.py",
        "self.speed + self.per_place_rad_s * beyond_s",
        "self.speed - self.per_place_rad_s * beyond_s",
    ),
    "what the treads' driver said is sent again with each answer": Mistake(
        "detective",
        "treads",
        f"{MODELS}treads.py",
        "        self.report = None\n        super().proceed()",
        "        super().proceed()",
    ),
    "a ping that is refused is no fault": Mistake(
        "detective",
        "body_sonar",
        f"{MODELS}sonar.py",
        "            self.chip.start_ranging()\n        except HalError as error:\n"
        "            self._fail(error)\n",
        "            self.chip.start_ranging()\n        except HalError:\n"
        "            self._rest()\n",
    ),
    "a sonar that does not answer is read for ever": Mistake(
        "detective",
        "body_sonar",
        f"{MODELS}sonar.py",
        "        self._readings += 1\n        try:",
        "        try:",
    ),
    "a speed that is contradicted does not stop the motors": Mistake(
        "balancing",
        "imu",
        f"{STANDS}controller.py",
        "        self.couple(self.rolling_check.agrees_out, self.ready.trusted)\n",
        "",
    ),
    "angles run on while nothing is applied": Mistake(
        "pan_tilt",
        "disarm",
        f"{HEAD}head.py",
        "        if self.applied is not Applied.NOTHING:\n            for axis",
        "        if True:\n            for axis",
    ),
    "a wrong byte of what the treads' driver counts is taken for a turn": Mistake(
        "detective",
        "treads",
        f"{MODELS}treads.py",
        "        if any(wheel.is_unasked(count, elapsed) for wheel, count in wheels):\n",
        "        if False:\n",
    ),
    "a radar's motor that fails does not end the mission": Mistake(
        "detective",
        "radar_motor",
        f"{BOARDS}detective/wiring.py",
        "for device in (self.radar_motor, self.treads, *sonars, *compasses):",
        "for device in (self.treads, *sonars, *compasses):",
    ),
    "commands that are taken do not end faults in a row": Mistake(
        "detective",
        "treads",
        f"{MODELS}motors.py",
        "            self._is_doubtful = False\n            self._faults_in_a_row = 0\n",
        "            self._is_doubtful = False\n",
    ),
    "what was driven last counts for as long as the robot lay": Mistake(
        "balancing",
        "disarm",
        f"{STANDS}lean.py",
        "            self._since_drive = 0  # it lay meanwhile\n",
        "",
    ),
    "a tread that does not turn is the first fault in a row each time": Mistake(
        "detective",
        "treads",
        f"{MODELS}motors.py",
        "        if self._has_taken_command and self.has_acted():\n",
        "        if self._has_taken_command:\n",
    ),
    "a yaw that its compass contradicts is steered by": Mistake(
        "tachobot",
        "imu",
        f"{BOARDS}tachobot/attitude.py",
        "        is_sound = bool(self.sample) and self.is_trusted\n",
        "        is_sound = bool(self.sample)\n",
    ),
    "each axis is told what becomes of the other one": Mistake(
        "pan_tilt",
        "",
        f"{HEAD}controller.py",
        "        self.couple(self.head.pan_effect, self.pan.applied_in)\n"
        "        self.couple(self.head.tilt_effect, self.tilt.applied_in)\n",
        "        self.couple(self.head.pan_effect, self.tilt.applied_in)\n"
        "        self.couple(self.head.tilt_effect, self.pan.applied_in)\n",
    ),
    "a robot that does not move is driven on": Mistake(
        "tachobot",
        "hold",
        f"{BOARDS}tachobot/allocation.py",
        "            self._may_drive = self.moves[-1]\n",
        "            pass\n",
    ),
    "a sensor that stands still is believed after each bring-up": Mistake(
        "tachobot",
        "imu",
        f"{CHIPS}liveness.py",
        "        self._last = None\n\n    def check(",
        "        self._last = None\n        self._forget_runs()\n\n    def check(",
    ),
    "an echo that stops the head is looked at again only while that stands": Mistake(
        "detective",
        "radar_sonar",
        f"{BOARDS}detective/second_look.py",
        "if self.detected and self._turns else None",
        "if self.detected and not self._turns else None",
    ),
    "a stop is written in a mode that was read wrongly": Mistake(
        "detective",
        "treads",
        f"{CHIPS}md25.py",
        "        self._write(MODE, mode)\n        self._write(SPEED1",
        "        self._write(SPEED1",
    ),
    "settings that are taken up again give a gain the value of another": Mistake(
        "balancing",
        "reload",
        f"{STANDS}controller.py",
        "self.lean.per_place_rad_s = settings.lean_per_place_rad_s",
        "self.lean.per_place_rad_s = settings.lean_per_speed_rad",
    ),
    "a ping that is taken ends the failures of a sonar in a row": Mistake(
        "detective",
        "body_sonar",
        f"{MODELS}sonar.py",
        "            self._least_interval = self.chip.line.elapsed()",
        "            self.consecutive_faults = 0\n"
        "            self._least_interval = self.chip.line.elapsed()",
    ),
    "an IMU that is brought up again forgets its gyro's bias": Mistake(
        "tachobot",
        "imu",
        f"{MODELS}imu.py",
        "        self._is_bring_up_due = False\n        self._bring_up.restart()\n",
        "        self._is_bring_up_due = False\n"
        "        self.bias = NO_BIAS\n"
        "        self._bring_up.restart()\n",
    ),
    "what is left of a state's duration is kept as the state is left": Mistake(
        "detective",
        "disarm",
        "firmware_runtime/models/state_diagram.py",
        "        self.hold_in(state, self.durations[state])\n        self._left = NEVER\n",
        "        self.hold_in(state, self.durations[state])\n",
    ),
    "a compass that does not answer once is given up": Mistake(
        "tachobot",
        "imu",
        f"{CHIPS}mpu9250.py",
        "        return not self._read(I2C_MST_STATUS, 1)[0] & SLV0_NACK\n",
        "        self.has_magnetometer = not self._read(I2C_MST_STATUS, 1)[0] & SLV0_NACK\n"
        "        self._start_decoding()\n"
        "        return self.has_magnetometer\n",
    ),
    "motors are braked after a fall": Mistake(
        "balancing",
        "imu",
        f"{STANDS}wiring.py",
        "seconds(wheels.timeout_s))",
        "seconds(wheels.timeout_s), brakes=True)",
    ),
    "a run tries twice only to switch off its outputs": Mistake(
        "balancing",
        "wheels",
        "firmware_runtime/executive/outcome.py",
        "1 + self._keep_trying // OFF_AGAIN_EVERY",
        "1 + self._keep_trying // SECOND",
    ),
}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this part."""
    parser.add_argument("--minutes", type=float, help="begin no other after so long")
    parser.add_argument("--runs", type=int, default=RUNS, help="of each campaign")
    parser.add_argument("--only", nargs="+", metavar="WORD", help="mistakes with one of the words")


def execute(arguments: argparse.Namespace) -> Result:
    """Try them, one after the other."""
    words = arguments.only or [""]
    chosen = [name for name in MISTAKES if any(word in name for word in words)]
    until = ends_at(arguments.minutes)
    rows: list[dict[str, object]] = []
    for name in chosen:
        if time.monotonic() >= until:
            break
        mistake = MISTAKES[name]
        finding = found_in(mistake, arguments.runs)
        rows.append(
            {
                "mistake": name,
                "board": mistake.board,
                "device": mistake.device,
                "finding": finding,
            }
        )
        show(f"{'found' if finding else 'NOT FOUND'}: {name}")
        for line in finding or ():
            show(f"    {line}")
    found = sum(row["finding"] is not None for row in rows)
    return Result(
        name="planted",
        summary=f"{found} of {len(rows)} mistakes found, {arguments.runs} runs each",
        is_sound=bool(rows) and found >= len(rows) - 1,
        figures={"rows": rows},
    )


def found_in(mistake: Mistake, runs: int) -> Sequence[str] | None:
    """Return the first finding that is there for this mistake, in lines; None if there is none."""
    runs = runs if mistake.device else 1
    before = {_key(each) for each in _findings_without_any(mistake.board, mistake.device, runs)}
    for each in _findings_of(mistake, runs):
        if _key(each) not in before:
            words = [f"{each['oracle']} of {each['model']}: {each['what']}", *each["faults"]]
            return words if len(words) <= MOST_LINES else None
    return None


@cache
def _findings_without_any(board: str, device: str, runs: int) -> Sequence[Mapping[str, Any]]:
    return _campaign(ROOT, board, device, runs)


def _findings_of(mistake: Mistake, runs: int) -> Sequence[Mapping[str, Any]]:
    with TemporaryDirectory() as folder:
        copy = Path(folder)
        for each in PACKAGES:
            shutil.copytree(ROOT / each, copy / each, ignore=shutil.ignore_patterns("__pycache__"))
        file = copy / mistake.file
        text = file.read_text(encoding="utf-8")
        assert text.count(mistake.old) == 1, f"{mistake.file}: {mistake.old!r} is not there once"
        file.write_text(text.replace(mistake.old, mistake.new), encoding="utf-8")
        return _campaign(copy, mistake.board, mistake.device, runs)


def _campaign(root: Path, board: str, device: str, runs: int) -> Sequence[Mapping[str, Any]]:
    path = os.pathsep.join(str((root / each).parent) for each in PACKAGES)
    words = ["campaign", board, "--runs", str(runs), "--json"]
    for fault in _faults_of_others(board, device) if device else ():
        words += ["--without", fault]
    ended = subprocess.run(
        [sys.executable, "-m", "firmware_runtime.cli", *words],
        cwd=root,
        env=os.environ | {"PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.stdout or root != ROOT, ended.stderr
    if not ended.stdout:  # it fails without any fault: found at once
        what = ended.stderr.strip().splitlines()[-1]
        return [{"oracle": "start", "model": board, "kind": "", "what": what, "faults": []}]
    findings: Sequence[Mapping[str, Any]] = json.loads(ended.stdout)["findings"]
    return findings


def _faults_of_others(board: str, device: str) -> Iterator[str]:
    """Yield what `--without` takes, so that one device, or one kind, alone is struck."""
    loaded = registry.load(board)
    names = [
        *(each.key for each in loaded.devices),
        *(each.key for each in loaded.serial_devices),
        *loaded.settings.buses,
    ]
    for kind in KINDS.values():
        if kind.of not in OF_NO_DEVICE:
            yield from (f"{kind.name}:{name}" for name in names if name != device)
        elif kind.name != device:
            yield kind.name


def _key(finding: Mapping[str, Any]) -> tuple[object, ...]:
    """Return what findings are the same by: another oracle may be first to find one."""
    return finding["model"], finding["kind"]
