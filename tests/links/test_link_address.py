"""What `--link` says and may not say, and how the last frames leave by a way of it."""

import socket
from pathlib import Path
from threading import Thread

import pytest

from firmware_runtime.errors import ConfigError
from firmware_runtime.links.cut.address import End, link_address
from firmware_runtime.links.cut.channel import PathChannel

END = End("tachobot", "robot", has_hardware=True)


@pytest.mark.parametrize(
    "text",
    [
        *("", "ros3", "ros2:", "ros2:tachobot", "ros2:key=", "unix:"),
        *("udp:127.0.0.1:0", "udp:127.0.0.1:7400,listen=127.0.0.1:0"),
        "udp:127.0.0.1:7400,listen=127.0.0.1:7401,listen=127.0.0.1:7402",
    ],
)
def test_what_is_no_way_is_refused(text: str) -> None:
    with pytest.raises(ConfigError, match="expected"):
        link_address(text)


def test_ros_2_without_its_environment_is_refused_when_it_is_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FIRMWARE_RUNTIME_ROS_VENV", str(tmp_path))
    with pytest.raises(ConfigError, match="expected a venv with rclpy"):
        link_address("ros2")(END)


def test_a_key_for_ros_2_must_be_there(tmp_path: Path) -> None:
    with pytest.raises(ConfigError):
        link_address(f"ros2:key={tmp_path / 'none.key'}")


def test_a_path_at_which_there_is_no_socket_keeps_what_it_has(tmp_path: Path) -> None:
    path = tmp_path / "notes"
    path.write_text("mine", encoding="utf-8")
    link = tmp_path / "link"
    link.symlink_to(path)
    for taken in (path, link):
        with pytest.raises(ConfigError, match="no socket"):
            link_address(f"unix:{taken}")(END)
    assert link.is_symlink()
    assert path.read_text(encoding="utf-8") == "mine"


def test_a_path_in_no_folder_is_refused_and_no_folder_is_made(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="there is no folder"):
        link_address(f"unix:{tmp_path}/typo/link")(END)
    assert not (tmp_path / "typo").exists()


@pytest.mark.parametrize("kind", [socket.SOCK_STREAM, socket.SOCK_DGRAM])
def test_a_path_at_which_another_process_listens_is_left_to_it(tmp_path: Path, kind: int) -> None:
    path = tmp_path / "taken"
    with socket.socket(socket.AF_UNIX, kind) as taken:
        taken.bind(str(path))
        if kind == socket.SOCK_STREAM:
            taken.listen()
        with pytest.raises(ConfigError, match="another process listens there"):
            link_address(f"unix:{path}")(END)
        assert path.is_socket()
    link_address(f"unix:{path}")(END).close()
    assert not path.exists(), "one that is left behind is replaced, and removed at the end"


def test_a_send_finds_no_room_at_an_end_that_is_slow_but_the_last_ones_wait_for_some(
    tmp_path: Path,
) -> None:
    own = PathChannel(tmp_path / "a", tmp_path / "b")
    other = PathChannel(tmp_path / "b", tmp_path / "a")
    sent = 0
    while _finds_room(own):
        sent += 1
    own.linger()
    with pytest.raises(BlockingIOError):  # they wait 0.2 s at most
        own.send(b"bye")
    found: list[bytes] = []
    reader = Thread(target=_read, args=(other, sent + 1, found))
    reader.start()
    own.send(b"bye")
    reader.join()
    assert found[-1] == b"bye"
    own.close()
    other.close()


def _finds_room(channel: PathChannel) -> bool:
    try:
        channel.send(b"frame")
    except BlockingIOError:
        return False
    return True


def _read(channel: PathChannel, most: int, found: list[bytes]) -> None:
    while len(found) < most:
        if (frame := channel.receive()) is not None:
            found.append(frame)
