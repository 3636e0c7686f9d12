"""kill -9 of each part of a robot at random instants, and another started each time.

    firmware-runtime bench kills [--rounds N] [--what PART,...] [--one-machine] [--drives S]
        [--seed N] [--json] [--save]

TachoBot on served doubles, which outlive what is killed and log what their outputs did, with its
guard. One is two processes with a link over UDP between them; of the other the ROS 2 node is
killed, which had armed it on a lease.

Beside it, from spans of one run in turns: the lateness of its loop with kills, left alone, and with
`strangers`: processes like those that are killed, started and killed as often, which have nothing
to do with the robot. What kills cost beyond strangers is the link's, or the node's; what strangers
cost beyond a robot left alone is the machine's, on which processes start and end.

A controller is on another machine than its robot: where there are two processors or more, one half
has the robot's end (run, carrier, guard), the other half everything else of the linked robot. A
node is on its robot's machine, and both have all processors.
"""

import argparse
import json
import os
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from threading import Event
from typing import Any, Final

from benchmarks.kills.kills import GOAL_MS
from benchmarks.kills.linked_robot import LinkedRobot
from benchmarks.kills.machines import Machines, machines, one_machine
from benchmarks.kills.noded_robot import NodedRobot
from benchmarks.kills.rounds import TURNS, WITHIN_S, Rounds
from benchmarks.kills.standstill import Standstills
from benchmarks.shared.conditions import conditions, conditions_text
from benchmarks.shared.results import add_common_options, save
from benchmarks.shared.side_by_side import positive
from firmware_runtime.cli.arguments import positive as positive_number
from firmware_runtime.links.ros2.interpreter import find_environment
from firmware_runtime.status import Status

SUMMARY = (
    "kill -9 of a robot's ROS 2 node, controller, carriers and run: off in time, and for good?"
)
PARTS: Final = ("node", "controller", "carrier", "robot")
_COLUMNS: Final = ("kills", "within", "median_ms", "worst_ms", "stayed_off")
_NODES_ALONE: Final = 5
"""Kills of the node in a span of a comparison; the others come beside those of another robot."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what this bench takes."""
    add_common_options(parser)
    parser.add_argument("--rounds", type=positive, default=100, help="kills of each part")
    parser.add_argument(
        "--what",
        type=_parts,
        default=PARTS,
        metavar="PART,...",
        help=f"what to kill, of {', '.join(PARTS)}; carrier: half of the rounds the "
        "controller's, then the robot's",
    )
    parser.add_argument(
        "--one-machine",
        action="store_true",
        help="let controller and robot share all processors; else each has half of them",
    )
    parser.add_argument(
        "--drives",
        type=positive_number,
        default=WITHIN_S,
        metavar="S",
        help="the robot drives for up to so long before a kill; with little, the steps that "
        "switch off and arm again are more than 1 of 100, and the p99 is theirs; default "
        f"{WITHIN_S:g}",
    )
    parser.add_argument("--seed", type=int, default=1, help="of the instants of the kills")


def execute(arguments: argparse.Namespace) -> int:
    """Kill, start again, print; the verdict comes last. Raises ConfigError without rclpy."""
    if "node" in arguments.what:
        find_environment(None)
    rounds, stopping = Rounds(arguments.seed, arguments.drives), Event()
    placed = (one_machine if arguments.one_machine else machines)(os.sched_getaffinity(0))
    with ExitStack() as stack:
        try:
            _kill(stack, rounds, arguments, placed, stopping)
        finally:
            stopping.set()
    report = {
        "conditions": conditions(),
        "processors": placed.report(),
        "goal_ms": GOAL_MS,
        "kills": {what: kills.report() for what, kills in sorted(rounds.kills.items())},
        "lateness": rounds.lateness,
    }
    print(json.dumps(report) if arguments.json else _text(report))
    save(arguments.save, "kills", report)
    return Status.OK


def _kill(
    stack: ExitStack,
    rounds: Rounds,
    arguments: argparse.Namespace,
    placed: Machines,
    stopping: Event,
) -> None:
    """First what is compared, each alone; then all else, two robots beside each other."""
    parts, count = arguments.what, arguments.rounds
    later: list[Callable[[], None]] = []
    if "node" in parts:
        noded = NodedRobot(stack, _folder(stack), stopping)
        alone = min(count, _NODES_ALONE * TURNS)
        _compare_node(rounds, noded, alone)
        later.append(partial(rounds.of, "node", noded, noded.kill_node, count - alone))
    if set(parts) != {"node"}:
        with placed.on_others():
            linked = LinkedRobot(stack, _folder(stack), stopping, placed)
            if "controller" in parts:
                _compare_controller(rounds, linked, count)
        later.append(partial(_kill_linked, rounds, linked, parts, count))
    rounds.standstills = Standstills(stack, _folder(stack))
    with ThreadPoolExecutor(len(later)) as pool:
        try:
            for done in as_completed(pool.submit(each) for each in later):
                done.result()
        finally:
            stopping.set()


def _compare_node(rounds: Rounds, robot: NodedRobot, count: int) -> None:
    """Spans of a run without a node, with one, and with one that is killed."""
    kill = robot.kill_node
    spans = {
        "a node": (robot.wait_until_driving, robot.leave_alone),
        "no node": (robot.drive_without_node, robot.leave_alone),
    }
    rounds.compare("a node", robot, spans)
    rounds.compare(
        "kills of the node",
        robot,
        {
            "kills": (
                robot.wait_until_driving,
                partial(rounds.share_of, "node", robot, kill, count),
            ),
            "left alone": (robot.wait_until_driving, robot.leave_alone),
            "strangers": (robot.start_strangers,),
        },
    )


def _compare_controller(rounds: Rounds, robot: LinkedRobot, count: int) -> None:
    """Spans of a run left alone, with strangers beside it, and with its controller killed."""
    kill = robot.kill_controller
    rounds.compare(
        "kills of the controller",
        robot,
        {
            "kills": (
                robot.wait_until_driving,
                partial(rounds.share_of, "controller", robot, kill, count),
            ),
            "left alone": (robot.wait_until_driving, robot.leave_alone),
            "strangers": (robot.start_strangers,),
        },
    )


def _kill_linked(rounds: Rounds, robot: LinkedRobot, parts: tuple[str, ...], count: int) -> None:
    """Carriers and runs."""
    half = -(-count // 2)
    with robot.machines.on_others():
        if "carrier" in parts:
            rounds.of("carrier of the controller", robot, robot.kill_controller_s_carrier, half)
            rounds.of("carrier of the robot", robot, robot.kill_robot_s_carrier, count - half)
        if "robot" in parts:
            rounds.of("robot", robot, robot.kill_robot, count)


def _folder(stack: ExitStack) -> Path:
    return Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="kills-")))


def _parts(text: str) -> tuple[str, ...]:
    wanted = tuple(text.split(","))
    if unknown := [each for each in wanted if each not in PARTS]:
        expected = f"expected some of {', '.join(PARTS)}"
        raise argparse.ArgumentTypeError(f"{', '.join(unknown)}: {expected}")
    return wanted


def _text(report: dict[str, Any]) -> str:
    kills = report["kills"]
    where = (f"{name} on {on}" for name, on in report["processors"].items())
    lines = [conditions_text(report["conditions"]), f"processors: {', '.join(where)}", ""]
    lines.append(f"{'killed':28}" + "".join(f"{name:>12}" for name in _COLUMNS))
    for what, each in kills.items():
        lines.append(f"{what:28}" + "".join(f"{_cell(each[name]):>12}" for name in _COLUMNS))
    lines += [_beyond(what, one) for what, each in kills.items() for one in each["beyond"]]
    lines.append("")
    for what, each in report["lateness"].items():
        p99 = ", ".join(f"{name} {found:.0f} us" for name, found in each["p99_us"].items())
        ratios = ", ".join(f"{name} {found:.2f}" for name, found in each["ratio"].items())
        lines.append(f"lateness p99, {what}: {p99}; ratio {ratios}")
    total, within = (sum(each[name] for each in kills.values()) for name in ("kills", "within"))
    stayed = sum(each["stayed_off"] for each in kills.values())
    goal = f"outputs off within {report['goal_ms']:g} ms"
    lines.append(f"{goal}: {within} of {total}; off for 0.5 s and more after that: {stayed}")
    return "\n".join(lines)


def _beyond(what: str, one: dict[str, float | None]) -> str:
    """A kill beyond the goal, and what is known of the machine meanwhile."""
    still = one["stood_still_ms"]
    if still is None:
        seen = "whether the machine stood still meanwhile was not watched"
    elif still > 0:
        seen = f"a processor stood still for {still:.1f} ms meanwhile"
    else:
        seen = "no processor stood still meanwhile"
    return f"{what}: off after {one['took_ms']:.1f} ms; {seen}"


def _cell(value: object) -> str:
    return f"{value:.1f}" if isinstance(value, float) else str(value)
