"""What serves at a path and is no server of doubles: an error of the bus, never anything else."""

from collections.abc import Iterator
from pathlib import Path
from socket import AF_UNIX, SOCK_SEQPACKET, socket
from threading import Thread

import pytest

from firmware_runtime.hal.served.connection import Connection
from firmware_runtime.hal.served.packets import Look
from firmware_runtime.hal.wire_errors import BusFault
from tests.support.waiting import PATIENCE_S


@pytest.fixture(params=[b"\xff\xfe", b"\x91" * 3000, b"{}"], ids=["bytes", "deep", "other"])
def impostor(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Path]:
    """Answers whatever it is asked with the same bytes."""
    path = tmp_path / "impostor"
    with socket(AF_UNIX, SOCK_SEQPACKET) as listening:
        listening.bind(str(path))
        listening.listen()

        def serve() -> None:
            connection, _ = listening.accept()
            with connection:
                connection.recv(4096)
                connection.send(request.param)

        thread = Thread(target=serve)
        thread.start()
        yield path
        thread.join()


def test_an_answer_that_is_none_is_an_error_of_the_bus(impostor: Path) -> None:
    connection = Connection(impostor, answer_s=PATIENCE_S)
    with pytest.raises(BusFault, match="i2c1 0x40"):
        connection.ask(Look(), "i2c1 0x40")
    connection.close()
