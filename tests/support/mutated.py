"""Recordings in which something is otherwise, with the right checksums: what a stranger may send.

    python -m tests.support.mutated FILE.recording COUNT [SEED]

runs COUNT of them through the verbs that read a recording, in turns, on a stack of 1 MiB and within
1 GiB of memory. It prints what is wrong, keeps that recording beside FILE, and counts what became
of the others by exit status.
"""

import io
import itertools
import random
import resource
import sys
import tempfile
import threading
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import msgspec

from firmware_runtime.cli.main import main
from firmware_runtime.errors import Status
from firmware_runtime.recording.blackbox.layout import Chunk, file_of
from firmware_runtime.recording.blackbox.reader import read_recording
from firmware_runtime.recording.blackbox.section import Kind
from firmware_runtime.recording.values import pack, unpack

_KEYFRAME = Kind.KEYFRAME.value
STRANGE: list[Any] = [
    *(None, True, -1, 0, 1 << 63, -(1 << 63), 2.5, float("nan"), float("inf"), "", "x", b"", b"\0"),
    *([], {}, [[]], {"list": []}, {"known": [0]}, {"same": [0]}, {"known": [-1]}, {"set": [[]]}),
    *({"os:system": ["true"]}, {"subprocess:Popen": ["true"]}, {"builtins:eval": ["1"]}),
    *({"dict": [[{"list": []}, 1]]}, {"dict": [[float("nan"), 1]]}, {"int": ["9" * 4000]}),
    *({"array": ["<f8", [1 << 60], b""]}, {"array": ["|O", [1], bytes(8)]}, {"deque": [[], -1]}),
    *(
        {"firmware_runtime.hal.wire_errors:Fault": ["a", "b", 1]},
        {"random": [3, b"", None]},
        "\u20ac",
    ),
    *("a\nb", '"""', "\\", "../..", b"\xff" * 40, {"list": 3}, {"unknown": "x:y"}, {"a:b": [1]}),
]
VERBS: dict[str, Callable[[Path, Path], list[object]]] = {
    "replay": lambda path, _: ["replay", path, "--json"],
    "later": lambda path, _: ["replay", path, "--from", "0.2"],
    "what if": lambda path, _: ["replay", path, "--set", "recording.minutes=1"],
    "as-test": lambda path, folder: ["replay", path, "--as-test", folder / "test_it.py"],
    "recordings": lambda path, _: ["recordings", "list", "--in", path.parent],
    "recover": lambda path, folder: ["recordings", "recover", path, "-o", folder / "saved"],
    "csv": lambda path, folder: ["export", path, "-o", folder / "x.csv"],
    "mcap": lambda path, folder: ["export", path, "-o", folder / "x.mcap"],
    "debug": lambda path, _: ["debug", path, "--until", "0 > 1"],
}
"""What reads a recording, by what it is for: with the path of one, and a folder to write in."""
EXPECTED = frozenset({0, 1, 2, Status.NOTHING_HAPPENED, Status.NOT_ALL_COMPARED})
LIMITS = {resource.RLIMIT_STACK: 1 << 20, resource.RLIMIT_AS: 1 << 30}


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
        yield file_of([Chunk(n, each) for n, each in enumerate(contents, start=1)])


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


def said(verb: str, path: Path, folder: Path) -> tuple[int, str]:
    """Exit status and what is said on standard error, of a verb on a recording.

    What it writes into the folder is not left there.
    """
    out, errors = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(errors):
        try:
            status = main([str(each) for each in VERBS[verb](path, folder)])
        except SystemExit as error:
            status = error.code if isinstance(error.code, int) else 1
    for written in folder.iterdir():
        written.unlink()
    return status, errors.getvalue()


def fault_of(verb: str, path: Path, folder: Path) -> str | None:
    """What is wrong with how a verb takes a recording; None if it is right."""
    return _taken(verb, path, folder)[1]


def _taken(verb: str, path: Path, folder: Path) -> tuple[int | None, str | None]:
    """The exit status, and what is wrong."""
    try:
        status, errors = said(verb, path, folder)
    except BaseException as error:  # noqa: BLE001 -- nothing may come through
        return None, f"{verb}: {type(error).__name__}: {error}"
    if status not in EXPECTED:
        return status, f"{verb}: exit status {status}: {errors[-400:]}"
    return status, f"{verb}: {errors[-400:]}" if "Traceback" in errors else None


def _by_hand(path: Path, count: int, seed: int) -> int:
    threading.stack_size(LIMITS[resource.RLIMIT_STACK])
    wrong: list[str] = []
    thread = threading.Thread(target=lambda: wrong.extend(_wrong(path, count, seed)))
    thread.start()
    thread.join()
    return len(wrong)


def _wrong(path: Path, count: int, seed: int) -> Iterator[str]:
    """What is wrong of so many, said at once; the end says what became of the others."""
    ended: Counter[tuple[str, int | None]] = Counter()
    verbs = itertools.cycle(VERBS)
    with tempfile.TemporaryDirectory() as name:
        file, folder = Path(name, "recordings", "x.recording"), Path(name, "written")
        file.parent.mkdir()
        folder.mkdir()
        for number, (content, verb) in enumerate(zip(mutations(path, seed), verbs, strict=False)):
            if number == count:
                break
            file.write_bytes(content)
            status, fault = _taken(verb, file, folder)
            ended[verb, status] += 1
            if fault is not None:
                sys.stdout.write(f"mutation {number}: {fault}\n")
                (path.parent / f"wrong-{seed}-{number}.recording").write_bytes(content)
                yield fault
            if number % 10_000 == 9_999:
                sys.stdout.write(f"{number + 1} of {count}\n")
                sys.stdout.flush()
    for (verb, status), times in sorted(ended.items(), key=str):
        sys.stdout.write(f"{verb}: exit status {status}: {times}\n")


if __name__ == "__main__":
    for limit, most in LIMITS.items():
        resource.setrlimit(limit, (most, most))
    found = _by_hand(Path(sys.argv[1]), int(sys.argv[2]), int((*sys.argv, "1")[3]))
    sys.stdout.write(f"{sys.argv[2]} mutations, {found} wrong\n")
    raise SystemExit(found > 0)
