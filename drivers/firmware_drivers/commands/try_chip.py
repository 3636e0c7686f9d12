"""`firmware-runtime try CHIP`: read a sensor live, or move one output for a moment."""

import argparse
import sys
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Final

from firmware_drivers.catalogue.table import chips
from firmware_drivers.catalogue.trial import Actuator, OnBus, Option, Sensor, Triable
from firmware_drivers.commands.readings import Readings
from firmware_drivers.commands.single import BUS, PORT, Now, single
from firmware_drivers.commands.trying import Watch, drive, switch_off, take
from firmware_runtime.cli.arguments import SubParsers, add_verb, positive
from firmware_runtime.devs.time import SECOND, seconds
from firmware_runtime.errors import ConfigError, SettingError, Status
from firmware_runtime.hal.wire_errors import HalError
from firmware_runtime.system.signals import UntilSignal, until_signal
from firmware_runtime.system.terminal import print_line

HELP_GROUP = "machine"
HELP_LINE = "Read a sensor live, or move one output."
DRIVEN_S: Final = 2.0
MOST_DRIVEN_S: Final = 60.0
EVERY_S: Final = 0.2
_ABOUT_SENSOR = "Without --for it goes on until Ctrl-C. A line that a run drives is left alone."
_ABOUT_ACTUATOR = """
Off again when the time is up, on Ctrl-C, Ctrl-Z, SIGTERM and SIGHUP, and when anything fails.
Killed by kill -9 or halted by SIGSTOP it leaves outputs as they are: no guard watches here. Take
propellers off first and put a vehicle on blocks. A line that a run drives is left alone.
"""


class _Pace:
    """Time as it passes for the chip, until a signal comes."""

    def __init__(self, now: Now, signal: UntilSignal) -> None:
        self.now = now
        self._signal = signal

    def wait(self, span: int) -> bool:
        """Let ns pass; return at once, and True, when a signal has come.

        A double's clock may be ahead by what its transactions took on the wire.
        """
        until = self.now() + span
        stopped = self._signal.wait(span / SECOND)
        while not stopped and (left := until - self.now()) > 0:
            stopped = self._signal.wait(left / SECOND)
        return stopped


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line, with one of its own for every chip."""
    summary = "Read a sensor live, or move one output for a moment."
    names = verbs.add_parser("try", help=summary, description=summary).add_subparsers(
        required=True, metavar="CHIP"
    )
    for chip in chips().values():
        verb = add_verb(names, chip.name, f"Try {chip.title}.", partial(execute, chip))
        line = verb.add_mutually_exclusive_group()
        line.add_argument("--doubles", action="store_true", help="on a double of the chip instead")
        _add_place(verb, line, chip)
        for option in chip.options:
            _add_option(verb, option)
        _add_time(verb, moves=chip.moves)
        verb.add_argument("--json", action="store_true", help="print each reading as a JSON line")


def execute(chip: Triable, arguments: argparse.Namespace) -> int:
    """Read it, or move it once the user agrees."""
    try:
        with single(chip, arguments) as (tried, now):
            if isinstance(tried, Actuator) != chip.moves:
                fault = f"it builds {type(tried).__name__}, and moves is {chip.moves}"
                raise ConfigError(f"try {chip.name}", [f"{fault}; expected the two to agree"])
            if isinstance(tried, Sensor):
                return _read(tried, arguments, now)
            return _move(tried, arguments, now)
    except SettingError as error:
        raise ConfigError(f"try {chip.name}", [str(error)]) from error


def _read(sensor: Sensor, arguments: argparse.Namespace, now: Now) -> int:
    readings = Readings(sys.stdout, as_json=arguments.json, never_waits=False)
    span = None if arguments.duration_s is None else seconds(arguments.duration_s)

    def say(what: str) -> None:
        readings.end()
        print_line(f"try: {what}", sys.stderr)

    with until_signal() as signal:
        watch = Watch(sensor, _Pace(now, signal), readings.show, say)
        watch.run(seconds(arguments.every_s), span)
    readings.end()
    if signal.came and span is not None:
        return _stopped_by(signal)
    return Status.OK if watch.values or signal.came else Status.NO_DEVICE


def _move(actuator: Actuator, arguments: argparse.Namespace, now: Now) -> int:
    """Move and switch off, whatever happens. What failed is raised once everything is off."""
    if not _is_agreed(actuator, arguments):
        return Status.REFUSED
    readings = Readings(sys.stdout, as_json=arguments.json, never_waits=True)
    failed: HalError | None = None
    with until_signal(is_driving=True) as signal:
        pace = _Pace(now, signal)
        if take(actuator.bring_up(), pace):
            return _stopped_by(signal)
        try:
            drive(actuator, pace, seconds(arguments.duration_s), readings.show)
        except HalError as error:
            failed = error
        finally:
            still_on = switch_off(actuator)
    readings.end()
    if still_on:
        return _not_safe(still_on)
    if failed is not None:
        raise failed
    if not arguments.json:
        print_line(f"{actuator.place}: off", sys.stdout)
    return _stopped_by(signal) if signal.came else Status.OK


def _not_safe(still_on: Sequence[str]) -> int:
    """Say what could not be switched off."""
    for each in still_on:
        print_line(f"firmware-runtime: not made safe: {each}", sys.stderr)
    return Status.NOT_SAFE


def _is_agreed(actuator: Actuator, arguments: argparse.Namespace) -> bool:
    """Return whether the user agrees that it moves; a double moves without a question."""
    what = f"{actuator.place}: {actuator.promise}, for {arguments.duration_s:g} s"
    if arguments.yes or arguments.doubles:
        print_line(what, sys.stderr)
        return True
    if sys.stdin is None or not sys.stdin.isatty():
        raise ConfigError("try", ["this moves something; expected --yes, or a terminal to ask at"])
    print_line(
        f"{what}.\nCtrl-C switches off; after kill -9 it stays on: no guard watches.", sys.stderr
    )
    sys.stderr.write("Propellers off, wheels off the ground? [y/N] ")
    sys.stderr.flush()
    return sys.stdin.readline().strip().lower() in {"y", "yes"}


def _stopped_by(signal: UntilSignal) -> Status:
    return Status.INTERRUPTED if signal.name == "SIGINT" else Status.TERMINATED


# The command line --------------------------------------------------------------------------------


def _add_place(
    verb: argparse.ArgumentParser, line: argparse._MutuallyExclusiveGroup, chip: Triable
) -> None:
    if not isinstance(chip, OnBus):
        about = f"serial port; default {PORT}"
        line.add_argument("--port", default=PORT, metavar="NODE", help=about)
        return
    about = f"number or device node; default {BUS}"
    line.add_argument("--bus", default=BUS, metavar="BUS", help=about)
    verb.add_argument(
        "--address",
        type=partial(_address, chip),
        default=chip.address,
        metavar="ADDRESS",
        help=f"such as 0x{chip.address:02x}, which is the default",
    )


def _add_time(verb: argparse.ArgumentParser, *, moves: bool) -> None:
    most = partial(positive, most=MOST_DRIVEN_S) if moves else positive
    default = (
        f"default {DRIVEN_S:g}, {MOST_DRIVEN_S:g} at most" if moves else "default: until Ctrl-C"
    )
    verb.add_argument(
        "--for",
        type=most,
        default=DRIVEN_S if moves else None,
        metavar="SECONDS",
        dest="duration_s",
        help=f"how long; {default}",
    )
    verb.epilog = _ABOUT_ACTUATOR if moves else _ABOUT_SENSOR
    if moves:
        verb.add_argument("--yes", action="store_true", help="do not ask before it moves")
    else:
        verb.add_argument(
            "--every",
            type=positive,
            default=EVERY_S,
            metavar="SECONDS",
            dest="every_s",
            help=f"from reading to reading; default {EVERY_S:g}",
        )


def _add_option(verb: argparse.ArgumentParser, option: Option) -> None:
    if option.kind is bool:
        verb.add_argument(f"--{option.name}", action="store_true", help=option.help)
        return
    shown = "" if option.default is None else f"; default {_plain(option.default)}"
    verb.add_argument(
        f"--{option.name}",
        type=partial(_number, option) if option.most is not None else option.kind,
        default=option.default,
        choices=option.choices,
        required=option.required,
        metavar=None if option.choices else option.name.upper().replace("-", "_"),
        help=f"{option.help}{shown}",
    )


def _plain(value: object) -> object:
    """A default as a person writes it: a number that is whole without a fraction."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


def _number(option: Option, text: str) -> Any:  # noqa: ANN401 -- of the option's kind
    """A number of the option's kind and range."""
    convert: Callable[[str], Any] = option.kind
    try:
        value = convert(text)
    except ValueError:
        value = None
    if value is None or not option.least <= value <= option.most:
        raise argparse.ArgumentTypeError(
            f"{text!r}: expected a number from {option.least:g} to {option.most:g}"
        )
    return value


def _address(chip: OnBus, text: str) -> int:
    try:
        address = int(text, 0)
    except ValueError:
        address = -1
    if address not in chip.addresses:
        raise argparse.ArgumentTypeError(
            f"{text!r}: expected an address of such a chip, "
            f"0x{min(chip.addresses):02x} to 0x{max(chip.addresses):02x}"
        )
    return address
