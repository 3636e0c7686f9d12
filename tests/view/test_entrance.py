"""Who may ask the page's server."""

from pathlib import Path

import pytest

from firmware_runtime.errors import ConfigError
from firmware_runtime.links.key_file import write_key
from firmware_runtime.live.entrance import COOKIE, Entrance

OWN = {"Host": "127.0.0.1:8765"}
OWN_PAGE = {**OWN, "Origin": "http://127.0.0.1:8765"}


@pytest.fixture
def entrance() -> Entrance:
    return Entrance("127.0.0.1", 8765)


@pytest.mark.parametrize(
    "headers",
    [
        {},
        {"Host": "evil.example:8765"},
        {"Host": "127.0.0.1:9999"},
        {"Host": "127.0.0.1"},
        {"Host": "127.0.0.1:8765@evil.example"},
        {"Host": "[::1"},
        {**OWN, "Origin": "http://evil.example"},
        {**OWN, "Origin": "null"},
        {**OWN, "Origin": "http://127.0.0.1:8766"},
        {**OWN, "Origin": "file://127.0.0.1:8765"},
        {**OWN, "Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "no-cors"},
    ],
)
@pytest.mark.parametrize("method", ["GET", "POST"])
def test_requests_of_others_are_refused(
    entrance: Entrance, headers: dict[str, str], method: str
) -> None:
    assert entrance.why_not(method, headers, {}) is not None


@pytest.mark.parametrize("host", ["127.0.0.1:8765", "localhost:8765", "[::1]:8765"])
def test_its_own_page_may_ask(entrance: Entrance, host: str) -> None:
    headers = {"Host": host, "Origin": f"http://{host}", "Sec-Fetch-Site": "same-origin"}
    assert entrance.why_not("GET", {"Host": host}, {}) is None
    assert entrance.why_not("POST", headers, {}) is None


def test_a_change_must_say_where_it_comes_from(entrance: Entrance) -> None:
    assert entrance.why_not("POST", OWN, {}) == "no origin"


def test_a_link_from_elsewhere_may_lead_here(entrance: Entrance) -> None:
    headers = {**OWN, "Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate"}
    assert entrance.why_not("GET", headers, {}) is None


def test_elsewhere_than_on_loopback_it_takes_a_token() -> None:
    for address in ("0.0.0.0", "192.168.0.7", "robot.local"):  # noqa: S104 -- refused
        with pytest.raises(ConfigError, match="token-file"):
            Entrance(address, 8765)


def test_with_a_token_nobody_may_ask_without_it(tmp_path: Path) -> None:
    key = tmp_path / "key"
    write_key(key)
    entrance = Entrance("0.0.0.0", 8765, key)  # noqa: S104 -- with a token
    token = key.read_bytes().hex()
    assert entrance.why_not("GET", OWN, {}) == "no token"
    assert entrance.why_not("GET", OWN, {COOKIE: "0" * 64}) == "no token"
    assert entrance.why_not("GET", OWN, {COOKIE: token}) is None
    assert entrance.why_not("GET", {**OWN, "Authorization": f"Bearer {token}"}, {}) is None
    assert entrance.why_not("POST", OWN_PAGE, {COOKIE: token}) is None


def test_a_token_that_others_can_read_is_refused(tmp_path: Path) -> None:
    key = tmp_path / "key"
    write_key(key)
    key.chmod(0o644)
    with pytest.raises(ConfigError, match=r"0600|others|mode"):
        Entrance("127.0.0.1", 8765, key)
