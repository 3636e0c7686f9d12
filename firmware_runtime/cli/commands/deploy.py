"""`firmware-runtime deploy HOST BOARD`: from a checkout to a robot, in one command; or to many."""

import argparse
import sys
from functools import partial
from pathlib import Path

from firmware_runtime.board import installed as kinds
from firmware_runtime.board import registry
from firmware_runtime.cli.arguments import SubParsers, add_verb, refuse_idle, whole
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.host.deployment.connection import Commands, Connection, fault_of_host
from firmware_runtime.host.deployment.deployment import Deployment, DeploymentOptions
from firmware_runtime.host.deployment.first_activations import TIMEOUT_S, first_figures
from firmware_runtime.host.deployment.fleet import deploy_all, load_fleet
from firmware_runtime.host.deployment.update import update_of
from firmware_runtime.host.installation.plan import device_nodes
from firmware_runtime.statistics.summary import summary

_STATUS = "status"
_LONGEST_HEALTH_S = 3600
_ABOUT = """
The target needs Python 3.11 or later, rsync, systemd, and a login by key as root or as a user with
sudo. Its environment is made here (extra deploy): nothing is compiled there, and nothing is
downloaded there. The program goes to /opt/firmware-runtime, beside the old one, with the packages
of all its robots; a robot that runs is stopped, and switched off, only when the new one has passed
check and doctor; one that is armed is refused. The new version is kept when it has been healthy for
a while, else the one before comes back by itself, also after a power cut. What stands in
/etc/firmware-runtime stays. `deploy status HOST` says which versions a computer has, and why one
was taken back; `deploy HOST --to VERSION` goes to one of them. FLEET is a TOML file with a table
for each robot: host and board, and settings, port, identity, ssh_options, python where needed.
"""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    about = "Install this program and a board's service on another computer, over ssh."
    verb = add_verb(verbs, "deploy", about, execute)
    verb.epilog = _ABOUT
    verb.add_argument(
        "host",
        metavar="HOST",
        nargs="?",
        help="as ssh takes it: a name, or USER@NAME; or `status HOST`: versions and last update",
    )
    verb.add_argument(
        "board",
        metavar="BOARD",
        nargs="?",
        help="a board's name, or a robot's own; with --to that of the last update unless given",
    )
    verb.add_argument(
        "--all",
        type=Path,
        metavar="FLEET",
        help="to the robots of this file, one after the other, up to the first that fails",
    )
    verb.add_argument(
        "--to",
        default="",
        metavar="VERSION",
        help="go to a version that is still there, as `status` calls it or its folder",
    )
    verb.add_argument(
        "--settings",
        type=Path,
        metavar="FILE",
        help="a board.toml that becomes the board's settings there; those before are kept beside",
    )
    verb.add_argument(
        "--wheel", type=Path, metavar="FILE", help="this wheel of the project, not one made here"
    )
    verb.add_argument(
        "--sign",
        type=Path,
        metavar="KEY",
        help="sign what is sent by this ssh key; a target with allowed_signers asks for it",
    )
    verb.add_argument(
        "--dry-run", action="store_true", help="look at the target, print what would be run"
    )
    _add_way(verb)
    _add_place(verb)


def _add_way(verb: argparse.ArgumentParser) -> None:
    way = verb.add_argument_group("how it gets there")
    way.add_argument("--port", type=int, metavar="N", help="the port of ssh")
    way.add_argument("--identity", type=Path, metavar="FILE", help="the private key")
    way.add_argument(
        "-o",
        action="append",
        default=[],
        metavar="OPTION",
        dest="ssh_options",
        help="an option of ssh, such as -o ProxyJump=gate; may be repeated",
    )


def _add_place(verb: argparse.ArgumentParser) -> None:
    place = verb.add_argument_group("what happens there")
    place.add_argument(
        "--python", default="python3", metavar="PATH", help="the target's Python; default python3"
    )
    place.add_argument(
        "--health",
        type=partial(whole, least=1, most=_LONGEST_HEALTH_S),
        default=30,
        metavar="SECONDS",
        help="try the new version so long, and take it back if it is not healthy; default 30",
    )
    place.add_argument(
        "--no-start", action="store_true", help="leave the robot stopped, also one that ran"
    )
    place.add_argument(
        "--force", action="store_true", help="go on although the doctor finds a failure"
    )
    place.add_argument(
        "--root",
        type=_root,
        metavar="DIR",
        help="put everything below this folder and start nothing; to try it without a robot",
    )


def _root(text: str) -> str:
    # the first line of an installed program names its interpreter, which ends at a blank
    if not text.startswith("/") or text.strip("/") == "" or len(text.split()) != 1:
        raise argparse.ArgumentTypeError(
            f"{text!r}: expected a folder's whole path, without blanks"
        )
    return text.rstrip("/")


def execute(arguments: argparse.Namespace) -> int:
    """Deploy, then wait for the first activations. Raises DeploymentError."""
    commands = Commands(_log, dry_run=arguments.dry_run)
    if arguments.all is not None:
        return deploy_all(_fleet(arguments), partial(_deploy, commands=commands), _log)
    if arguments.host == _STATUS:
        return _show_status(arguments)
    return _deploy(_options(arguments), commands)


def _fleet(arguments: argparse.Namespace) -> dict[str, DeploymentOptions]:
    """The options of each robot of the fleet. Raises ConfigError with all that is wrong."""
    file: Path = arguments.all
    names = ("host", "board", "settings", "port", "identity", "ssh_options")
    refuse_idle(arguments, "deploy", names, f" with --all; it stands in {file}")
    found: dict[str, DeploymentOptions] = {}
    faults: list[str] = []
    for name, robot in load_fleet(file).items():
        own = {key: value for key in robot.__struct_fields__ if (value := getattr(robot, key))}
        for key in ("settings", "identity"):
            if key in own:
                own[key] = file.parent / Path(own[key]).expanduser()
        try:
            found[name] = _options(argparse.Namespace(**{**vars(arguments), **own}))
        except ConfigError as error:
            faults += [f"{name}: {fault}" for fault in error.faults]
    if faults:
        raise ConfigError(str(file), faults)
    return found


def _options(arguments: argparse.Namespace) -> DeploymentOptions:
    """What a deployment is done by. Raises ConfigError with everything wrong with it."""
    if arguments.to:
        refuse_idle(arguments, "deploy", ("settings", "wheel", "sign"), " with --to")
    board = _sound_board(arguments)
    return DeploymentOptions(
        host=arguments.host,
        board=arguments.board or "",
        kind=board.kind if board is not None else "",
        nodes=tuple(device_nodes(board)) if board is not None else (),
        ssh_options=_ssh_options(arguments),
        root=arguments.root or "",
        python=arguments.python,
        settings=arguments.settings,
        wheel=arguments.wheel,
        start=not arguments.no_start,
        force=arguments.force,
        health_s=arguments.health,
        sign=arguments.sign,
        to=arguments.to,
    )


def _deploy(options: DeploymentOptions, commands: Commands) -> int:
    deployment = Deployment(options, commands)
    try:
        if not deployment.carry_out():
            print("it is in use: there is nothing to do")
        elif commands.dry_run:
            print("dry run: nothing was changed")
        elif options.root:
            print(f"{options.home}/venv/bin/firmware-runtime is there; nothing was started")
        elif options.start:
            return _await_activations(options, deployment)
    except KeyboardInterrupt:
        print(f"firmware-runtime: interrupted; deploy to {options.host} again", file=sys.stderr)
        return Status.INTERRUPTED
    return Status.OK


def _show_status(arguments: argparse.Namespace) -> int:
    host = arguments.board
    if fault := _fault_of_host(host):
        raise ConfigError("deploy status", [fault])
    connection = Connection(host, _ssh_options(arguments), Commands(_log))
    print("\n".join(update_of(connection).lines()))
    return Status.OK


def _fault_of_host(host: str | None) -> str | None:
    return "HOST: missing; expected HOST or USER@HOST" if host is None else fault_of_host(host)


def _sound_board(arguments: argparse.Namespace) -> registry.Board | None:
    """The board, if one is sent; raises ConfigError with everything wrong with the command line."""
    faults = [fault] if (fault := _fault_of_host(arguments.host)) else []
    faults += [
        f"{file}: no file; expected {what}"
        for file, what in (
            (arguments.wheel, "the project's wheel"),
            (arguments.sign, "an ssh key"),
            (arguments.settings, "a board.toml"),
        )
        if file is not None and not file.is_file()
    ]
    board = None if arguments.to else _board_to_send(arguments, faults)
    if faults:
        raise ConfigError("deploy", faults)
    return board


def _board_to_send(arguments: argparse.Namespace, faults: list[str]) -> registry.Board | None:
    settings: Path | None = arguments.settings
    if arguments.board is None:
        faults.append(f"BOARD: missing; expected {' or '.join(kinds.names())}, or a robot's own")
    elif settings is not None and settings.is_file():
        board = registry.load(str(settings))
        if board.name != arguments.board:
            faults.append(f"{board.source}: settings of {board.name}, not of {arguments.board}")
        return board
    elif settings is None and arguments.board not in kinds.names():
        faults.append(
            f"{arguments.board!r}: no board; expected {' or '.join(kinds.names())}, or a robot's "
            "own name with its file as --settings FILE"
        )
    elif not faults:
        return registry.load(arguments.board)
    return None


def _ssh_options(arguments: argparse.Namespace) -> tuple[str, ...]:
    options = [f"-o{option}" for option in arguments.ssh_options]
    if arguments.port is not None:
        options.append(f"-oPort={arguments.port}")
    if arguments.identity is not None:
        options += ["-i", str(arguments.identity), "-oIdentitiesOnly=yes"]
    return tuple(options)


def _await_activations(options: DeploymentOptions, deployment: Deployment) -> int:
    print("wait for the first activations")
    figures = first_figures(options, deployment)
    if figures is not None:
        print(f"  {summary(figures)}")
        return Status.OK
    print(
        f"firmware-runtime: {options.host}: no activation within {TIMEOUT_S:g} s; "
        f"see ssh {options.host} firmware-runtime service logs {deployment.board}",
        file=sys.stderr,
    )
    return Status.NOTHING_HAPPENED


def _log(line: str) -> None:
    print(line, flush=True)
