"""Completion: what may come next, and that real shells ask for it."""

import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.cli.commands.completion import SHELLS
from firmware_runtime.cli.main import VERBS, verb_names
from firmware_runtime.errors import Status
from firmware_runtime.system.packages import install_command
from tests.support.completion import ways_on
from tests.support.waiting import PATIENCE_S

PROGRAM = Path(sys.executable).with_name("firmware-runtime")


INSTALLED = [shell for shell in SHELLS if shutil.which(shell)]
"""Bash at least; on a machine that has zsh and fish, these too."""


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
    assert ways_on("") == verb_names()
    for verb in VERBS:
        assert "--help" in ways_on(verb, "--")


@pytest.mark.parametrize("shell", SHELLS)
def test_the_script_is_printed(command: Callable[..., Any], shell: str) -> None:
    ended = command("completion", shell)
    assert (ended.status, ended.out.count("_ARGCOMPLETE_SHELL")) == (0, 2 if shell != "fish" else 1)


def test_without_the_extra_the_command_that_installs_it_is_said(
    command: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "argcomplete", None)
    ended = command("completion", "bash")
    assert ended.status == Status.BAD_INPUT
    assert install_command("completion") in ended.error


ASK_BASH = """
source <("$1" completion bash)
complete -p firmware-runtime
COMP_LINE=$2 COMP_POINT=${#2} COMP_TYPE=9
_python_argcomplete "$1"
printf '%s\\n' "${COMPREPLY[@]}"
"""
ASK_ZSH = """
autoload -Uz compinit; compinit -u -D
source <("$1" completion zsh)
print -r -- ${_comps[firmware-runtime]}
BUFFER=$2; CURSOR=${#2}; words=("$1")
_describe() { print -rl -- "${completions[@]}"; }
_python_argcomplete
"""
ASK_FISH = """
set -x PATH (dirname $argv[1]) $PATH
$argv[1] completion fish | source
complete -C "$argv[2]"
"""
ASKED = {"bash": ASK_BASH, "zsh": ASK_ZSH, "fish": ASK_FISH}


def asked(shell: str, *words: str) -> list[str]:
    """What a real shell offers at Tab."""
    options = ["--norc", "-c"] if shell == "bash" else ["-f", "-c"] if shell == "zsh" else ["-c"]
    line = " ".join(["firmware-runtime", *words])
    script = [ASKED[shell], *(() if shell == "fish" else ("ask",)), str(PROGRAM), line]
    done = subprocess.run(
        [shell, *options, *script], capture_output=True, text=True, check=False, timeout=PATIENCE_S
    )
    assert done.returncode == 0, done.stderr
    return [re.split("[\t:]", line)[0].rstrip() for line in done.stdout.splitlines()]


@pytest.mark.slow
@pytest.mark.parametrize("shell", INSTALLED)
@pytest.mark.parametrize(
    ("words", "expected"),
    [(("run", "tachobot", "--clock", "v"), "virtual"), (("run", "tach"), "tachobot")],
)
def test_a_real_shell_completes(shell: str, words: tuple[str, ...], expected: str) -> None:
    assert expected in asked(shell, *words)


@pytest.mark.parametrize("shell", ["zsh", "fish"])
def test_a_shell_that_does_not_offer_files_by_itself_is_told_of_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, shell: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "kept.trace").touch()
    (tmp_path / "keeping").mkdir()
    offered = {each.partition(":")[0] for each in ways_on("stats", "--save", "k", shell=shell)}
    assert offered == {"kept.trace", "keeping/"}


@pytest.mark.slow
def test_bash_offers_files_where_nothing_is_known() -> None:
    registered, *offered = asked("bash", "run", "tachobot", "--trace", "")
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
