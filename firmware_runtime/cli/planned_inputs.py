"""`run --input SECONDS:PORT=VALUE`: values for input ports of the model at known instants."""

import argparse
from math import isfinite
from typing import TYPE_CHECKING

from msgspec import Raw, Struct, json

from firmware_runtime.cli.words import is_json
from firmware_runtime.devs.time import SECOND, seconds
from firmware_runtime.errors import ConfigError
from firmware_runtime.runs.session import Session

if TYPE_CHECKING:
    from firmware_runtime.links.ports.ports import Ports

EXPECTED = "expected SECONDS:PORT=VALUE, such as 2.5:target=1.0"


class PlannedInput(Struct, frozen=True):
    """One value for one port, as the command line has it."""

    at: int
    port: str
    value: bytes
    """In JSON."""

    def __str__(self) -> str:
        return f"{self.at / SECOND}:{self.port}={self.value.decode()}"


def add_input_option(verb: argparse.ArgumentParser) -> None:
    """Add --input."""
    verb.add_argument(
        "--input",
        type=planned_input,
        action="append",
        default=[],
        metavar="SECONDS:PORT=VALUE",
        dest="inputs",
        help="put a value, JSON or the name of an enumeration's member, into an input port of the "
        "model at that second of the run; may be repeated",
    )


def planned_input(text: str) -> PlannedInput:
    """One word of the command line."""
    when, _, what = text.partition(":")
    port, _, value = what.partition("=")
    try:
        at_s = float(when)
    except ValueError:
        at_s = -1.0
    if not (isfinite(at_s) and 0 <= at_s <= 1e9 and port and value):
        raise argparse.ArgumentTypeError(f"{text!r}: {EXPECTED}")
    content = value.encode() if is_json(value) else json.encode(value)
    return PlannedInput(0 if at_s == 0 else seconds(at_s), port, content)


def inputs_after(end: int, inputs: list[PlannedInput]) -> list[str]:
    """A sentence for each that a run which ends then would never see."""
    return [
        f"--input {each}: the run ends at {end / SECOND:g} s; expected an earlier second"
        for each in inputs
        if each.at > end
    ]


def inputs_refused(ports: "Ports", inputs: list[PlannedInput]) -> list[str]:
    """A sentence for each that no input port of the model takes."""
    from firmware_runtime.links.ports.datagrams import Refusal  # noqa: PLC0415 -- of few runs

    faults = []
    for each in inputs:
        try:
            ports.arrival(each.port, Raw(each.value))
        except Refusal as why:
            faults.append(f"--input: {why}")
    return faults


def plan_inputs(session: Session, inputs: list[PlannedInput], end: int) -> None:
    """Let them arrive when they are due. Raises ConfigError for one that cannot arrive."""
    if not inputs:
        return
    from firmware_runtime.links.ports.ports import Ports  # noqa: PLC0415 -- of few runs

    ports = Ports(session.robot.model)
    if faults := [*inputs_after(end, inputs), *inputs_refused(ports, inputs)]:
        raise ConfigError(session.board.name, faults)
    for each in inputs:
        session.executive.plan(each.at, *ports.arrival(each.port, Raw(each.value)))
