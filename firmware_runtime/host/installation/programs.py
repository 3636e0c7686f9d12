"""Programs of the system that an installation runs: each is shown, and each failure explained."""

import shlex
import subprocess
from collections.abc import Callable, Sequence

from firmware_runtime.host.installation.errors import StepFailed

Words = Sequence[str]


def run(words: Words, tell: Callable[[str], None]) -> None:
    """Show a command and run it to its end. Raises StepFailed."""
    tell(f"$ {shlex.join(words)}")
    answer(words)


def answer(words: Words) -> str:
    """What a command prints. Raises StepFailed."""
    try:
        done = subprocess.run(  # noqa: S603 -- words of this package's own
            words, capture_output=True, text=True, errors="replace", check=False
        )
    except OSError as error:
        raise StepFailed(
            f"{words[0]}: cannot be run ({error.strerror}); expected systemd's programs on the path"
        ) from error
    if done.returncode != 0:
        said = " ".join(done.stderr.split()) or "it said nothing"
        raise StepFailed(f"{shlex.join(words)}: ended with status {done.returncode}: {said}")
    return done.stdout
