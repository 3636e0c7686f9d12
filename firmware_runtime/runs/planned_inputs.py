"""Values for input ports of a model at instants that are known before the run."""

from typing import TYPE_CHECKING

from msgspec import Raw, Struct

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.executive import Executive

if TYPE_CHECKING:
    from firmware_runtime.links.ports.ports import Ports


class PlannedInput(Struct, frozen=True):
    """One value for one port, as the command line has it."""

    at: int
    port: str
    value: bytes
    """In JSON."""

    def __str__(self) -> str:
        return f"{self.at / SECOND}:{self.port}={self.value.decode()}"


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


def plan_inputs(
    executive: Executive, model: Component, name: str, inputs: list[PlannedInput], end: int
) -> None:
    """Let them arrive at the model when they are due. Raises ConfigError for one that cannot."""
    if not inputs:
        return
    from firmware_runtime.links.ports.ports import Ports  # noqa: PLC0415 -- of few runs

    ports = Ports(model)
    if faults := [*inputs_after(end, inputs), *inputs_refused(ports, inputs)]:
        raise ConfigError(name, faults)
    for each in inputs:
        executive.plan(each.at, *ports.arrival(each.port, Raw(each.value)))
