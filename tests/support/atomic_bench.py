"""One atomic model alone in virtual time, fed by hand."""

from typing import Any

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.hal.wire_errors import Fault


class AtomicBench:
    """Runs a model in checked mode and keeps what it said, by port, with the instant in ms."""

    def __init__(self, model: Atomic) -> None:
        self.model = model
        self.simulator = Simulator(model, checked=True)
        self.said: dict[str, list[tuple[float, Any]]] = {}
        for name, port in model.out_ports.items():
            said = self.said[name] = []
            self.simulator.listen(
                port,
                lambda at, value, said=said: said.append((at / MILLISECOND, value)),  # type: ignore[misc]
            )

    def run(self, until_ms: float) -> None:
        self.simulator.run(round(until_ms * MILLISECOND))

    def put(self, at_ms: float, **values: object) -> None:
        """Put values into input ports, after all that is due by then."""
        self.run(at_ms)
        self._inject(round(at_ms * MILLISECOND), values)

    def collide(self, at_ms: float, **values: object) -> None:
        """Put values into input ports at the very instant an internal event is due."""
        self.simulator.run(round(at_ms * MILLISECOND) - 1)
        assert self.simulator.next_at == round(at_ms * MILLISECOND)
        self.meet(at_ms, **values)

    def meet(self, at_ms: float, **values: object) -> None:
        """Put values into input ports together with what is due at that instant, if anything is."""
        at = round(at_ms * MILLISECOND)
        self.simulator.run(max(self.simulator.now, at - 1))
        self._inject(at, values)

    def values(self, port: str) -> list[Any]:
        return [value for _, value in self.said[port]]

    @property
    def faults(self) -> list[Fault]:
        return self.values("fault")

    def _inject(self, at: int, values: dict[str, object]) -> None:
        for name, value in values.items():
            self.simulator.inject(self.model.in_ports[name], value)
        self.simulator.advance(at)
