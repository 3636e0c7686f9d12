"""Recordings in which something is otherwise, with the right checksums: what a stranger may send.

    python -m tests.support.mutated FILE.recording COUNT [SEED]

runs COUNT of them through the verbs that read a recording, by hand: it prints what is wrong.
"""

import io
import random
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import msgspec

from firmware_runtime.blackbox.chunk_file import Numbered, file_of
from firmware_runtime.blackbox.reader import read_recording
from firmware_runtime.blackbox.section import Kind
from firmware_runtime.cli.main import main
from firmware_runtime.recording.values import pack, unpack

_KEYFRAME = Kind.KEYFRAME.value
STRANGE: list[Any] = [
    *(None, True, -1, 0, 1 << 63, -(1 << 63), 2.5, float("nan"), float("inf"), "", "x", b"", b"\0"),
    *([], {}, [[]], {"list": []}, {"known": [0]}, {"same": [0]}, {"known": [-1]}, {"set": [[]]}),
    *({"os:system": ["true"]}, {"subprocess:Popen": ["true"]}, {"builtins:eval": ["1"]}),
    *({"dict": [[{"list": []}, 1]]}, {"dict": [[float("nan"), 1]]}, {"int": ["9" * 4000]}),
    *({"array": ["<f8", [1 << 60], b""]}, {"array": ["|O", [1], bytes(8)]}, {"deque": [[], -1]}),
    *({"firmware_runtime.hal.fault:Fault": ["a", "b", 1]}, {"random": [3, b"", None]}, "\u20ac"),
    *("a\nb", '"""', "\\", "../..", b"\xff" * 40, {"list": 3}, {"unknown": "x:y"}, {"a:b": [1]}),
]
VERBS = [
    ["replay", "{}", "--json"],
    ["replay", "{}", "--from", "0.2"],
    ["replay", "{}", "--set", "controller.yaw.kp=1"],
    ["debug", "{}", "--at", "0.25", "--print", "controller", "--json"],
    ["export", "{}", "-o", "{}.csv"],
    ["replay", "{}", "--as-test", "{}.py", "--from", "0.1", "--until", "0.2"],
]


def deep(levels: int) -> msgspec.Raw:
    """Lists in one another, deeper than an encoder goes."""
    return msgspec.Raw(b"\x91" * levels + b"\x90")


def mutations(path: Path, seed: int | str) -> Iterator[bytes]:
    """Files like the one at `path`, each with one section that is otherwise, or two."""
    yield from mutated([each.contents for each in read_recording(path).chunks], seed)


def mutated(chunks: Sequence[Sequence[bytes]], seed: int | str) -> Iterator[bytes]:
    """Recordings like that of these chunks of sections, likewise."""
    chance = random.Random(seed)  # noqa: S311 -- to be repeated
    while True:
        contents = [list(each) for each in chunks]
        for _ in range(chance.choice((1, 1, 2))):
            sections = chance.choice(contents)
            place = _place(sections, chance)
            sections[place] = _mutated(sections[place], chance)
        yield file_of([Numbered(n, each) for n, each in enumerate(contents, start=1)])


def _place(sections: list[bytes], chance: random.Random) -> int:
    """Mostly a keyframe, of which there are few."""
    keyframes = [n for n, each in enumerate(sections) if each[1] == _KEYFRAME]
    if keyframes and chance.random() < 0.6:
        return chance.choice(keyframes)
    return chance.randrange(len(sections))


def _mutated(content: bytes, chance: random.Random) -> bytes:
    if chance.random() < 0.2:
        place = chance.randrange(len(content))
        return content[:place] + bytes([chance.randrange(256)]) + content[place + 1 :]
    try:
        return _rewritten(unpack(content), chance)
    except (TypeError, ValueError, OverflowError, msgspec.MsgspecError, UnicodeEncodeError):
        return content  # it has been changed before, or so that it cannot be written


def _rewritten(fields: list[Any], chance: random.Random) -> bytes:
    if fields[0] == _KEYFRAME and chance.random() < 0.9:
        state = unpack(fields[-1])
        _change_in(state, chance)
        fields[-1] = pack(state)
    else:
        _change_in(fields, chance)
    return pack(fields)


def _change_in(tree: Any, chance: random.Random) -> None:  # noqa: ANN401 -- of a section
    """Put something strange somewhere below, leave something out, or have it twice."""
    while True:
        places = list(tree) if isinstance(tree, dict) else list(range(len(tree)))
        if not places:
            return
        place = chance.choice(places)
        inner = tree[place]
        if isinstance(inner, list | dict) and inner and chance.random() < 0.85:
            tree = inner
            continue
        if isinstance(inner, int | float) and not isinstance(inner, bool) and chance.random() < 0.3:
            tree[place] = chance.choice((-inner, inner + 1, inner * 3, 0))
        elif chance.random() < 0.2:
            del tree[place]
        else:
            tree[place] = chance.choice(STRANGE)
        return


def said(verb: list[str], path: Path) -> tuple[int | None, str]:
    """Exit status and what is said on standard error, of a verb on a recording."""
    out, errors = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(errors):
        try:
            status = main([each.format(path) for each in verb])
        except SystemExit as error:
            status = error.code if isinstance(error.code, int) else 1
    return status, errors.getvalue()


def fault_of(verb: list[str], path: Path) -> str | None:
    """What is wrong with how a verb takes a recording; None if it is right."""
    try:
        _, errors = said(verb, path)
    except BaseException as error:  # noqa: BLE001 -- nothing may come through
        return f"{verb[0]}: {type(error).__name__}: {error}"
    return f"{verb[0]}: {errors[-400:]}" if "Traceback" in errors else None


def _by_hand(path: Path, count: int, seed: int) -> int:
    wrong = 0
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "mutated.recording"
        for number, content in zip(range(count), mutations(path, seed), strict=False):
            file.write_bytes(content)
            if (fault := fault_of(VERBS[number % len(VERBS)], file)) is not None:
                wrong += 1
                sys.stdout.write(f"mutation {number}: {fault}\n")
                (path.parent / f"wrong-{seed}-{number}.recording").write_bytes(content)
    sys.stdout.write(f"{count} mutations, {wrong} wrong\n")
    return wrong


if __name__ == "__main__":
    raise SystemExit(_by_hand(Path(sys.argv[1]), int(sys.argv[2]), int((*sys.argv, "1")[3])) > 0)
