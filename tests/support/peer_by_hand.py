"""A controller end of TachoBot, written from docs/wire.md alone: it imports nothing of links."""

import hmac
import secrets
import socket
import struct
from hashlib import sha256
from time import monotonic_ns

HEAD = struct.Struct(">4sBBHQQQqqqQQqQqQH")
ENTRY = struct.Struct(">HQQI")
HELLO, STEP, HEARTBEAT, BYE = 1, 2, 3, 4
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


def pack(value: object) -> bytes:
    """MessagePack, as far as a link takes it here."""
    match value:
        case bool() | None:
            return {None: b"\xc0", False: b"\xc2", True: b"\xc3"}[value]
        case float():
            return b"\xcb" + struct.pack(">d", value)
        case int() if 0 <= value < 128:
            return bytes([value])
        case str() if len(value) < 32:
            return bytes([0xA0 | len(value)]) + value.encode()
        case bytes():
            return b"\xc4" + bytes([len(value)]) + value
        case list():
            return bytes([0x90 | len(value)]) + b"".join(map(pack, value))
    raise TypeError(value)


def entry(port: int, sequence: int, after: int, values: list[object]) -> bytes:
    """What left by one port in a step."""
    body = pack(values)
    return ENTRY.pack(port, sequence, after, len(body)) + body


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
        body = entry(FORCES, self._steps, 0, [list(forces)])
        self._send(STEP, body, ports=1, origin=monotonic_ns(), step=self._steps)

    def end(self) -> None:
        self._send(BYE, pack(["done by hand", False, False]))

    def take(self) -> int:
        """Accept the next frame; its kind, or 0 if none comes soon."""
        try:
            frame = self.socket.recv(65536)
        except (TimeoutError, ConnectionRefusedError):
            return 0
        plain, tag = frame[:-32], frame[-32:]
        assert hmac.compare_digest(tag, hmac.digest(self._key, plain, "sha256"))
        _, kind, _, _, session, peer, counter, sent_at, *_ = HEAD.unpack(plain[: HEAD.size])
        if peer in {0, self._session}:
            self._accept(session, counter, sent_at)
        return int(kind)

    def _accept(self, session: int, counter: int, sent_at: int) -> None:
        if session != self._peer:
            self._peer, self._seen, self._seen_before = session, 0, 0
        if counter < self._seen:
            self._seen_before |= 1 << (self._seen - 1 - counter)
            return
        older = 1 << (counter - self._seen - 1) if self._seen else 0
        self._seen_before = (self._seen_before << (counter - self._seen) | older) % 2**64
        self._seen, self._echo, self._echo_at = counter, sent_at, monotonic_ns()

    def _send(
        self, kind: int, body: bytes, *, ports: int = 0, origin: int = 0, step: int = 0
    ) -> None:
        self._counter += 1
        now = monotonic_ns()
        held = now - self._echo_at if self._echo else 0
        accepted = (self._echo, held, self._seen, self._seen_before)
        head = (b"FWL3", kind, 0, ports, self._session, self._peer, self._counter, now)
        plain = HEAD.pack(*head, *accepted, origin, step, 0, 0, 0) + body
        self.socket.send(plain + hmac.digest(self._key, plain, "sha256"))
