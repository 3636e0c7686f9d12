"""Values out and back over two carriers, each with its stamps, and the legs of each way.

run -> socket -> node -> DDS -> node -> socket -> run
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from select import select
from time import monotonic_ns
from typing import Final

from firmware_runtime.links.cut.channel import CarrierChannel, Interpreter
from firmware_runtime.links.cut.wire import Frame, Kind, decoded, encoded

POINTS: Final = ("sent", "read", "published", "arrived", "handed", "received")
LEGS: Final = ("run -> socket -> node", "node", "DDS", "node (other)", "node -> socket -> run")
BODY: Final = bytes(40)
_SILENCE_S: Final = 1.0


@dataclass(slots=True)
class End:
    """One run's end of the link, played by the bench."""

    channel: CarrierChannel
    session: int
    counter: int = 0

    def send(self, kind: Kind, peer: int) -> int:
        """Send a frame; return when."""
        self.counter += 1
        at = monotonic_ns()
        frame = Frame(kind, self.session, peer, self.counter, at, ports=1, step=1, body=BODY)
        self.channel.send(encoded(frame))
        return at

    def received(self) -> tuple[Frame, int] | None:
        """The next frame that is no report, and when it came; None if none comes."""
        while select([self.channel], (), (), _SILENCE_S)[0]:
            datagram = self.channel.receive()
            at = monotonic_ns()
            if datagram is not None and (frame := decoded(datagram)).kind is not Kind.REPORT:
                return frame, at
        return None


def trips(
    interpreter: Interpreter, directory: Path, count: int, interval_s: float
) -> tuple[list[int], dict[str, list[int]]]:
    """Round trips, and of both ways together each leg, in ns."""
    notes: dict[tuple[str, int, int], int] = {}
    ends = [_end(interpreter, directory, number) for number in (0, 1)]
    robot, controller = ends
    _meet(robot, controller)
    round_trips: list[int] = []
    while len(round_trips) < count:
        began = _cross(robot, controller, notes)
        ended = None if began is None else _cross(controller, robot, notes)
        if began is not None and ended is not None:
            round_trips.append(ended[1] - began[0])
        select((), (), (), interval_s)
    for end in ends:
        end.channel.close()
    for number in (0, 1):
        for point, session, counter, at in json.loads(_file(directory, number).read_text()):
            notes[point, session, counter] = at
    return round_trips, _legs(notes)


def _end(interpreter: Interpreter, directory: Path, number: int) -> End:
    sends, receives = ("from_robot", "to_robot")[:: 1 if number == 0 else -1]
    words = ["--namespace", "/bench", "--role", f"end_{number}"]
    variables = {**(interpreter.variables or {}), "STAMPS": str(_file(directory, number))}
    channel = CarrierChannel(
        "benchmarks.ros2.stamped",
        [*words, "--sends", f"link/{sends}", "--receives", f"link/{receives}"],
        interpreter=Interpreter(interpreter.words, variables),
    )
    return End(channel, session=number + 1)


def _file(directory: Path, number: int) -> Path:
    return directory / f"stamps-{number}.json"


def _meet(robot: End, controller: End) -> None:
    """Greet until each end has been greeted: topics take a while to find each other."""
    for sender, receiver in ((robot, controller), (controller, robot)):
        while True:
            sender.send(Kind.HELLO, 0)
            if receiver.received() is not None:
                break


def _cross(
    sender: End, receiver: End, notes: dict[tuple[str, int, int], int]
) -> tuple[int, int] | None:
    """When a value was sent and when it was received; None if it was lost."""
    sent = sender.send(Kind.STEP, receiver.session)
    while (came := receiver.received()) is not None:
        frame, at = came
        if frame.kind is Kind.STEP and frame.counter == sender.counter:
            notes["sent", sender.session, frame.counter] = sent
            notes["received", sender.session, frame.counter] = at
            return sent, at
    return None


def _legs(notes: Mapping[tuple[str, int, int], int]) -> dict[str, list[int]]:
    legs: dict[str, list[int]] = {leg: [] for leg in LEGS}
    for point, session, counter in notes:
        if point != "received":
            continue
        at = [notes.get((each, session, counter)) for each in POINTS]
        if all(each is not None for each in at):
            _add(legs, [each for each in at if each is not None])
    return legs


def _add(legs: dict[str, list[int]], at: Sequence[int]) -> None:
    for leg, sooner, later in zip(LEGS, at, at[1:], strict=False):
        legs[leg].append(later - sooner)
