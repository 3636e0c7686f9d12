"""These tests are not collected where the packages that they are about are not installed."""

from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

REQUIREMENTS = Path(__file__).with_name("requirements.txt")


def _missing() -> list[str]:
    missing = []
    for line in REQUIREMENTS.read_text("utf-8").splitlines():
        if line and not line.startswith("#"):
            name = line.partition("==")[0]
            try:
                version(name)
            except PackageNotFoundError:
                missing.append(name)
    return missing


MISSING = _missing()
collect_ignore_glob = ["test_*.py"] if MISSING else []


def pytest_report_header() -> str | None:
    """Say why."""
    if not MISSING:
        return None
    return (
        f"tests/outsiders: deselected, {', '.join(MISSING)} not installed; expected "
        f"pip install --no-deps -r {REQUIREMENTS}, which make does"
    )
