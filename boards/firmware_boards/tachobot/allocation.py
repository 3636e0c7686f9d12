"""Three commands become four forces: equation (2) of the DoveR paper, inverted.

T maps the forces of the four pairs to the commands; its Moore-Penrose pseudo-inverse maps the
commands to the forces of least energy. What the pairs cannot give is taken from x and y first, so
that the robot keeps its yaw.

Source: Pecker Marcosig, Giribet, Castro: DEVS-over-ROS (DoveR), Winter Simulation Conference 2018.
"""

import math

from firmware_drivers.thrust_pairs import Forces

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.models.motion import Applied, Motion
from firmware_runtime.system.elementary import cos_sin

T = ((1.0, 0.0, -1.0, 0.0), (0.0, -1.0, 0.0, 1.0), (0.5, -0.5, 0.5, -0.5))
"""Rows x, y and yaw, a column a pair."""
T_PSEUDO_INVERSE = tuple(
    tuple(row[pair] / sum(each * each for each in row) for row in T) for pair in range(4)
)
"""The rows of T are at right angles to each other: so it is the transpose, each row of T divided
by its square. Without numpy, whose import takes longer than to switch all outputs off."""
_TURNS = tuple(row[2] for row in T_PSEUDO_INVERSE)
_LARGEST_YAW = max(map(abs, _TURNS))


class Allocation(Atomic):
    """Answers every yaw command with a force vector, at the same instant.

    waiting --yaw_n?--> sending (0) --forces!--> waiting

    Told that it does not move, it answers none until it is told that it may be tried again.
    `x_n` and `y_n` are forces in the fixed frame, N; they are turned into the body frame by the
    latest yaw and count as zero once older than `timeout` ns. What the pairs apply comes back at
    `pairs_applied`; at `position_applied` leaves what that leaves of x and y, which give way to
    yaw, where it has changed.
    """

    def __init__(self, name: str, pair_thrust_n: float, timeout: int) -> None:
        super().__init__(name)
        self.x_n = self.in_port("x_n", float)
        self.y_n = self.in_port("y_n", float)
        self.yaw_n = self.in_port("yaw_n", float)
        self.yaw = self.in_port("yaw", Motion)
        self.moves = self.in_port("moves", bool)
        self.pairs_applied = self.in_port("pairs_applied", Applied)
        self.forces_out = self.out_port("forces", Forces)
        self.position_applied = self.out_port("position_applied", Applied)
        self.pair_thrust_n = pair_thrust_n
        self.timeout = timeout
        self.forces = Forces(0.0, 0.0, 0.0, 0.0)
        self._by_pairs = Applied.ALL
        self._is_cut = False
        self._may_drive = True
        self._applied = self._sent = Applied.ALL
        self._yaw_rad = 0.0
        self._x = self._y = 0.0
        self._x_age = self._y_age = 0

    def output(self) -> None:
        """Send the forces, or what becomes of x and y."""
        if self.phase == "sending":
            self.forces_out.send(self.forces)
        if self._applied is not self._sent:
            self.position_applied.send(self._applied)

    def internal(self) -> None:
        """Wait for the next yaw command."""
        self._sent = self._applied
        self.passivate("waiting")

    def external(self, elapsed: int) -> None:
        """Keep what came; a yaw command is answered."""
        self._take_position_commands(elapsed)
        if self.yaw:
            self._yaw_rad = self.yaw[-1].position
        if self.pairs_applied:
            self._by_pairs = self.pairs_applied[-1]
        if self.moves:
            self._may_drive = self.moves[-1]
        is_asked = bool(self.yaw_n) and self._may_drive
        if is_asked:
            x, y = self._body_commands()
            self.forces, share = allocate(x, y, self.yaw_n[-1], self.pair_thrust_n)
            self._is_cut = share < 1.0
        by_pairs = self._by_pairs
        self._applied = min(by_pairs, Applied.PART) if self._is_cut else by_pairs
        if is_asked:
            self.activate("sending")
        elif self._applied is not self._sent:
            self.activate("passing")
        else:
            self.continue_(elapsed)

    def _take_position_commands(self, elapsed: int) -> None:
        self._x_age += elapsed
        self._y_age += elapsed
        if self.x_n:
            self._x, self._x_age = self.x_n[-1], 0
        if self.y_n:
            self._y, self._y_age = self.y_n[-1], 0

    def _body_commands(self) -> tuple[float, float]:
        x = self._x if self._x_age <= self.timeout else 0.0
        y = self._y if self._y_age <= self.timeout else 0.0
        if x == 0.0 == y:  # then there is nothing to turn
            return 0.0, 0.0
        cosine, sine = cos_sin(self._yaw_rad)
        return cosine * x + sine * y, cosine * y - sine * x


def allocate(x_n: float, y_n: float, yaw_n: float, pair_thrust_n: float) -> tuple[Forces, float]:
    """Forces for body commands in N, none beyond `pair_thrust_n`; x and y give way to yaw.

    And the share of x and y that is left.
    """
    largest_yaw = pair_thrust_n / _LARGEST_YAW
    if not -largest_yaw < yaw_n < largest_yaw:
        yaw_n = max(-largest_yaw, min(largest_yaw, yaw_n))
    if x_n == 0.0 == y_n:  # then there is nothing to share
        a, b, c, d = _TURNS
        return Forces(a * yaw_n + 0.0, b * yaw_n + 0.0, c * yaw_n + 0.0, d * yaw_n + 0.0), 1.0
    pairs = [(yaw * yaw_n, x * x_n + y * y_n) for x, y, yaw in T_PSEUDO_INVERSE]
    share = 1.0
    for turn, move in pairs:
        if abs(turn + move) > pair_thrust_n:
            room = pair_thrust_n - math.copysign(turn, turn * move)
            share = min(share, room / abs(move))
    return Forces(*[turn + share * move for turn, move in pairs]), share
