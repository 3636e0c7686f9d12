"""Everything that reads bytes of others: each takes any bytes, or refuses them by its own errors.

A target is built once and called with one input after the other. What it may raise is stated: all
else that comes through is a finding. Recordings get right checksums, so that what is behind them is
reached. Inputs that are taken, to begin from, are in `fuzz_seeds`.
"""

import argparse
import hmac
import tempfile
from collections.abc import Callable, Mapping
from contextlib import ExitStack, suppress
from enum import Enum
from functools import partial
from pathlib import Path
from typing import Final, NamedTuple, TypeAlias

import msgspec
from firmware_drivers.chips.maxbotix import FrameDecoder
from firmware_drivers.chips.mounting import parse_mounting

from firmware_runtime import open_board
from firmware_runtime.board import registry
from firmware_runtime.board.assignments import assigned
from firmware_runtime.board.local_settings import load_table
from firmware_runtime.board.registers import register_file
from firmware_runtime.cli.run_options import stated_fault
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import SECOND
from firmware_runtime.ecdpp.event_file import parse_events
from firmware_runtime.ecdpp.model_file import parse_model
from firmware_runtime.errors import ConfigError, FirmwareRuntimeError, StatisticsFileError
from firmware_runtime.hal.served.packets import read_answer
from firmware_runtime.host.deployment.fleet import load_fleet
from firmware_runtime.lab.campaign.again import trial_of_row
from firmware_runtime.lab.campaign.campaigning import report_of
from firmware_runtime.lab.campaign.kept_findings import read_findings
from firmware_runtime.lab.identification.source import read_series
from firmware_runtime.lab.sweeps.distributions import distribution
from firmware_runtime.lab.sweeps.summary import summary as summary_of_sweep
from firmware_runtime.lab.sweeps.sweep_table import read_table
from firmware_runtime.links.bridge.signatures import Refused as BridgeRefused
from firmware_runtime.links.bridge.signatures import Signed
from firmware_runtime.links.cut.refusal import Refused as CutRefused
from firmware_runtime.links.cut.wire import Farewell, Greeting, decoded, entries_of, reading
from firmware_runtime.links.key_file import read_key
from firmware_runtime.links.ports.datagrams import Put, Refusal, understood
from firmware_runtime.links.ports.ports import Ports
from firmware_runtime.models.motion import Motion
from firmware_runtime.models.qss.expression import ExpressionError, parse
from firmware_runtime.models.trajectory_file import path_of_file
from firmware_runtime.recording.blackbox.layout import Chunk, file_of
from firmware_runtime.recording.blackbox.reader import read_recording
from firmware_runtime.recording.blackbox.salvage import save
from firmware_runtime.recording.blackbox.section import decode
from firmware_runtime.recording.values import unpack
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.takeovers import read_takeovers
from firmware_runtime.view.page_file import read_page
from sim_doubles.chips.sabertooth import SabertoothDouble
from sim_doubles.clock import ManualClock
from sim_doubles.usbip.packets import Conversation, NotAttached, NotUsbip, Setup, Stalled
from tests.ecdpp.test_model_file import CLASSES
from tests.support.hostile.frames import KEY
from tests.support.hostile.link import LinkTarget
from tests.support.served_rig import served_rig

One: TypeAlias = Callable[[bytes], object]
_BY_CONFIG: Final = (ConfigError,)


class Target(NamedTuple):
    """What reads bytes, built within a folder; and what it may raise."""

    build: Callable[[Path, ExitStack], One]
    may_raise: tuple[type[Exception], ...] = _BY_CONFIG


def _text(content: bytes) -> str:
    return content.decode("utf-8", "surrogateescape")


def _of_text(read: Callable[[str], object]) -> Callable[[Path, ExitStack], One]:
    return lambda _folder, _stack: lambda content: read(_text(content))


def _of_bytes(read: One) -> Callable[[Path, ExitStack], One]:
    return lambda _folder, _stack: read


def _of_file(name: str, read: Callable[[Path], object]) -> Callable[[Path, ExitStack], One]:
    def build(folder: Path, _stack: ExitStack) -> One:
        path = folder / name
        path.touch(mode=0o600)

        def one(content: bytes) -> None:
            path.write_bytes(content)
            read(path)

        return one

    return build


# Files --------------------------------------------------------------------------------------------


def _campaign_table(path: Path) -> None:
    """Sum a table up, for which its mission is run healthy: no long one."""
    rows = read_table(path).rows
    lengths = [row.get("mission_s") for row in rows]
    if any(isinstance(each, int | float) and each > 1 for each in lengths):
        for row in rows:
            trial_of_row(row)
    else:
        report_of(rows)


def _events(text: str) -> object:
    model = Coupled("top")
    for name, kind in (("In", float), ("count", int), ("x", bool)):
        model.in_port(name, kind)
    return parse_events(text, "x.ev", model)


def _table(path: Path) -> None:
    table = read_table(path)
    summary_of_sweep(table, "x.csv")


def _series(folder: Path, stack: ExitStack) -> One:
    board = registry.load("tachobot")
    return _of_file("x.csv", lambda path: read_series(str(path), board))(folder, stack)


def _statistics(folder: Path, _stack: ExitStack) -> One:
    """A whole file in which some words are otherwise: each a place of three bytes, and eight."""
    path = folder / "x.stats"
    with open_board("tachobot", doubles=True, clock="virtual", statistics=path) as robot:
        robot.run(0.1)
    whole = path.read_bytes()

    def one(content: bytes) -> None:
        changed = bytearray(whole)
        for at in range(0, len(content) - 10, 11):
            place = int.from_bytes(content[at : at + 3], "big") % len(whole)
            changed[place : place + 8] = content[at + 3 : at + 11]
        path.write_bytes(changed[: len(whole)])
        found = read_statistics(path)
        found.as_json()
        found.figures()

    return one


def _sections(content: bytes) -> list[bytes]:
    """Sections, each after its length: two bytes."""
    found = []
    while len(content) >= 2:
        length = int.from_bytes(content[:2], "big")
        found.append(content[2 : 2 + length])
        content = content[2 + length :]
    return found


def _recording(folder: Path, _stack: ExitStack) -> One:
    path = folder / "x.recording"

    def one(content: bytes) -> None:
        path.write_bytes(file_of([Chunk(1, _sections(content) or [b""])]))
        for chunk in read_recording(path).chunks:
            for each in chunk.contents:
                decode(each)

    return one


# Wires --------------------------------------------------------------------------------------------


def _frame(plain: bytes) -> None:
    frame = decoded(plain)
    with suppress(CutRefused):
        entries_of(frame)
    for kind in (Greeting, Farewell):
        with suppress(CutRefused):
            reading(kind)(frame.body)


def _link(_folder: Path, stack: ExitStack) -> One:
    """A robot's end without a key: what comes is believed as far as it can be read."""
    target = LinkTarget(1)
    stack.enter_context(target._stack)
    end = target._end
    end.carrier._key = None
    for attempt in LinkTarget(1).attempts(40):
        end.take(attempt.datagram[:-32])

    def one(content: bytes) -> None:
        end.now += 1_000_000
        end.take(content)

    return one


class _Mode(Enum):
    OFF = 0
    HOVER = 1


def _ports() -> Ports:
    model = Coupled("robot")
    for port, kind in {"yaw": float, "motion": Motion, "mode": _Mode, "enable": bool}.items():
        model.in_port(port, kind)
    return Ports(model)


def _obey(ports: Ports, content: bytes) -> None:
    said = understood(content)
    if isinstance(said, Put):
        ports.arrival(said.port, said.value)


def _socket(_folder: Path, _stack: ExitStack) -> One:
    return partial(_obey, _ports())


def _bridge(_folder: Path, _stack: ExitStack) -> One:
    """A bridge's admission of what has the right signature: a head, a line's end, the content."""
    ports, now = _ports(), [SECOND]
    signed = Signed(KEY, lambda: now[0])
    signed.name = "b" * 16

    def one(content: bytes) -> None:
        now[0] += 1
        head, _, said = content.partition(b"\n")
        code = hmac.digest(KEY, head + b"\n" + said, "sha256").hex().encode()
        _obey(ports, signed.admit(head + b" " + code + b"\n" + said).content)

    return one


def _served(_folder: Path, stack: ExitStack) -> One:
    served = stack.enter_context(served_rig("tachobot"))

    def one(content: bytes) -> None:
        served.clock.advance(1_000_000)
        read_answer(served.service.answer(content))

    return one


class _Adapter:
    """A USB device that takes what it is asked for."""

    def control(self, setup: Setup, written: bytes) -> bytes:
        if setup.request > 200:
            raise Stalled
        return bytes(setup.length) + written[:0]


def _usbip(_folder: Path, _stack: ExitStack) -> One:
    return lambda content: Conversation(_Adapter()).receive(content)


def _sabertooth(_folder: Path, _stack: ExitStack) -> One:
    def one(content: bytes) -> None:
        double = SabertoothDouble(ManualClock(), address=128)
        double.receive(content)
        assert all(abs(each) <= 1.0 for each in double.speeds)

    return one


def _maxbotix(content: bytes) -> None:
    whole, cut = FrameDecoder((3, 4)), FrameDecoder((3, 4))
    found = whole.feed(content)
    assert found == [count for byte in content for count in cut.feed(bytes([byte]))]
    assert all(0 <= count <= 9999 for count in found)


TARGETS: Final[Mapping[str, Target]] = {
    "board.toml": Target(_of_file("board.toml", lambda path: registry.load(str(path)))),
    "assignments": Target(_of_text(assigned), ()),
    "overrides": Target(_of_text(lambda text: registry.load("tachobot", [text]))),
    "kept settings": Target(_of_file("tachobot.settings", load_table)),
    "register tables": Target(_of_file("x.toml", register_file.load_table)),
    "mountings": Target(_of_text(parse_mounting), (ValueError,)),
    "fault scripts": Target(_of_text(stated_fault), (argparse.ArgumentTypeError,)),
    "distributions": Target(_of_text(distribution), (ValueError,)),
    "expressions": Target(_of_text(parse), (ExpressionError,)),
    "CD++ models": Target(_of_text(lambda text: parse_model(text, "x.ma", CLASSES))),
    "CD++ events": Target(_of_text(_events)),
    "fleet.toml": Target(_of_file("fleet.toml", load_fleet)),
    "trajectories": Target(_of_file("path.csv", path_of_file), (ValueError,)),
    "tables": Target(_of_file("x.csv", _table)),
    "campaign tables": Target(_of_file("x.csv", _campaign_table)),
    "series": Target(_series),
    "findings of campaigns": Target(
        _of_file("findings.json", lambda path: read_findings(path.parent))
    ),
    "pages": Target(_of_file("page.json", read_page)),
    "keys": Target(_of_file("page.key", read_key)),
    "statistics": Target(_statistics, (StatisticsFileError,)),
    "takeovers": Target(
        _of_file("x.guard", lambda path: read_takeovers(path.with_suffix(".stats")))
    ),
    "recordings": Target(_recording, (ConfigError, msgspec.MsgspecError)),
    "recordings saved": Target(_of_bytes(partial(save, Path("x.recording")))),
    "recorded values": Target(_of_bytes(unpack), (FirmwareRuntimeError, msgspec.MsgspecError)),
    "frames of a link": Target(_of_bytes(_frame), (CutRefused,)),
    "a link": Target(_link, ()),
    "messages to a run": Target(_socket, (Refusal,)),
    "a bridge": Target(_bridge, (BridgeRefused, Refusal)),
    "served doubles": Target(_served, ()),
    "USB/IP": Target(_usbip, (NotUsbip, NotAttached)),
    "Sabertooth packets": Target(_sabertooth, ()),
    "MaxBotix frames": Target(_of_bytes(_maxbotix), ()),
}


def built(name: str, stack: ExitStack) -> One:
    """Return a target that raises only what is a finding."""
    folder = Path(stack.enter_context(tempfile.TemporaryDirectory(dir=_memory())))
    one, may_raise = TARGETS[name].build(folder, stack), TARGETS[name].may_raise

    def guarded(content: bytes) -> None:
        with suppress(*may_raise):
            one(content)

    return guarded


def _memory() -> str | None:
    """A folder that is no disk, if there is one."""
    return "/dev/shm" if Path("/dev/shm").is_dir() else None  # noqa: S108 -- of random name
