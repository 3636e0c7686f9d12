"""docs/wire.md suffices to write an end: its vectors are made anew, and a robot's end is driven."""

import re
import signal
from contextlib import closing
from pathlib import Path

import pytest

from firmware_runtime.links.key_file import write_key
from tests.support.hostile.frames import BYE, HELLO, STEP, Entry, Fields, frame, pack, step
from tests.support.linked_runs import free_port, linked
from tests.support.peer_by_hand import PeerByHand
from tests.support.waiting import wait_until

PAGE = Path(__file__).parents[2] / "docs/wire.md"
ONE, TWO = 0x1111111111111111, 0x2222222222222222
VECTORS = {
    "hello": Fields(
        *(HELLO, ONE, 0, 1, 10**9),
        body=pack([bytes(32), [1], "tachobot", "robot", "boot", 0, False]),
    ),
    "step": Fields(
        *(STEP, ONE, TWO, 7, 1_500_000_000),
        *(1_400_000_000, 250_000, 9, 0b11),
        *(1_499_900_000, 3, 1_499_800_000, 2, 1),
        ports=2,
        body=step(Entry(1, 3, 0, pack([[0.5, -1.25]])), Entry(4, 2, 1, pack(["stop", "turn"]))),
    ),
    "step, signed": Fields(
        *(STEP, ONE, TWO, 8, 1_600_000_000),
        origin=1_600_000_000,
        step=4,
        ports=1,
        body=step(Entry(0, 1, 0, pack([1.0]))),
    ),
    "bye": Fields(BYE, ONE, TWO, 9, 1_700_000_000, body=pack(["SIGTERM", False, False])),
}


@pytest.mark.parametrize("name", VECTORS)
def test_a_vector_of_the_page_is_what_its_words_make(name: str) -> None:
    found = re.search(rf"^{name}:\n\n((?:    [0-9a-f ]+\n)+)", PAGE.read_text(), re.MULTILINE)
    assert found is not None
    key = bytes(range(32)) if "signed" in name else None
    assert bytes.fromhex(found[1]) == frame(VECTORS[name], key)


@pytest.mark.slow
@pytest.mark.real_time
def test_an_end_written_from_the_page_arms_and_drives_a_robot(tmp_path: Path) -> None:
    key, port = tmp_path / "link.key", free_port()
    write_key(key)
    with linked(tmp_path, "tachobot", f"udp:127.0.0.1:{port},key={key}") as runs:
        robot = runs.robot("--for", "600", "--set", "imu.calibration_s=0.1")
        peer = PeerByHand(port, key.read_bytes())
        with closing(peer.socket):
            peer.socket.settimeout(0.05)
            commanded = 0

            def drives() -> bool:
                nonlocal commanded
                kind = peer.take()
                if kind in {0, HELLO}:
                    peer.greet()
                elif kind == STEP:
                    peer.command(0.1, -0.1, 0.1, -0.1)
                    commanded += robot.is_armed
                return commanded >= 100

            wait_until(drives, "a hundred commands while the robot is armed")
            peer.end()
            robot.wait_until_armed(armed=False)
        robot.process.send_signal(signal.SIGTERM)
        ended = robot.report()
    refused = {reason: count for reason, count in ended["link"]["refused"].items() if count > 0}
    assert refused.keys() <= {"too_old"}, "and that on a busy machine alone"
    assert ended["link"]["received"] + sum(refused.values()) >= 100
    assert ended["result"]["yaw_rad"] != 0.0
    assert ended["outputs_on"] == {"thrust_pairs": 0}
    assert "armed" in ended["said"]
    assert "disarmed: the controller has ended: done by hand" in ended["said"]
