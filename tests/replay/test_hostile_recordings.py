"""A recording of a stranger, with right checksums: one sentence, whatever stands in it."""

import subprocess
import sys
from itertools import islice
from pathlib import Path

import pytest

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.blackbox import keyframe_schedule
from firmware_runtime.recording.blackbox.section import Kind, encode
from firmware_runtime.recording.board_of_recording import board_of_table
from tests.support.mutated import VERBS, fault_of, mutations
from tests.support.recorded import every_section, in_chunks, record, rewrite

MUTATIONS = 12


@pytest.fixture(name="recording", scope="module")
def _recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """0.4 s of TachoBot in two chunks, with a keyframe every 0.15 s."""
    path = tmp_path_factory.mktemp("hostile") / "tachobot.recording"
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(keyframe_schedule, "KEYFRAME_EVERY", 150 * MILLISECOND)
        record(path, "tachobot", 0.4)
    path.write_bytes(in_chunks(path, 400))
    return path


@pytest.mark.slow
@pytest.mark.parametrize("verb", VERBS)
def test_a_mutated_recording_is_one_sentence(recording: Path, tmp_path: Path, verb: str) -> None:
    file, folder = tmp_path / "hostile" / "mutated.recording", tmp_path / "written"
    file.parent.mkdir()
    folder.mkdir()
    for number, content in enumerate(islice(mutations(recording, verb), MUTATIONS)):
        file.write_bytes(content)
        assert fault_of(verb, file, folder) is None, f"mutation {number}"


def test_settings_that_are_no_table_of_texts_and_numbers_are_refused() -> None:
    with pytest.raises(ConfigError, match="its settings are none"):
        board_of_table("board.toml", {"board": "tachobot", "imu": {"address": b"\0"}})


DEEPEST = 400


@pytest.mark.slow
def test_values_within_values_are_one_sentence_on_a_small_stack(
    recording: Path, tmp_path: Path
) -> None:
    """On a stack of 1 MB, as in a container or a thread."""
    deep: object = 1
    for _ in range(DEEPEST):
        deep = [deep]
    file = tmp_path / "deep.recording"
    file.write_bytes(recording.read_bytes())
    section = encode((Kind.STEP.value, 0, [], [], [], [], [0, deep], [], [["in", deep]], deep))
    rewrite(file, [every_section(recording)[0], section])
    program = f"ulimit -s 1024; exec {sys.executable} -m firmware_runtime.cli replay {file}"
    ended = subprocess.run(["bash", "-c", program], capture_output=True, text=True, check=False)
    assert ended.returncode in {1, 2}
    assert "Traceback" not in ended.stderr
