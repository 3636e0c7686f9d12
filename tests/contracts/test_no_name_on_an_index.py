"""firmware-runtime is on no package index: nothing may install what somebody else puts there."""

import re
import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[2]
BY_NAME = re.compile(
    r"""pip3?\s+(?:install|download)\b[^\n#&|,`]*?\s['"]?firmware[-_]runtime(?![\w./-])"""
    r"""|^(?:dependencies|requires)\b[^\n]*['"]firmware[-_]runtime\b""",
    re.MULTILINE,
)


def test_the_pattern_finds_an_installation_by_name_and_no_other() -> None:
    for text in (
        "pip install firmware-runtime",
        "python -m pip install --upgrade 'firmware-runtime[top]' pytest",
        'dependencies = ["firmware-runtime"]',
        'dependencies = ["numpy", "firmware_runtime>=0.1"]',
    ):
        assert BY_NAME.search(text), text
    for text in (
        "pip install /srv/firmware-runtime",
        "pip install wheels/firmware_runtime-*.whl pytest .",
        "pip install pytest  # beside firmware-runtime",
        "pip install .",
    ):
        assert not BY_NAME.search(text), text


def test_no_page_workflow_or_generated_file_installs_it_by_its_name() -> None:
    listed = subprocess.run(
        ["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    endings = {".md", ".toml", ".yml", ".yaml", ".sh", ".txt", ".cfg", ".service"}
    found = [
        name
        for name in listed.stdout.splitlines()
        if Path(name).suffix in endings
        and (ROOT / name).is_file()
        and BY_NAME.search((ROOT / name).read_text(encoding="utf-8"))
    ]
    assert found == []
