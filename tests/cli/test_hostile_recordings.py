"""What somebody else may have written: it is refused by a sentence, and nothing of it is run."""

import ast
import os
from collections.abc import Callable, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import msgspec
import pytest
from msgspec.msgpack import Ext

from firmware_runtime.errors import ConfigError, StatisticsFileError, Status
from firmware_runtime.recording.blackbox.layout import MOST_CHUNKS, Chunk, file_of, prefix
from firmware_runtime.recording.blackbox.listing import listed
from firmware_runtime.recording.blackbox.locations import find_recording
from firmware_runtime.recording.blackbox.reader import kind_of, read_recording
from firmware_runtime.recording.blackbox.section import Kind, decode
from firmware_runtime.recording.values import MOST_DEPTH, is_too_deep
from firmware_runtime.statistics.file_header import STATISTICS
from firmware_runtime.statistics.paths import default_path, find_statistics
from tests.support.command import Command, in_python
from tests.support.mutated import EXPECTED, VERBS, deep
from tests.support.recorded import in_chunks, record, recording_in

STRANGER = 54321
"""A user who is neither this one nor root nor the service's."""


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> list[list[bytes]]:
    """Some chunks of a few sections each."""
    path = record(tmp_path_factory.mktemp("recordings") / "run.recording", "detective", 0.05)
    return [each.contents for each in recording_in(in_chunks(path, 20)).chunks]


def changed(whole: Sequence[Sequence[bytes]], kind: Kind, field: int, value: object) -> bytes:
    """The recording, with another value in a field of its first section of a kind."""
    chunks = [list(each) for each in whole]
    for contents in chunks:
        for place, content in enumerate(contents):
            if kind_of(content) == kind and decode(content).transfers:
                section = msgspec.msgpack.decode(content)
                section[field] = value
                contents[place] = msgspec.msgpack.encode(section)
                return file_of([Chunk(n, each) for n, each in enumerate(chunks, start=1)])
    raise AssertionError(kind)


@pytest.mark.parametrize(
    ("transfers", "said"),
    [
        ([[7, 64, [b"\0"], b"", 0]], "line 7"),
        ([[-1, 64, [b"\0"], b"", 0]], "is damaged"),
        ([[0, 64, ["\0"], b"", 0]], "is damaged"),
        ([[0, 64, [b"\0"], ["BusFault"], 0]], "is damaged"),
        ([[0, 64, [1 << 40], b"", 0]], "is damaged"),
        ([deep(3 * MOST_DEPTH)], "is damaged"),
    ],
)
def test_a_section_that_no_run_has_written_is_said_to_be_damaged(
    command: Command,
    tmp_path: Path,
    whole: list[list[bytes]],
    transfers: list[Any],
    said: str,
) -> None:
    path = tmp_path / "x.recording"
    path.write_bytes(changed(whole, Kind.STEP, 7, transfers))
    ended = command("replay", path)
    assert ended.status == Status.MODEL_ERROR
    assert said in ended.out.splitlines()[0]
    assert ended.error == ""


@pytest.mark.parametrize("number", ["1²", "9" * 12, "9" * 5000])
def test_a_run_of_a_process_that_there_cannot_be_is_listed_as_killed(
    tmp_path: Path, whole: list[list[bytes]], number: str
) -> None:
    header = msgspec.msgpack.decode(whole[0][0])
    header[-1]["run"] = f"detective-{number}"
    path = tmp_path / "detective-0001.recording"
    path.write_bytes(file_of([Chunk(1, [msgspec.msgpack.encode(header), *whole[0][1:9]])]))
    assert listed(path).end == "killed"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("verb", "port"),
    [
        *product(("replay", "csv"), range(12)),
        *product(sorted(VERBS.keys() - {"replay", "csv"}), (0, 11)),
    ],
)
def test_a_whole_number_beyond_any_float_is_a_value_like_another(
    command: Command, tmp_path: Path, whole: list[list[bytes]], verb: str, port: int
) -> None:
    path = tmp_path / "hostile" / "x.recording"
    path.parent.mkdir()
    path.write_bytes(changed(whole, Kind.STEP, 6, [port, {"int": ["9" * 400]}]))
    ended = command(*VERBS[verb](path, tmp_path))
    assert ended.status in EXPECTED
    assert "Traceback" not in ended.error


@pytest.mark.parametrize("levels", [MOST_DEPTH // 2, MOST_DEPTH + 1, 100_000])
@pytest.mark.parametrize(
    "opening", [b"\x91", b"\x81\xa1x", b"\xdc\x00\x01", b"\xdf\x00\x00\x00\x01\xc0"]
)
def test_how_deep_a_section_goes_is_known_without_going_there(levels: int, opening: bytes) -> None:
    within = b"\xca\x90\x90\x90\x90" + b"\xc4\x03\x90\x90\x90" + b"\xa2\x91\x91"
    content = b"\x94" + within + opening * levels + b"\xc0"
    assert is_too_deep(content) is (levels > MOST_DEPTH)


EVERY = (
    *(None, True, 7, -7, 200, 1000, 1 << 20, 1 << 40, -100, -1000, -(1 << 20), -(1 << 40), 1.5),
    *("\x7f" * size for size in (0, 1, 31, 32, 256, 1 << 16)),
    *(b"\x91" * size for size in (0, 1, 256, 1 << 16)),
    *(Ext(5, b"\x91" * size) for size in (1, 2, 3, 4, 8, 16, 256, 1 << 16)),
    *(Ext(5, b"\x00" * size) for size in (3, 256, 1 << 16)),
    *([0] * size for size in (0, 1, 15, 16, 1 << 16)),
    *({key: [0] for key in range(size)} for size in (0, 1, 15, 16, 1 << 12)),
    dict.fromkeys(range(1 << 16), 0),
)
"""Something of every form that MessagePack has; what lies in bytes is no list."""


@pytest.mark.parametrize("levels", [MOST_DEPTH - 1, MOST_DEPTH])
def test_how_deep_a_section_goes_is_known_whatever_else_is_in_it(levels: int) -> None:
    first, last = (b"\x91" * each + b"\xc0" for each in (levels, MOST_DEPTH - 1))
    every = [msgspec.msgpack.encode(each) for each in EVERY]
    every.append(b"\xca" + b"\x91" * 4)  # a float of 32 bits, which msgspec never writes
    for each in every:
        if len(each) < 1000:
            assert is_too_deep(b"\x92" + each + first) is (levels == MOST_DEPTH)
    content = b"\xdc" + (len(every) + 2).to_bytes(2, "big")
    assert is_too_deep(content + b"".join([*every, first, last])) is (levels == MOST_DEPTH)
    assert is_too_deep(content + b"".join([last, *every, first])) is (levels == MOST_DEPTH)
    assert not is_too_deep(content + b"".join([*every, last]))  # cut before its last item


DEEP = """
import resource, sys
resource.setrlimit(resource.RLIMIT_STACK, (1 << 20, 1 << 20))
resource.setrlimit(resource.RLIMIT_AS, (1 << 30, 1 << 30))
import threading
from firmware_runtime.cli.main import main
threading.stack_size(1 << 20)
ended = []
thread = threading.Thread(target=lambda: ended.append(main(sys.argv[1:])))
thread.start()
thread.join()
print(int(ended[0]))
"""


@pytest.mark.slow
@pytest.mark.parametrize("levels", [MOST_DEPTH - 20, 1 << 20])
def test_a_small_stack_and_a_gigabyte_are_enough(
    tmp_path: Path, whole: list[list[bytes]], levels: int
) -> None:
    path = tmp_path / "x.recording"
    path.write_bytes(changed(whole, Kind.STEP, 6, [0, deep(levels)]))
    with path.open("ab") as file:
        file.truncate(1 << 34)
    ran = in_python(DEEP, "replay", path)
    assert ran.returncode == 0, ran.stderr
    assert ran.stdout.splitlines()[-1] in {"1", "2"}
    assert "Traceback" not in ran.stderr


def test_a_file_that_says_it_is_large_takes_no_more_memory_than_it_has_bytes(
    command: Command, tmp_path: Path
) -> None:
    path = tmp_path / "x.recording"
    path.write_bytes(prefix(16 << 20, MOST_CHUNKS) + bytes(100))
    ended = command("replay", path)
    assert (ended.status, len(ended.error.splitlines())) == (Status.BAD_INPUT, 1)


# Whose it is --------------------------------------------------------------------------------------


@pytest.fixture
def give(monkeypatch: pytest.MonkeyPatch) -> Callable[[Path], None]:
    """Make files another user's: by giving them away, or by being another user from now on."""

    def given(path: Path) -> None:
        if os.geteuid() == 0:
            os.chown(path, STRANGER, -1)
        else:
            monkeypatch.setattr(os, "geteuid", lambda: STRANGER)

    return given


@pytest.mark.parametrize("verb", sorted(VERBS.keys() - {"recordings"}))
def test_a_recording_of_another_user_is_refused_with_what_to_do(
    command: Command,
    tmp_path: Path,
    whole: list[list[bytes]],
    give: Callable[[Path], None],
    verb: str,
) -> None:
    path = tmp_path / "x.recording"
    path.write_bytes(file_of([Chunk(n, each) for n, each in enumerate(whole, start=1)]))
    give(path)
    (said,) = command.refused(*VERBS[verb](path, tmp_path)).splitlines()
    assert f"{path} belongs to " in said
    assert "a copy of one's own can be read" in said


def test_a_folder_of_another_user_is_not_looked_in(
    state_directory: Path, whole: list[list[bytes]], give: Callable[[Path], None]
) -> None:
    state_directory.mkdir()
    path = state_directory / "detective.recording"
    path.write_bytes(file_of([Chunk(n, each) for n, each in enumerate(whole, start=1)]))
    assert find_recording("detective") == path
    give(state_directory)
    with pytest.raises(ConfigError, match=r"belongs to .*, and is not looked in"):
        find_recording("detective")
    with pytest.raises(StatisticsFileError, match=r"belongs to .*, and is not looked in"):
        find_statistics("detective")
    with pytest.raises(StatisticsFileError, match="belongs to"):
        default_path("detective")


def test_statistics_of_another_user_are_refused(
    tmp_path: Path, give: Callable[[Path], None]
) -> None:
    path = tmp_path / "x.stats"
    STATISTICS.create(path, {}, 1)
    with STATISTICS.opened(path):
        pass
    give(path)
    with pytest.raises(StatisticsFileError, match="belongs to"), STATISTICS.opened(path):
        pass


# What is written into Python ----------------------------------------------------------------------


@pytest.mark.parametrize(
    "name",
    [
        'x"""\nimport os\nos.abort()\n"""',
        "x\\",
        'x\'"\'""',
        "x\\N{BULLET}",
        "x\udc80\u2028",
        "x\x01{}",
    ],
)
def test_a_test_is_the_same_whatever_the_recording_calls_itself(
    tmp_path: Path, whole: list[list[bytes]], name: str, command: Command
) -> None:
    path = tmp_path / "".join(each for each in name if each not in "/\0")
    chunks = []
    for contents in whole:
        header = msgspec.msgpack.decode(contents[0])
        header[-1]["run"] = name.encode(errors="replace").decode()
        chunks.append([msgspec.msgpack.encode(header), *contents[1:]])
    path.write_bytes(file_of([Chunk(n, each) for n, each in enumerate(chunks, start=1)]))
    assert read_recording(path).header.run
    test = tmp_path / "test_it.py"
    assert command("replay", path, "--as-test", test, "--until", "0.04").status == Status.OK
    tree = ast.parse(test.read_text("utf-8"))
    assert [type(each).__name__ for each in tree.body] == [
        *("Expr", "ImportFrom", "ImportFrom", "Assign", "FunctionDef"),
    ]
    assert isinstance(tree.body[0], ast.Expr)
    assert isinstance(tree.body[0].value, ast.Constant)
