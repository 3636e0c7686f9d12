"""Completion: what may come next, and that real shells ask for it."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from firmware_runtime.cli.verbs import VERBS, verb_names
from tests.support.completion import ways_on
from tests.support.waiting import PATIENCE_S

PROGRAM = Path(sys.executable).with_name("firmware-runtime")


SHELLS = ("bash", "zsh", "fish")
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
        (("export", "x.ma", "--out"), ["--output"]),
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
        (("recordings", "re"), ["recover"]),
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


ASK_BASH = """
source <("$(dirname "$1")/register-python-argcomplete" firmware-runtime)
complete -p firmware-runtime
COMP_LINE=$2 COMP_POINT=${#2} COMP_TYPE=9
_python_argcomplete "$1"
printf '%s\\n' "${COMPREPLY[@]}"
"""
ASK_ZSH = """
autoload -Uz compinit; compinit -u -D
source <("$(dirname "$1")/register-python-argcomplete" --shell zsh firmware-runtime)
print -r -- ${_comps[firmware-runtime]}
BUFFER=$2; CURSOR=${#2}; words=("$1")
_describe() { print -rl -- "${completions[@]}"; }
_python_argcomplete
"""
ASK_FISH = """
set -x PATH (dirname $argv[1]) $PATH
(dirname $argv[1])/register-python-argcomplete --shell fish firmware-runtime | source
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
    assert ways_on("run", "yaw") == []
