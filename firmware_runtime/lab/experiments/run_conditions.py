"""The conditions of an experiment: machine, kernel, versions, and what was between the ends."""

import os
import platform
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any


def conditions() -> dict[str, str]:
    """Of this machine and program, by name."""
    return {
        "machine": f"{_processor()}, {os.cpu_count()} processors",
        "kernel": f"{platform.system()} {platform.release()} {platform.machine()}",
        "Python": f"{platform.python_implementation()} {platform.python_version()}",
        "firmware-runtime": version("firmware-runtime"),
    }


def between(document: Mapping[str, Any]) -> str:
    """What was between the ends of a run, in words."""
    link = document["link"]
    if link is None:
        return f"one process, {document['clock']} time"
    words = f"{link['over']}, between {link['between']}"
    if (impaired := link["impairment"]) is None:
        return words
    return f"{words}, {impaired['how']} each way by {impaired['by']}"


def _processor() -> str:
    """The processor's name, as far as the kernel shows it."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    named = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(named, platform.machine())
