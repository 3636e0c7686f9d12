"""A page written to a file whose ending says how: a page, a picture of its plots, or its data."""

from importlib.util import find_spec
from pathlib import Path
from typing import Final

import msgspec

from firmware_runtime.errors import ConfigError
from firmware_runtime.statistics.json_values import NOT_JSON
from firmware_runtime.system.atomic_file import keep_output
from firmware_runtime.system.packages import install_command, module_of_extra
from firmware_runtime.view.page import page_of
from firmware_runtime.view.parts import Page, Text

PICTURES: Final = (".svg", ".png")
"""What matplotlib draws, which the extra `plot` brings."""
ENDINGS: Final = (*PICTURES, ".html", ".json")
_DRAWING: Final = "firmware_runtime.view.picture_file"


def page_file_faults(path: Path) -> list[str]:
    """Return why no page can be written there, before there is one: its ending, or the extra."""
    if path.suffix not in ENDINGS:
        *most, last = ENDINGS
        return [f"{path} ends in {path.suffix!r}, expected {', '.join(most)} or {last}"]
    if path.suffix in PICTURES and (why := why_no_pictures()):
        return [f"{path}: {why}"]
    return []


def why_no_pictures() -> str:
    """Return what is missing here to draw pictures, and the command that installs it."""
    if find_spec("matplotlib") is not None:
        return ""
    return f"matplotlib is not installed; expected the extra plot: {install_command('plot')}"


def write_page(page: Page, path: Path, option: str = "-o") -> None:
    """Write it, at what an option names. Raises ConfigError, also without the extra."""
    if path.suffix == ".html":
        content = page_of(page).encode()
    elif path.suffix == ".json":
        content = msgspec.json.encode(page)
    else:
        drawing = module_of_extra(_DRAWING, "plot")
        said = " ".join(each.text for each in page.opening if isinstance(each, Text))
        content = drawing.picture_of(path.suffix[1:], page.title, page.parts, said)
    keep_output(path, content, option)


def read_page(path: Path) -> Page:
    """Return the page whose data `write_page` has written. Raises ConfigError for another file."""
    try:
        return msgspec.json.decode(path.read_bytes(), type=Page)
    except (OSError, *NOT_JSON) as error:
        raise ConfigError.of_one(str(path), f"{error}", expected="a page's data") from error
