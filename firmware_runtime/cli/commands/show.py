"""`firmware-runtime show [BOARD|MODEL]`: the boards there are; a model as a tree, or drawn."""

import argparse
import sys
from pathlib import Path

from firmware_runtime.board import installed, registry
from firmware_runtime.board.ends import BoardEnd, other_end, robot_of
from firmware_runtime.board.local_settings import known_names, settings_in_force
from firmware_runtime.cli.arguments import (
    ADDRESS,
    SubParsers,
    add_board,
    add_key,
    add_output,
    add_verb,
)
from firmware_runtime.cli.chosen_board import chosen_board, chosen_end, is_model
from firmware_runtime.cli.chosen_model import ANY, devs_model
from firmware_runtime.cli.written import check_output, write_text
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.tree import tree
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.system.terminal import print_line
from firmware_runtime.view.diagram.draw import Form, diagram

_FORMS: dict[str, Form] = {".svg": "svg", ".mmd": "mmd"}
_ABOUT = """
Without a word: the boards that are installed. Of a board or a model: its components, ports and
couplings, or with -o a picture of them, or of the states of one of its models. With --ports: the
ports that `send` and `watch` take, of a board, or of a robot that runs behind a bridge. No line is
opened.
"""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "List the boards; show a model: components, ports, couplings; or draw it."
    verb = add_verb(verbs, "show", summary, execute)
    verb.epilog = _ABOUT
    add_board(verb, required=False, about=f"{ANY}; with --ports also BOARD.ROLE or ADDRESS:PORT")
    add_output(verb, "draw it: FILE.svg or FILE.mmd")
    verb.add_argument(
        "--state", metavar="MODEL", help="draw this model's states, such as controller.mode"
    )
    verb.add_argument(
        "--whole", action="store_true", help="draw the robot with its hardware, not the model alone"
    )
    verb.add_argument("--ports", action="store_true", help="list names and types of its ports")
    add_key(verb)


def execute(arguments: argparse.Namespace) -> int:
    """List, print or draw; no bus is opened."""
    _refuse_without_effect(arguments)
    if arguments.board is None:
        return _boards()
    if arguments.ports:
        _print_ports(arguments)
    elif arguments.output is not None:
        path: Path = arguments.output
        check_output(path, _FORMS)
        drawn = _model(arguments, whole=arguments.whole)
        write_text(diagram(drawn, arguments.state, _FORMS[path.suffix]), path)
    else:
        print(tree(_model(arguments, whole=True)))
    return Status.OK


def _refuse_without_effect(arguments: argparse.Namespace) -> None:
    """Raise ConfigError for options that belong to another form of the verb."""
    is_drawn = arguments.output is not None
    belongs = {
        "--state": (arguments.state, "-o FILE", is_drawn),
        "--whole": (arguments.whole, "-o FILE", is_drawn),
        "--key": (arguments.key, "--ports", arguments.ports),
        "-o": (is_drawn, "BOARD", arguments.board is not None and not arguments.ports),
        "--ports": (arguments.ports, "BOARD", arguments.board is not None),
        "--set": (arguments.assignments, "BOARD", arguments.board is not None),
    }
    faults = [
        f"{option}: has no effect here; expected it with {other}"
        for option, (given, other, is_there) in belongs.items()
        if given and not is_there
    ]
    if faults:
        raise ConfigError("show", faults)


def _model(arguments: argparse.Namespace, *, whole: bool) -> Component:
    """The model alone, where the board has one that event files run on; else the robot."""
    if is_model(arguments.board):
        return devs_model(arguments.board, arguments.assignments)
    board = chosen_board(arguments.board, arguments.assignments)
    if board.event_model is not None and not whole:
        return board.event_model(None)
    return board.unconnected().model


def _print_ports(arguments: argparse.Namespace) -> None:
    """Print direction, name and type of each, and how a record that enters is written."""
    # Loaded where it is asked for: a picture needs no socket.
    from firmware_runtime.links.ports.ports_client import PortsClient  # noqa: PLC0415

    if ADDRESS.fullmatch(arguments.board):
        with PortsClient(arguments.board, arguments.key) as robot:
            listed = [*robot.ports()]
    else:
        listed = _ports_of(*chosen_end(arguments.board, arguments.assignments))
    for port in listed:
        form = f"  {port['value']}" if "value" in port else ""
        print(f"{port['direction']:3} {port['name']}: {port['type']}{form}")


def _ports_of(board: registry.Board, end: BoardEnd | None) -> list[dict[str, str]]:
    """The ports of a board's model, or of what one end of it runs."""
    from firmware_runtime.links.ports.ports import Ports  # noqa: PLC0415 -- as above

    whole = board.unconnected()
    ports = Ports(whole.model)
    if end is not None:
        ports = ports.of_part(robot_of(end, whole)[1], other_end(board, end).name)
    return ports.listing()


def _boards() -> int:
    """Print each board's name, description and file; those that are broken come last."""
    broken: list[ConfigError] = []
    for name in known_names():
        try:
            _print_board(name)
        except ConfigError as error:
            broken.append(error)
    for each in broken:
        print_line(f"firmware-runtime: {each}", sys.stderr)
    return Status.BAD_INPUT if broken else Status.OK


def _print_board(name: str) -> None:
    """A kind as it is shipped, or a robot's own settings."""
    copy = settings_in_force(name)
    if copy is not None and name not in installed.names():
        board = registry.load_copy(copy, name)
        print(f"{name:12} {board.settings.description}\n{'':12} a {board.kind}, by {copy}")
        return
    board = registry.load(name)
    print(f"{name:12} {board.settings.description}\n{'':12} {board.source}")
    if copy is not None:
        print(f"{'':12} in force on this machine: {copy}")
