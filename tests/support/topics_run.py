"""A run of a model that answers every value it is sent, with its ports on a socket.

python -m tests.support.topics_run STATISTICS
"""

import sys
from pathlib import Path

from firmware_drivers.differential_drive import Velocity

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import NEVER
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.executive import Executive
from firmware_runtime.links.ports.ports import Ports
from firmware_runtime.links.ports.run_socket import RunSocket
from firmware_runtime.models.motion import Motion
from firmware_runtime.statistics.paths import Companion


class Echo(Atomic):
    """Sends what comes out again, at the same instant and in the same order."""

    def __init__(self) -> None:
        super().__init__("echo")
        self.say = self.in_port("say", float)
        self.drive = self.in_port("drive", Velocity)
        self.place = self.in_port("place", Motion)
        self.said = self.out_port("said", float)
        self.drives = self.out_port("drives", Velocity)
        self.places = self.out_port("places", Motion)
        self.count_out = self.out_port("count", int)
        self.count = 0
        self._kept: tuple[list[float], list[Velocity], list[Motion]] = ([], [], [])

    def output(self) -> None:
        """Send all that came, and how many of them there were so far."""
        said, drives, places = self._kept
        for number in said:
            self.said.send(number)
        for drive in drives:
            self.drives.send(drive)
        for place in places:
            self.places.send(place)
        self.count_out.send(self.count)

    def internal(self) -> None:
        """Wait for more."""
        self.passivate("waiting")

    def external(self, elapsed: int) -> None:  # noqa: ARG002 -- all is answered at once
        """Keep what came."""
        self._kept = (list(self.say), list(self.drive), list(self.place))
        self.count += sum(len(each) for each in (self.say, self.drive, self.place))
        self.activate("answering")


class EchoRobot(Coupled):
    """The echo, with its input ports at the top."""

    def __init__(self) -> None:
        super().__init__("parrot")
        echo = self.add(Echo())
        self.couple(self.in_port("say", float), echo.say)
        self.couple(self.in_port("drive", Velocity), echo.drive)
        self.couple(self.in_port("place", Motion), echo.place)


def main(path: Path) -> None:
    """Run until it is killed."""
    model = EchoRobot()
    configuration = Configuration(statistics_path=path)
    executive = Executive(model, MonotonicClock(), list, configuration)
    RunSocket(Companion.SOCKET.beside(path), executive, Ports(model))
    executive.run(NEVER)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
