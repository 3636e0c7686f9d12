"""A page in a notebook: in a frame below the cell, as it is in its file. Needs no package."""

import sys
from html import escape
from typing import Final

from firmware_runtime.errors import ConfigError
from firmware_runtime.statistics.statistics import Statistics
from firmware_runtime.statistics.summary import summary
from firmware_runtime.view.page import page_of
from firmware_runtime.view.parts import Page
from firmware_runtime.view.report.report import report

_LOOK: Final = "width:100%;height:44rem;border:0"


class Frame:
    """A page as notebooks show it; in a frame its style and its names are its own."""

    def __init__(self, page: Page) -> None:
        self._text = page_of(page)

    def _repr_html_(self) -> str:
        """Return markup for whatever shows HTML."""
        look = f'sandbox="allow-scripts" style="{_LOOK}"'
        return f'<iframe {look} srcdoc="{escape(self._text)}"></iframe>'


def show(page: Page, instead: str) -> None:
    """Show it below the cell that runs this. Raises ConfigError where no notebook does.

    `instead` is a command that writes the same page.
    """
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    if not hasattr(shell, "kernel"):  # a terminal shows no pages
        raise ConfigError.of_one("show", "no notebook runs this", expected=f"one, or `{instead}`")
    sys.modules["IPython.display"].display(Frame(page))


def show_statistics(statistics: Statistics) -> None:
    """Show the report of a run. Raises ConfigError where no notebook runs this."""
    page = report(statistics, summary(statistics.figures()))
    show(page, "firmware-runtime report FILE -o page.html")
