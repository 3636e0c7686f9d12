"""The trace: every message that leaves a port, with its instant and the port's path.

Built on listening, so a run without a trace pays nothing for it.
"""

from collections.abc import Callable, Iterable
from typing import Any, TypeAlias

from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.engine import Engine
from firmware_runtime.devs.ports import OutPort

Write: TypeAlias = Callable[[int, str, object], None]
"""Takes the instant in ns, the port's path below the root, and the value."""


def trace(simulator: Engine, write: Write, ports: Iterable[OutPort[Any]] | None = None) -> None:
    """Write what leaves these ports, or every output port of every atomic if none are named.

    Messages of one instant come in the order in which they were sent.
    """
    if ports is None:
        ports = (port for atomic in simulator.atomics for port in atomic.out_ports.values())
    for port in ports:
        _trace_port(simulator, port, write)


def _trace_port(simulator: Engine, port: OutPort[object], write: Write) -> None:
    path = below_root(port.path)
    simulator.listen(port, lambda at, value: write(at, path, value))
