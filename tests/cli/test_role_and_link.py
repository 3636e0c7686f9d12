"""`run --role --link`: what cannot be is refused in a sentence, before anything is opened."""

from pathlib import Path

import pytest

import firmware_runtime
from firmware_runtime.cli.main import main
from firmware_runtime.errors import ConfigError
from firmware_runtime.links.cut.refusal import Reason
from firmware_runtime.links.key_file import write_key
from firmware_runtime.runs import end_link as linking


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--role pilot --link unix:{0}/link", "pilot: this board has no such role"),
        ("--role robot", "--role and --link belong together"),
        ("--link unix:{0}/link", "--role and --link belong together"),
        ("--role robot --link tcp:1.2.3.4:5", "expected unix:PATH"),
        ("--role robot --link unix:", "expected unix:PATH"),
        ("--role robot --link unix:{0}/" + "x" * 120, "90 bytes at most"),
        ("--role robot --link udp:10.1.2.3:7400", "can be reached from elsewhere"),
        ("--role robot --link udp:127.0.0.1:7400,listen=0.0.0.0:1", "reached from elsewhere"),
        ("--role robot --link udp:127.0.0.1:7400,kye=x", "'kye'"),
        ("--role robot --link udp:127.0.0.1:7400,key={0}/none", "No such file"),
        ("--role robot --link udp:127.0.0.1:7400,key={0}/open", "opens it to others"),
        ("--role robot --link udp:127.0.0.1", "expected ADDRESS:PORT"),
        ("--role controller --link unix:{0}/link --doubles", "--doubles: role controller"),
        ("--role controller --link unix:{0}/link --arm", "--arm: role controller"),
        ("--role robot --link unix:{0}/link --doubles --clock virtual", "real time"),
    ],
)
def test_it_is_refused(
    words: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_key(tmp_path / "open")
    (tmp_path / "open").chmod(0o644)
    status = 0
    try:
        status = main(["run", "tachobot", *words.format(tmp_path).split()])
    except SystemExit as end:
        status = int(end.code or 0)
    assert status == 2
    assert said in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.real_time
@pytest.mark.parametrize("words", ["--role controller", "--role robot --doubles"])
def test_an_end_that_met_no_other_has_failed(
    words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    link = ["--link", f"unix:{tmp_path}/link", "--statistics", f"{tmp_path}/run.stats"]
    assert main(["run", "tachobot", *words.split(), *link, "--for", "0.3"]) == 1
    assert "link was never ready: it has met no other end" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("refused", "said"),
    [
        ({}, ": nothing came; expected an end that is there, with the same key if there is one"),
        ({Reason.FORGED: 3}, ": 3 datagrams came, and none was authentic: signed with another key"),
        (
            {Reason.FORGED: 1, Reason.OTHER_CUT: 2},
            ": 3 datagrams came, and all were refused (forged 1, other_cut 2)",
        ),
    ],
)
def test_an_end_that_met_no_other_says_what_came_all_the_same(
    refused: dict[Reason, int], said: str
) -> None:
    assert linking._came(refused).startswith(said)


def test_a_controller_runs_alone_in_virtual_time_for_what_is_fed_by_a_program() -> None:
    with firmware_runtime.open_board("tachobot", role="controller", clock="virtual") as robot:
        assert robot.outputs is None
        assert [*robot.model.components] == ["controller"]
        assert robot.run(1.0).statistics.link is None
    with pytest.raises(ConfigError, match="doubles: role controller has no hardware"):
        firmware_runtime.open_board("tachobot", role="controller", doubles=True)


def test_an_end_with_hardware_is_refused_without_a_link() -> None:
    with pytest.raises(ConfigError, match="drives nothing without a controller"):
        firmware_runtime.open_board("tachobot", role="robot", doubles=True, clock="virtual")


def test_one_path_has_one_listener(tmp_path: Path) -> None:
    link = f"unix:{tmp_path}/link"
    with firmware_runtime.open_board("tachobot", role="robot", link=link, doubles=True) as robot:
        assert robot.armed is False
        with pytest.raises(ConfigError, match="another process listens"):
            firmware_runtime.open_board("tachobot", role="robot", link=link, doubles=True)
