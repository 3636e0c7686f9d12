"""Recordings of boards' parts: the cut, the header, and the same part built again to replay."""

from collections.abc import Sequence
from dataclasses import replace

from msgspec.structs import asdict

from firmware_runtime.board.registry import Board
from firmware_runtime.board.roles import components_of
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.part import part_of
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.clocks import Clock
from firmware_runtime.part_recording.comparison import Comparison, compare
from firmware_runtime.part_recording.cut import Cut, cut_around, type_name
from firmware_runtime.part_recording.noting_lines import noting_lines
from firmware_runtime.part_recording.recording import Recording
from firmware_runtime.part_recording.records import FORMAT, Header
from firmware_runtime.part_recording.replay import replay
from firmware_runtime.recording.chance import places
from firmware_runtime.recording.code import code_of
from firmware_runtime.recording.header import recorded_board


def components(board: Board, role: str) -> list[str]:
    """The components of a role. Raises ConfigError for one that the board has not."""
    return components_of(board.settings.roles, _model(board), role)


def cut_of(board: Board, role: str, model: Coupled) -> Cut:
    """The cut around a role's part in a model of this board that may have a world attached.

    Raises ConfigError for a role that the board has not, and for a world that feeds the part: what
    it says would enter unseen in a run on the robot.
    """
    fresh, names = _model(board), components(board, role)
    stated, cut = cut_around(fresh, names), cut_around(model, names)
    if strange := cut.entrances.keys() - stated.entrances.keys():
        fault = f"{', '.join(sorted(strange))}: feeds the {role}; expected the board's own wires"
        raise ConfigError.of_one(f"rig of {board.name}", fault)
    entrances = {  # a part that runs alone does not know who sends
        crossing: replace(each, name=stated.entrances[crossing].name)
        for crossing, each in cut.entrances.items()
    }
    leaving = {name: port for name, port in cut.leaving.items() if name in stated.leaving}
    return replace(cut, entrances=entrances, leaving=leaving)


def header_of(board: Board, role: str, cut: Cut, clock: Clock, shown: str | None) -> Header:
    """What a recording says about itself."""
    return Header(
        **asdict(recorded_board(board, cut.atomics, clock)),
        format=FORMAT,
        role=role,
        components=list(cut.names),
        entering={each.name: type_name(each.port.type) for each in cut.entrances.values()},
        crossings=list(cut.entrances),
        positions=[each.position for each in cut.entrances.values()],
        leaving={name: type_name(port.type) for name, port in cut.leaving.items()},
        shown=shown,
    )


def replay_of(recording: Recording, board: Board) -> Comparison:
    """Replay a recording on this board's part, built again, and compare.

    Raises ConfigError for a recording of another robot, or of a part that this one does not have.
    """
    header = recording.header
    if (header.board, header.kind) != (board.name, board.kind):
        fault = f"a recording of {header.board}, a {header.kind}; expected one of {board.name}"
        raise ConfigError.of_one("replay", fault)
    uses: list[str] = []
    robot = board.build(noting_lines(board, uses))
    if missing := [name for name in header.components if name not in robot.model.components]:
        raise ConfigError.of_one("replay", f"{board.name} has no component {', '.join(missing)}")
    part = part_of(robot.model, header.components)
    stood = places()
    comparison = compare(recording, replay(recording, part.model, robot.retune))
    comparison = replace(comparison, has_drawn=places() != stood)
    if uses:
        used = ", ".join(dict.fromkeys(uses))
        fault = f"the {header.role} uses {used}: what it learns there is not recorded"
        return replace(comparison, fault=f"{fault}; name the component in another role")
    return comparison


def part_code(board: Board, names: Sequence[str]) -> dict[str, str]:
    """The code of these components as it is now."""
    return code_of(cut_around(_model(board), names).atomics)


def _model(board: Board) -> Coupled:
    return board.unconnected().model
