"""The page's server on a recording: what it answers, to whom, and what it makes of nonsense."""

import asyncio
import json
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import aiohttp
import pytest

from firmware_runtime.live.source import Source
from firmware_runtime.live.viewer import LONGEST
from firmware_runtime.runs.session import Session
from sim_doubles.faults import FaultScript, NackAddress
from tests.support.command import Command
from tests.support.recorded import record
from tests.support.served_page import ServedPage, served_page
from tests.support.waiting import PATIENCE_S

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("run") / "tachobot.recording", "tachobot", 1.5)


@pytest.fixture(scope="module")
def page(recording: Path) -> Iterator[ServedPage]:
    with served_page(recording) as served:
        yield served


def test_the_page_holds_all_that_draws_it(page: ServedPage) -> None:
    answer = page.ask("/")
    assert answer.status == 200
    assert answer.headers["Content-Type"] == "text/html; charset=utf-8"
    assert b"connect-src 'self'" in answer.content
    assert answer.headers["X-Frame-Options"] == "DENY"


def test_the_state_says_what_programs_ask_for(page: ServedPage) -> None:
    state = page.said("/api/state")
    assert state["board"] == "tachobot"
    assert state["state"] == "recording"
    assert state["armed"] is None
    assert state["faults"] == []
    assert state["outputs"] == {"thrust_pairs": "NOTHING"}


def test_a_recording_says_what_went_wrong_and_how_punctual_it_was(tmp_path: Path) -> None:
    path = record(tmp_path / "tachobot.recording", "tachobot", 1.2, before=_without_imu)
    with served_page(path) as page:
        page.said("/api/model")
        state = page.said("/api/state")
        assert {each["model"] for each in state["faults"]} == {"imu"}
        assert state["faults"][0]["first_s"] >= 0.0
        assert "virtual time" in state["punctual"]
        assert page.said("/api/report")["title"].endswith("timing report")


def _without_imu(session: Session) -> None:
    """From the start, nothing answers at the IMU's address."""
    rig: Any = session.hardware.rig
    rig.buses["i2c1"].faults = FaultScript([NackAddress(address=0x68, times=None)])


def test_the_model_has_its_ports_and_what_is_plotted_first(page: ServedPage) -> None:
    model = page.said("/api/model")
    assert {"path": "controller.yaw.command_n", "type": "float"} in model["ports"]
    assert model["diagram"]["kind"] == "diagram"
    assert 'data-model="imu"' in model["diagram"]["svg"]
    assert set(model["shown"]) <= set(model["leaves"])
    assert not model["is_live"]


def test_a_stretch_of_curves(page: ServedPage) -> None:
    found = page.said("/api/range?from=0.9&until=1.1&leaf=world.yaw_rad&leaf=no.such")
    times, values = found["points"]["world.yaw_rad"]
    assert len(times) == len(values) >= 20
    assert found["points"].keys() == {"world.yaw_rad"}


@pytest.mark.parametrize(
    ("path", "content", "status"),
    [
        ("/api/no-such", None, 404),
        ("/api/set", b"{}", 409),
        ("/api/disarm", b"{}", 409),
        ("/api/arm", b"{}", 409),
        ("/api/disarm", b"[", 400),
        ("/api/disarm", b"[1]", 400),
        ("/api/disarm", b"\xff\xfe", 400),
        ("/api/disarm", b"[" * 20_000, 400),
        ("/api/range?from=nan", None, 409),
        ("/api/range?from=x", None, 409),
        ("/api/export?begin_s=0&end_s=1e300&ending=csv", None, 200),
        ("/api/export?begin_s=1e300&end_s=1e300&ending=csv", None, 409),
        (f'/api/board-file?values={{"a":{"[" * 2000}{"]" * 2000}}}', None, 409),
        ("/no/such", None, 404),
        ("/../../etc/passwd", None, 404),
    ],
)
def test_nonsense_is_refused(
    page: ServedPage, path: str, content: bytes | None, status: int
) -> None:
    assert page.ask(path, content).status == status


def test_a_change_is_no_matter_of_looking(page: ServedPage) -> None:
    for name in ("arm", "disarm", "safe-state", "set"):
        assert page.ask(f"/api/{name}").status == 404


@pytest.mark.parametrize(
    "headers", [{"Origin": "http://evil.example"}, {"Host": "evil.example"}, {"Origin": "null"}]
)
def test_other_pages_get_nothing(page: ServedPage, headers: dict[str, str]) -> None:
    for path in ("/", "/api/state", "/api/model", "/ws"):
        answer = page.ask(path, headers=headers)
        assert answer.status == 403
        assert b"tachobot" not in answer.content
    assert page.ask("/api/disarm", b"{}", headers).status == 403
    assert page.ask("/api/disarm", b"{}", {}).status == 403


def test_a_viewer_gets_the_curves_that_it_asks_for(page: ServedPage) -> None:
    frame = asyncio.run(_first_frame(page, '{"watch": ["world.yaw_rad", "no.such"]}'))
    times, _ = frame["points"]["world.yaw_rad"]
    assert times == sorted(times)
    assert len(times) > 50


@asynccontextmanager
async def _socket(page: ServedPage) -> AsyncIterator[aiohttp.ClientWebSocketResponse]:
    """The socket of a viewer."""
    async with (
        asyncio.timeout(PATIENCE_S),
        aiohttp.ClientSession() as session,
        session.ws_connect(f"{page.address}/ws", origin=page.address) as socket,
    ):
        yield socket


async def _first_frame(page: ServedPage, watch: str) -> dict[str, Any]:
    async with _socket(page) as socket:
        await socket.send_str(watch)
        while True:
            frame: dict[str, Any] = json.loads(await socket.receive_str())
            if frame.get("points"):
                return frame


@pytest.mark.parametrize(
    "said", ["", "{", '{"watch": 1}', '{"other": []}', '{"watch": [1]}', "x" * (LONGEST + 1), b"\0"]
)
def test_a_viewer_that_talks_nonsense_is_sent_away(page: ServedPage, said: str | bytes) -> None:
    assert asyncio.run(_sent_away(page, said)) in {1008, 1009}
    assert page.ask("/api/state").status == 200


async def _sent_away(page: ServedPage, said: str | bytes) -> int | None:
    async with _socket(page) as socket:
        await (socket.send_str(said) if isinstance(said, str) else socket.send_bytes(said))
        async for _ in socket:
            pass
        return socket.close_code


def test_what_cannot_be_viewed_is_refused_in_a_sentence(command: Command, tmp_path: Path) -> None:
    assert "no file, and no run" in command.refused("view", "nothing-of-this-name")
    (tmp_path / "x").write_bytes(b"nothing")
    assert "not a recording" in command.refused("view", tmp_path / "x")
    assert "from 0 to 65535" in command.refused("view", tmp_path / "x", "--port", "70000")


def test_an_address_for_others_takes_a_token(command: Command, recording: Path) -> None:
    said = command.refused("view", recording, "--address", "0.0.0.0", "--no-browser")  # noqa: S104
    assert "--token-file" in said


def test_other_gains_are_tried_on_a_recording(page: ServedPage) -> None:
    sliders = {each["key"]: each for each in page.said("/api/sliders")}
    key = "controller.yaw.kp"
    values = {key: sliders[key]["value"] * 1.5}
    tried = page.ask("/api/try", json.dumps({"values": values}).encode()).document
    assert '"kind": "series"' in json.dumps(tried)
    assert page.ask("/api/try", b'{"values": {"no.such": 1}}').status == 409
    assert page.ask("/api/set", json.dumps({"values": values}).encode()).status == 409


def test_a_world_that_cannot_be_drawn_is_said(
    recording: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object) -> None:
        raise KeyError("wheel")

    monkeypatch.setattr("firmware_runtime.live.source.rig_for", broken)
    with Source(recording, None, is_live=False) as source:
        model = source.model()
    assert model["plane"] is None
    assert model["no_world"] == "no world is drawn: the rig of tachobot: KeyError: 'wheel'"


def test_a_viewer_gets_nothing_more_where_nothing_is_new(page: ServedPage) -> None:
    async def frames() -> list[dict[str, Any]]:
        async with _socket(page) as socket:
            await socket.send_str('{"watch": ["world.yaw_rad"]}')
            found: list[dict[str, Any]] = []
            while not found or not found[-1].get("points"):
                found.append(json.loads(await socket.receive_str()))
            with pytest.raises(TimeoutError):
                await socket.receive_str(timeout=0.3)
            return found

    assert len(asyncio.run(frames())) <= 2
