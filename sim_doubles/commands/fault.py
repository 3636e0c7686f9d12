"""`firmware-runtime doubles fault KIND [DEVICE]`: break served doubles; list what was broken."""

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from msgspec import json

from firmware_runtime.cli.arguments import SubParsers, add_verb
from firmware_runtime.cli.written import check_test_file
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.hal.served.packets import FaultList
from firmware_runtime.hal.served.strikes import clear, faults_of, strike
from firmware_runtime.hal.strike import KINDS, Kind, Struck
from firmware_runtime.system.atomic_file import keep_output

CLEAR: Final = "clear"
FOR_S: Final = 1.0
EVER: Final = "ever"
_UNSAID: Final = object()
"""In place of a length that was not said; None is for ever."""
_ABOUT = "\n".join(f"{kind.name:12} {kind.meaning}" for kind in KINDS.values())


def add_fault_to(actions: SubParsers) -> None:
    """Add this action of `doubles`."""
    summary = "Break something on served doubles, or list what can be and was broken."
    verb = add_verb(actions, "fault", summary, execute)
    verb.formatter_class = argparse.RawDescriptionHelpFormatter
    verb.epilog = f"kinds:\n{_ABOUT}"
    verb.add_argument(
        "kind",
        nargs="?",
        choices=[*KINDS, CLEAR],
        metavar="KIND",
        help=f"what happens, see below; `{CLEAR}` ends all faults",
    )
    verb.add_argument(
        "device",
        nargs="?",
        default="",
        metavar="DEVICE",
        help="a device, bus or port by its name in board.toml, or a chip as 0x40 or i2c1@0x40; "
        "default: all that the kind fits",
    )
    verb.add_argument(
        "--socket", type=Path, required=True, metavar="PATH", help="where the doubles are served"
    )
    verb.add_argument(
        "--for",
        type=_span,
        default=_UNSAID,
        metavar="SECONDS",
        dest="for_s",
        help=f"how long it lasts (default {FOR_S:g}); 0: one transaction; {EVER}: until `{CLEAR}`",
    )
    verb.add_argument("--amount", type=float, metavar="N", help="how much, of a kind that has one")
    verb.add_argument(
        "--as-test",
        type=Path,
        metavar="FILE.py",
        help="write a test that breaks the robot in virtual time as it was broken here, in the run "
        "under way or the last",
    )
    verb.add_argument("--list", action="store_true", help="list kinds, devices, and what was done")
    verb.add_argument("--json", action="store_true", help="print the list as JSON")


def execute(arguments: argparse.Namespace) -> int:
    """Ask the server for it; its log has when a fault began and ends."""
    path, kind = arguments.socket, arguments.kind
    if arguments.list:
        _refuse_kind(kind or (arguments.as_test and "--as-test"), "--list")
        _print(faults_of(path), as_json=arguments.json)
    elif arguments.as_test is not None:
        _refuse_kind(kind, "--as-test")
        _write_test(faults_of(path), arguments.as_test)
    elif kind is None:
        raise ConfigError.of_one("doubles fault", "no kind", f"one of {', '.join(KINDS)}, {CLEAR}")
    elif kind == CLEAR:
        if arguments.device:
            fault = f"clear {arguments.device}; it ends all faults"
            raise ConfigError.of_one("doubles fault", fault, "it without a device")
        listing = clear(path)
        if arguments.json:
            _print(listing, as_json=True)
        else:
            print(f"{listing.board}: no fault any more")
    else:
        for_s = arguments.for_s
        if for_s is _UNSAID:
            for_s = None if KINDS[kind].is_moment else FOR_S
        listing = strike(path, kind, arguments.device, for_s=for_s, amount=arguments.amount)
        if arguments.json:
            _print(listing, as_json=True)
        else:
            print(_made(listing.struck[-1]))
    return Status.OK


def _write_test(listing: FaultList, test: Path) -> None:
    """Run the script of what was done, then write it as a test. Raises ConfigError."""
    # it opens a robot, which no other use of this command does
    from sim_doubles.commands.faults_as_test import (  # noqa: PLC0415
        script_of,
        text_of_test,
        what_is_noticed,
    )

    check_test_file(test)
    script = script_of(listing)
    noticed = what_is_noticed(script)
    text = text_of_test(script, test.stem, noticed)
    keep_output(test, text.encode(), "--as-test")
    count = "1 fault" if len(script.faults) == 1 else f"{len(script.faults)} faults"
    print(f"{test}: {count} in {script.for_s:g} s of {listing.board}")
    print(f"  noticed: {noticed}" if noticed else "  no fault is reported, and outputs stay on")


def _refuse_kind(kind: str | None, option: str) -> None:
    if kind is not None:
        raise ConfigError.of_one("doubles fault", f"{option} with {kind}", "one of both")


def _print(listing: FaultList, *, as_json: bool) -> None:
    if as_json:
        print(json.format(json.encode(_document(listing))).decode())
        return
    for line in _lines(listing):
        print(line)


def _document(listing: FaultList) -> dict[str, object]:
    return {
        "board": listing.board,
        "at_ns": listing.at,
        "kinds": [_described(kind) for kind in listing.kinds],
        "devices": [
            {
                "name": place.name,
                "chip": place.chip or None,
                "line": place.line,
                "address": place.address,
                "kinds": place.kinds,
            }
            for place in listing.places
        ],
        "struck": [
            {
                "kind": each.kind,
                "device": each.device,
                "at_ns": each.at,
                "span_ns": each.span,
                "amount": each.amount,
            }
            for each in listing.struck
        ],
    }


def _described(kind: Kind) -> dict[str, object]:
    return {
        "kind": kind.name,
        "of": kind.of,
        "meaning": kind.meaning,
        "amount": kind.amount,
        "unit": kind.unit or None,
    }


def _lines(listing: FaultList) -> Iterator[str]:
    yield f"{listing.board}: kinds"
    for kind in listing.kinds:
        amount = "" if kind.amount is None else f" (--amount {kind.amount:g}, {kind.unit})"
        yield f"  {kind.name:12} {kind.of:7} {kind.meaning}{amount}"
    yield "devices and lines"
    for place in listing.places:
        of = "serial" if "silent" in place.kinds else "I2C"
        where = "all on it" if place.is_line else f"{place.what} on {place.line}"
        yield f"  {place.name:16} {of:7} {where}"
    yield "what was done" if listing.struck else "nothing was done yet"
    for each in listing.struck:
        yield f"  {each.at / SECOND:12.3f} s  {_made(each)}"


def _made(each: Struck) -> str:
    what = each.kind if each.amount is None else f"{each.kind} {each.amount:g}"
    where = f"{each.device or 'all'}: {what}"
    if each.kind == "push":
        return what
    if KINDS[each.kind].is_moment:
        return where
    if each.span is None:
        return f"{where} until it is cleared"
    if each.span == 0:
        return f"{where} once"
    return f"{where} for {each.span / SECOND:g} s"


def _span(text: str) -> float | None:
    if text == EVER:
        return None
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0 <= value <= 1e9:
        raise argparse.ArgumentTypeError(f"{text!r}: expected 0 or more seconds, or {EVER}")
    return value
