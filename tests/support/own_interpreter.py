"""A folder whose environment has an interpreter of its own: a script that a test writes."""

from pathlib import Path


def with_interpreter(folder: Path, script: str) -> Path:
    """Let the interpreter of this folder's environment be a shell script; returns the folder."""
    interpreter = folder / ".venv" / "bin" / "python"
    interpreter.parent.mkdir(parents=True)
    interpreter.write_text(f"#!/bin/sh\n{script}\n")
    interpreter.chmod(0o700)
    return folder
