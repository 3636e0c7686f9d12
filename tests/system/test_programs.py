"""Programs are run to their end, and what keeps them from it is a sentence."""

import subprocess

import pytest

from firmware_runtime.system.programs import ProgramFailed, answer_of, end_within, run_program


def test_what_a_program_left_is_kept() -> None:
    ended = run_program(["sh"], text="echo out; echo first >&2; echo last >&2; exit 3")
    assert (ended.status, ended.out) == (3, "out\n")
    assert (ended.reason, ended.complaint) == ("last", "first last")


def test_a_program_that_says_nothing_is_said_to() -> None:
    ended = run_program(["false"])
    assert ended.reason == "ended with status 1 and said nothing"
    assert ended.complaint == ""


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["no-such-command"], r"no-such-command: cannot be run \(No such file"),
        (["sleep", "60"], r"sleep: no end after 0\.05 s"),
        (["sh", "-c", "echo it hurts >&2; exit 8"], "ended with status 8: it hurts"),
    ],
)
def test_an_answer_that_cannot_be_had_is_a_sentence(words: list[str], why: str) -> None:
    with pytest.raises(ProgramFailed, match=why):
        answer_of(words, timeout_s=0.05 if words[0] == "sleep" else None)


def test_what_does_not_end_in_time_is_killed() -> None:
    with subprocess.Popen(["sleep", "60"]) as process:
        end_within(process, 0.01)
        assert process.returncode == -9
