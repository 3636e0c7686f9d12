"""Completion: what may come next, and that real shells ask for it."""

import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.cli.commands.completion import SCRIPTS, candidates
from firmware_runtime.cli.main import VERBS, parser
from tests.support.waiting import PATIENCE_S

PROGRAM = Path(sys.executable).with_name("firmware-runtime")


INSTALLED = [shell for shell in SCRIPTS if shutil.which(shell)]
"""Bash at least; on a machine that has zsh and fish, these too."""


def ways_on(*words: str) -> list[str]:
    return candidates(words, VERBS, parser)


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("ru",), ["run"]),
        (("run", "tacho"), ["tachobot"]),
        (("run", "tachobot", "--cl"), ["--clock"]),
        (("run", "tachobot", "--clock", "v"), ["virtual"]),
        (("run", "tachobot", "--for", ""), []),
        (("run", "tachobot", "--clock", "virtual", "--doub"), ["--doubles"]),
        (("run", "--doubles", "det"), ["detective"]),
        (("export", "det"), ["detective"]),
        (("import", "x.ma", "--out"), ["--output"]),
        (("check", "tachobot", "--set", "controller.yaw.kp"), ["controller.yaw.kp="]),
        (("check", "nobot", "--set", "controller"), []),
        (("service", "st"), ["status"]),
        (("service", "logs", "det"), ["detective"]),
        (("service", "logs", "--fol"), ["--follow"]),
        (("doubles", "serve", "--chip", "pca"), ["pca9685"]),
        (("doubles", "re"), ["replay"]),
        (("doubles", "replay", "tacho"), ["tachobot"]),
        (("doubles", "replay", "tachobot", "--war"), ["--warn"]),
        (("try", "ads"), ["ads1115"]),
        (("new", "ch"), ["chip"]),
        (("bench", "dev"), ["devstone"]),
        (("experiment", "embedded"), ["embedded-step-friction"]),
        (("experiment", "al"), ["all"]),
        (("sweep", "sh"), ["show"]),
        (("sweep", "tachobot", "--vary", "world.ma"), ["world.mass_kg="]),
        (("experiment", "all", "tacho"), ["tachobot"]),
        (("gate", "main", ".", "tacho"), ["tachobot"]),
        (("gate", "main", ".", "--tol"), ["--tolerance"]),
        (("completion", "z"), ["zsh"]),
        (("--ver",), ["--version"]),
        (("nonsense", ""), []),
    ],
    ids=" ".join,
)
def test_what_may_come_next(words: tuple[str, ...], expected: list[str]) -> None:
    assert ways_on(*words) == expected


def test_every_verb_is_offered_and_has_its_options() -> None:
    assert ways_on("") == list(VERBS)
    for verb in VERBS:
        assert "--help" in ways_on(verb, "--")


def test_two_dashes_that_are_being_typed_are_a_word(command: Callable[..., Any]) -> None:
    offered = command("completion", "bash", "--", "run", "tachobot", "--").out.splitlines()
    assert offered == ways_on("run", "tachobot", "--")


@pytest.mark.parametrize("shell", SCRIPTS)
def test_the_script_is_printed(command: Callable[..., Any], shell: str) -> None:
    ended = command("completion", shell)
    assert (ended.status, ended.out) == (0, SCRIPTS[shell])


ASK_BASH = """
source <("$1" completion bash)
complete -p firmware-runtime
shift; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1))
_firmware_runtime
printf '%s\\n' "${COMPREPLY[@]}"
"""
ASK_ZSH = """
autoload -Uz compinit; compinit -u -D
source <("$1" completion zsh)
print -r -- ${_comps[firmware-runtime]}
shift; words=("$@"); CURRENT=$#
_files() { print files; }
compadd() { print -rl -- "${@:#--}"; }
_firmware_runtime
"""
ASK_FISH = """
$argv[1] completion fish | source
set -l line $argv[2..-1]
complete -C "$line"
"""
ASKED = {"bash": ASK_BASH, "zsh": ASK_ZSH, "fish": ASK_FISH}


def asked(shell: str, *words: str) -> list[str]:
    """What a real shell offers at Tab."""
    options = ["--norc", "-c"] if shell == "bash" else ["-f", "-c"] if shell == "zsh" else ["-c"]
    line = [ASKED[shell], *(() if shell == "fish" else ("ask",)), str(PROGRAM), *words]
    done = subprocess.run(
        [shell, *options, *line], capture_output=True, text=True, check=False, timeout=PATIENCE_S
    )
    assert done.returncode == 0, done.stderr
    return [line.split("\t")[0] for line in done.stdout.splitlines()]


@pytest.mark.slow
@pytest.mark.parametrize("shell", INSTALLED)
@pytest.mark.parametrize(
    ("words", "expected"),
    [(("run", "tachobot", "--clock", "v"), "virtual"), (("run", "tach"), "tachobot")],
)
def test_a_real_shell_completes(shell: str, words: tuple[str, ...], expected: str) -> None:
    assert expected in asked(shell, str(PROGRAM), *words)


@pytest.mark.slow
def test_bash_offers_files_where_nothing_is_known() -> None:
    registered, *offered = asked("bash", str(PROGRAM), "run", "tachobot", "--trace", "")
    assert "-o default" in registered
    assert offered == [""]


def test_recordings_that_were_kept_are_known_by_their_names(
    tmp_path: Path, state_directory: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = tmp_path / "kept"
    monkeypatch.setenv("FIRMWARE_RUNTIME_KEPT_DIRECTORY", str(kept))
    for path in (state_directory / "yawbot.recording", kept / "yawbot" / "yawbot-0007.recording"):
        path.parent.mkdir(parents=True)
        path.touch()
    both = ["yawbot", "yawbot-0007"]
    for verb in (("replay",), ("debug",), ("recordings", "keep")):
        assert ways_on(*verb, "yaw") == both
    assert ways_on("export", "yaw") == both
    assert ways_on("doubles", "replay", "yaw") == both
    assert ways_on("recordings", "re") == ["recover"]
    assert ways_on("run", "yaw") == []
