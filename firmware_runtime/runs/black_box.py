"""The black box of a run: opened when its robot has been put together, before its chips are asked.

Imported only by runs that are recorded.
"""

import os
from collections.abc import Iterator
from pathlib import Path
from time import monotonic_ns
from typing import TYPE_CHECKING

from msgspec import to_builtins

from firmware_runtime.blackbox.header import FORMAT, Header
from firmware_runtime.blackbox.models import output_ports
from firmware_runtime.blackbox.ring import Ring
from firmware_runtime.blackbox.section import Kind, encode
from firmware_runtime.blackbox.size import size_for
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.executive.loop import Executive
from firmware_runtime.recording.code import code_of, digest_of
from firmware_runtime.system.conditions import system_conditions

if TYPE_CHECKING:
    from firmware_runtime.runs.session import Session


def open_black_box(session: "Session", path: Path) -> None:
    """Let what the session's recorder hears go into a new recording. Raises ConfigError."""
    recorder, executive = session.recorder, session.executive
    assert recorder is not None  # noqa: S101 -- only called for a run that has one
    size = size_for(session.board.loads.values(), session.board.settings.recording.minutes)
    ring = Ring(path, size.chunk_bytes, size.chunks, encoded_header(header_of(session)))
    recorder.open(
        ring,
        executive.simulator.atomics,
        None,
        lambda: counts_of(executive),
        is_real_time=isinstance(executive.clock, MonotonicClock),
    )
    executive.hooks.insert(0, recorder)


def header_of(session: "Session") -> Header:
    """What the recording says of itself."""
    board, executive, recorder = session.board, session.executive, session.recorder
    assert recorder is not None  # noqa: S101 -- as above
    end, simulator = session.end_of_board, executive.simulator
    own = [atomic for atomic in simulator.atomics if atomic in recorder.own]
    code, conditions = code_of(own), system_conditions()
    return Header(
        format=FORMAT,
        run=f"{board.name if end is None else end.name}-{monotonic_ns():x}-{os.getpid()}",
        board=board.name if end is None else end.name,
        kind=board.kind,
        fingerprint=board.fingerprint,
        source=str(board.source),
        table=dict(board.table),
        role=None if end is None else end.role,
        has_world=session.rig is not None,
        clock=type(executive.clock).__name__,
        speed=executive.clock.speed,
        lines=recorder.lines,
        early=recorder.early,
        ports=[below_root(port.path) for port in output_ports(simulator.atomics)],
        world=[below_root(each.path) for each in simulator.atomics if each not in recorder.own],
        code=code,
        code_sha256=digest_of(code),
        versions={
            "python": conditions["python"],
            "kernel": conditions["kernel"],
            **conditions["versions"],
        },
    )


def encoded_header(header: Header) -> bytes:
    """The section that begins each chunk."""
    return encode((Kind.HEADER.value, 0, [], [], [], [], [], [], [], to_builtins(header)))


def counts_of(executive: Executive) -> dict[str, dict[str, int]]:
    """What became of each model's activations so far, by path."""
    return {
        account.path: {
            "run": account.run,
            "skipped": account.skipped,
            "coalesced": account.coalesced,
            "overruns": account.overruns,
        }
        for account in executive.accounts
    }


def own_atomics(component: Component) -> Iterator[Atomic]:
    """The atomics of a robot, before a world is attached to it."""
    if isinstance(component, Atomic):
        yield component
    elif isinstance(component, Coupled):
        for each in component.components.values():
            yield from own_atomics(each)


def below_root(path: str) -> str:
    """A path without the name of the root model."""
    return path.partition(".")[2] or path
