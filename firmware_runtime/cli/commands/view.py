"""`firmware-runtime view [BOARD | RUN | FILE]`: a page on which one sees what a robot does."""

import argparse
import asyncio
import os
import sys
import webbrowser
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

from firmware_runtime.cli.arguments import SubParsers, add_statistics, add_verb, port
from firmware_runtime.errors import ConfigError, StatisticsFileError, Status
from firmware_runtime.recording.blackbox.locations import find_recording
from firmware_runtime.statistics.paths import Companion, find_statistics
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.system.packages import module_of_extra

if TYPE_CHECKING:
    from firmware_runtime.live.source import Source

_ABOUT = """
Of a board whose run is under way the page is live; of one that has ended, of a recording's file or
of a name that `recordings list` shows it shows what was recorded. It listens on loopback alone
unless --address and --token-file say otherwise. Needs the extra `view`.
"""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    verb = add_verb(verbs, "view", "Open a page on a run, live or recorded.", execute)
    verb.epilog = _ABOUT
    verb.add_argument(
        "run",
        metavar="BOARD|RUN|FILE",
        nargs="?",
        help="a board's name, a recording's name or its file; default: whatever ran last",
    )
    add_statistics(verb, "of the run that keeps this file")
    verb.add_argument(
        "--port", type=port, default=8765, metavar="N", help="0 for any; default 8765"
    )
    verb.add_argument("--address", default="127.0.0.1", help="to listen on; default 127.0.0.1")
    verb.add_argument(
        "--socket", metavar="PATH", help="listen on a Unix socket here, in place of a port"
    )
    verb.add_argument(
        "--foxglove",
        type=port,
        nargs="?",
        const=8766,
        metavar="N",
        help="serve the values of a run under way to viewers such as Foxglove, on loopback; "
        "default 8766",
    )
    verb.add_argument("--no-browser", action="store_true", help="do not open a browser")
    verb.add_argument(
        "--token-file", type=Path, metavar="FILE", help="who asks needs this key (`new key FILE`)"
    )
    verb.add_argument(
        "--allow-arm", action="store_true", help="let the page arm the robot, not just disarm it"
    )


def execute(arguments: argparse.Namespace) -> int:
    """Serve it until a signal comes."""
    module_of_extra("aiohttp", "view")
    source = _source(arguments)
    from firmware_runtime.live.actions import Actions  # noqa: PLC0415 -- needs the extra
    from firmware_runtime.live.entrance import Entrance  # noqa: PLC0415
    from firmware_runtime.live.server import PageServer, serve_until_signal  # noqa: PLC0415
    from firmware_runtime.live.source import give_way_to  # noqa: PLC0415

    with source, _channels(source, arguments.foxglove):
        give_way_to(source.look().pid if source.is_live else None)
        entrance = Entrance(arguments.address, arguments.port, arguments.token_file)
        server = PageServer(source, entrance, Actions(source, may_arm=arguments.allow_arm))

        def ready(port: int) -> None:
            where = arguments.socket or f"http://{_host(arguments.address)}:{port}/"
            token = "" if entrance.token is None else f"?token={entrance.token}"
            print(
                f"{source.board.name}: {where}{token if arguments.socket is None else ''}",
                flush=True,
            )
            if not (arguments.no_browser or arguments.socket) and _has_screen():
                webbrowser.open(f"{where}{token}")

        try:
            asyncio.run(serve_until_signal(server, entrance, socket=arguments.socket, ready=ready))
        except OSError as error:
            where = arguments.socket or f"{arguments.address}:{arguments.port}"
            fault = f"cannot listen there ({error.strerror or error})"
            expected = "a path in a folder" if arguments.socket else "a free --port, or 0 for any"
            raise ConfigError.of_one(where, fault, expected=expected) from error
    return Status.OK


def _channels(source: "Source", port: int | None) -> AbstractContextManager[object]:
    """Serve what is observed to viewers, at a port; None: to none. Raises ConfigError."""
    if port is None:
        return nullcontext()
    if not source.is_live:
        expected = "a run under way, or `export RUN -o FILE.mcap`"
        raise ConfigError.of_one("--foxglove", "this is a recording", expected=expected)
    from firmware_runtime.live.foxglove import LOOPBACK, FoxgloveChannels  # noqa: PLC0415 -- an extra

    channels = FoxgloveChannels(source.board.name, source.observed.ports, port)

    def send(at: int, path: str, value: object) -> None:
        began = source.observed.header.began
        channels.send(path, at + (0 if began is None else began[1]), value)

    source.listeners.append(send)
    print(f"foxglove: ws://{LOOPBACK}:{channels.port}", flush=True)
    return channels


def _source(arguments: argparse.Namespace) -> "Source":
    """The run or the recording that is meant. Raises ConfigError."""
    from firmware_runtime.live.source import Source, of_run  # noqa: PLC0415 -- needs the extra

    word: str | None = arguments.run
    if arguments.statistics is not None:
        return of_run(arguments.statistics)
    if word is None or not (os.sep in word or Path(word).is_file()):
        try:
            statistics = find_statistics(word)
            recording = Companion.RECORDING.beside(statistics)
            if recording.is_file() and _is_newest(word, recording):
                return Source(
                    recording, statistics, is_live=read_statistics(statistics).writer_alive
                )
        except (ConfigError, StatisticsFileError):
            if word is None:
                raise
    return Source(find_recording(word or ""), None, is_live=False)


def _is_newest(word: str | None, recording: Path) -> bool:
    """Return whether the board's last run is this one, not one in virtual time."""
    return word is None or find_recording(word).samefile(recording)


def _has_screen() -> bool:
    return sys.platform == "darwin" or bool(
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    )


def _host(address: str) -> str:
    return f"[{address}]" if ":" in address else address
