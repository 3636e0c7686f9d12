"""Judges mutants, each in a fork of this process, which has loaded pytest and nothing of ours.

A line of standard input is a question: a file, its text as a mutant, words of pytest and a limit.
The child gets that text wherever the file is imported; so nothing is written, and several servers
may judge at once. A line of standard output is the answer.
"""

import importlib.machinery
import os
import re
import signal
import sys
import tempfile
import traceback
from pathlib import Path
from types import CodeType

import msgspec
import pytest

_NOTICED = re.compile(r"^(?:FAILED|ERROR) (\S+)", re.MULTILINE)


class Question(msgspec.Struct, frozen=True):
    """A mutant, and the tests that judge it."""

    path: str
    source: str
    words: tuple[str, ...]
    limit_s: float


class Answer(msgspec.Struct, frozen=True):
    """What became of it: `failed`, `hung` or `survived`; and the first test that noticed it."""

    outcome: str
    by: str = ""


def main() -> None:
    """Answer until there is no question."""
    answers, sys.stdout = sys.stdout, sys.stderr
    for line in sys.stdin:
        answer = _judged(msgspec.json.decode(line, type=Question))
        answers.write(msgspec.json.encode(answer).decode() + "\n")
        answers.flush()


def _judged(question: Question) -> Answer:
    with tempfile.TemporaryDirectory() as folder:
        said = Path(folder, "said")
        child = os.fork()
        if child == 0:
            try:
                _be_child(question, said, Path(folder, "tests"))
            except BaseException:  # noqa: BLE001 -- a child never goes on as its parent
                traceback.print_exc()
            os._exit(70)
        status = _waited(child, question.limit_s)
        if status is None:
            return Answer("hung")
        if status == 0:
            return Answer("survived")
        text = said.read_text(errors="replace")
        noticed = _NOTICED.findall(text)
        return Answer("failed", noticed[0] if noticed else f"status {status}: {text[-300:]}")


def _waited(child: int, limit_s: float) -> int | None:
    """Wait for a child; return its status, or None where it took too much processor time."""
    _, status, used = os.wait4(child, 0)
    if os.WIFSIGNALED(status) and used.ru_utime + used.ru_stime >= 0.9 * limit_s:
        return None
    return status


def _be_child(question: Question, said: Path, folder: Path) -> None:
    import resource  # noqa: PLC0415 -- of the child

    os.setsid()
    limit = int(question.limit_s)
    resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 5))
    resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))
    signal.alarm(40 * limit)  # for one that waits
    descriptor = os.open(said, os.O_WRONLY | os.O_CREAT)
    for each in (1, 2):
        os.dup2(descriptor, each)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    sys.stdout = os.fdopen(1, "w")
    _import_instead(question.path, question.source)
    words = [
        "-x",
        "-q",
        "--tb=no",
        "-rfE",
        "--assert=plain",
        "-p",
        "no:cacheprovider",
        f"--basetemp={folder}",
    ]
    status = pytest.main([*words, *question.words])
    sys.stdout.flush()
    os._exit(int(status))


def _import_instead(path: str, source: str) -> None:
    """Let a file be imported as this text."""
    whole = importlib.machinery.SourceFileLoader.get_code

    def get_code(loader: importlib.machinery.SourceFileLoader, name: str) -> CodeType | None:
        if loader.path == path:
            return compile(source, path, "exec", dont_inherit=True)
        return whole(loader, name)

    importlib.machinery.SourceFileLoader.get_code = get_code  # type: ignore[method-assign,assignment]


if __name__ == "__main__":
    main()
