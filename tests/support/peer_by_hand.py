"""A controller end of TachoBot, written from docs/wire.md alone: it imports nothing of links."""

import secrets
import socket
from hashlib import sha256
from time import monotonic_ns

from tests.support.hostile.frames import (
    BYE,
    HELLO,
    STEP,
    Entry,
    Fields,
    fields_of,
    frame,
    pack,
    step,
    tag,
)

VECTOR = "tuple([float, float, float])"
INERTIAL_SAMPLE = (
    f'InertialSample({{"acceleration": {VECTOR}, "rate": {VECTOR}, "field": {VECTOR} | null, '
    '"temperature_c": float, "field_overflow": bool})'
)
PORTS = (
    'controller.forces Forces({"f1": float, "f2": float, "f3": float, "f4": float})',
    f"imu.sample {INERTIAL_SAMPLE}",
    'thrust_pairs.applied Applied("NOTHING" | "PART" | "ALL")',
)
FORCES = 0


class PeerByHand:
    """Greets, says what it has accepted, and commands forces."""

    def __init__(self, port: int, key: bytes) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.connect(("127.0.0.1", port))
        self.digest = sha256("\n".join(PORTS).encode()).digest()
        self._key = key
        self._session, self._peer = secrets.randbits(63) + 1, 0
        self._counter = self._seen = self._seen_before = self._echo = self._echo_at = 0
        self._steps = 0

    def greet(self) -> None:
        greeting = [self.digest, [FORCES], "tachobot", "controller", "by hand", 0, False]
        self._send(HELLO, pack(greeting))

    def command(self, *forces: float) -> None:
        """One step, in which forces left, in N."""
        self._steps += 1
        body = step(Entry(FORCES, self._steps, 0, pack([list(forces)])))
        self._send(STEP, body, ports=1, origin=monotonic_ns(), step=self._steps)

    def end(self) -> None:
        self._send(BYE, pack(["done by hand", False, False]))

    def take(self) -> int:
        """Accept the next frame; its kind, or 0 if none comes soon."""
        try:
            datagram = self.socket.recv(65536)
        except (TimeoutError, ConnectionRefusedError):
            return 0
        assert datagram[-32:] == tag(datagram[:-32], self._key)
        fields = fields_of(datagram[:-32])
        assert fields is not None
        if fields.peer in {0, self._session}:
            self._accept(fields.session, fields.counter, fields.sent_at)
        return fields.kind

    def _accept(self, session: int, counter: int, sent_at: int) -> None:
        if session != self._peer:
            self._peer, self._seen, self._seen_before = session, 0, 0
        if counter < self._seen:
            self._seen_before |= 1 << (self._seen - 1 - counter)
            return
        older = 1 << (counter - self._seen - 1) if self._seen else 0
        self._seen_before = (self._seen_before << (counter - self._seen) | older) % 2**64
        self._seen, self._echo, self._echo_at = counter, sent_at, monotonic_ns()

    def _send(self, kind: int, body: bytes, **of_step: int) -> None:
        self._counter += 1
        now = monotonic_ns()
        held = now - self._echo_at if self._echo else 0
        accepted = (self._echo, held, self._seen, self._seen_before)
        head = (kind, self._session, self._peer, self._counter, now, *accepted)
        self.socket.send(frame(Fields(*head, body=body)._replace(**of_step), self._key))  # type: ignore[arg-type]
