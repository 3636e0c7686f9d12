"""The one name that a value has: that of the atomic model's port which sent it.

What leaves a coupled model's port was sent by a port within it, and goes by that name in traces,
recordings and exports. The name of the coupled model's port means the same values.
"""

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import with_all_below
from firmware_runtime.devs.wiring import sources_of


class Senders:
    """The senders to every output port of a model's components, by path below the root."""

    def __init__(self, root: Component) -> None:
        below = len(root.path) + 1
        self._of = {
            port.path[below:]: tuple(
                dict.fromkeys(
                    source.path[below:]
                    for source in sources_of(port, root.in_ports.values())
                    if source.owner is not root
                )
            )
            for component in with_all_below(root)
            if component is not root
            for port in component.out_ports.values()
        }

    def of(self, path: str) -> tuple[str, ...]:
        """The ports of atomics that send what leaves this one; itself where it is none of these."""
        return self._of.get(path) or (path,)

    def carry(self, path: str, sent: str) -> bool:
        """Whether all that goes by the name `sent` leaves the port `path`, too."""
        return set(self.of(sent)) <= set(self.of(path))
