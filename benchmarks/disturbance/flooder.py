"""Sends datagrams that no key has signed, at a steady rate: `HOST PORT RATE SECONDS`.

Prints how many were sent. Most are frames with a wrong tag; one in ten is noise, one in ten is cut
short, one in ten is larger than any frame.
"""

import json
import os
import socket
import sys
from random import Random
from time import monotonic, sleep

TICK_S = 0.005


def datagrams(seed: int) -> list[bytes]:
    """What is sent, over and over."""
    random = Random(seed)  # noqa: S311 -- to be repeated, not to be secret
    found = []
    for number in range(1000):
        frame = b"FWL1\x02" + bytes(3) + random.randbytes(8) + random.randbytes(150)
        found.append(
            {
                0: random.randbytes(random.randrange(200)),
                1: frame[: random.randrange(len(frame))],
                2: frame + bytes(8192),
            }.get(number % 10, frame)
        )
    return found


def main() -> None:
    """Send, a burst a tick, and make up for ticks that came late."""
    host, port, rate, seconds = sys.argv[1], *map(int, sys.argv[2:5])
    prepared = datagrams(seed=1)
    sent = refused = 0
    began = monotonic()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
        udp.connect((host, port))
        while (elapsed := monotonic() - began) < seconds:
            while sent + refused < elapsed * rate:
                try:
                    udp.send(prepared[sent % len(prepared)])
                    sent += 1
                except OSError:
                    refused += 1
            sleep(TICK_S)
    took = monotonic() - began
    report = {"sent": sent, "not_sent": refused, "a_second": round(sent / took), "pid": os.getpid()}
    print(json.dumps(report))


if __name__ == "__main__":
    main()
