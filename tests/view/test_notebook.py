"""A page in a notebook: the one that the command writes, in a frame; elsewhere a sentence."""

import sys
from html import unescape
from types import SimpleNamespace

import pytest

from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.sweeps.row import Row
from firmware_runtime.lab.sweeps.sweep_table import Table
from firmware_runtime.statistics.summary import summary
from firmware_runtime.view.notebook import Frame, show
from firmware_runtime.view.page import page_of
from firmware_runtime.view.parts import Page, Text
from firmware_runtime.view.report.report import report
from tests.support.written_run import uneven_run
from tests.sweeps.test_rows_to_look_at import STATED

PAGE = Page(title='A "page" <b>', parts=[Text(text="words")])


@pytest.fixture
def shown(monkeypatch: pytest.MonkeyPatch) -> list[Frame]:
    """What a notebook was given to show."""
    given: list[Frame] = []
    here = SimpleNamespace(get_ipython=lambda: SimpleNamespace(kernel="a kernel"))
    monkeypatch.setitem(sys.modules, "IPython", here)
    monkeypatch.setitem(sys.modules, "IPython.display", SimpleNamespace(display=given.append))
    return given


def content(frame: Frame) -> str:
    before, _, rest = frame._repr_html_().partition('srcdoc="')
    assert before.startswith('<iframe sandbox="allow-scripts"')
    text, end, _ = rest.partition('">')
    assert end
    return unescape(text)


def test_a_frame_has_the_page_whole(shown: list[Frame]) -> None:
    show(PAGE, "a command")
    assert content(shown[0]) == page_of(PAGE)


def test_statistics_show_their_report(shown: list[Frame]) -> None:
    statistics = uneven_run(20).statistics()
    statistics.show()
    assert content(shown[0]) == page_of(report(statistics, summary(statistics.figures())))


def test_a_sweep_shows_its_page(shown: list[Frame]) -> None:
    rows: list[Row] = [{**STATED, "row": row, "world.mass": 1.0 * row} for row in range(3)]
    Table(rows).show()
    assert "sweep of 3 runs" in content(shown[0])


@pytest.mark.parametrize("shell", [None, SimpleNamespace()], ids=["a program", "a terminal"])
def test_elsewhere_it_is_said_how_to_write_the_page(
    shell: object, shown: list[Frame], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys.modules["IPython"], "get_ipython", lambda: shell)
    with pytest.raises(ConfigError, match="expected one, or `firmware-runtime report FILE -o"):
        uneven_run(20).statistics().show()
    monkeypatch.delitem(sys.modules, "IPython")
    with pytest.raises(ConfigError, match="no notebook runs this"):
        show(PAGE, "a command")
    assert shown == []
