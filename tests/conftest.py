"""What holds for every test: one hypothesis profile, a place of its own, the marks, the bounds."""

import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from tests.support import marks, skips
from tests.support.command import Command

settings.register_profile(
    "project",
    deadline=None,  # how long an example takes is the machine's business
    derandomize=True,
    database=None,
    suppress_health_check=[HealthCheck.too_slow],  # likewise
)
settings.load_profile("project")

_TESTS = Path(__file__).parent


def pytest_addoption(parser: pytest.Parser) -> None:
    skips.add_option(parser)


def pytest_configure(config: pytest.Config) -> None:
    """Plug in what holds tests to their mark and what counts skipped ones.

    A shell's script starts what runs in the background with SIGINT and SIGQUIT ignored, and a child
    inherits that: those that tests start are to end by them.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if signal.getsignal(signal.SIGQUIT) is signal.SIG_IGN:
        signal.signal(signal.SIGQUIT, signal.SIG_DFL)
    config.pluginmanager.register(marks.Marks(), "marks")
    if config.getoption(skips.OPTION):
        config.pluginmanager.register(skips.Forbidden(), "skips")


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Leave out files without a test in real time where only those are wanted: most of them."""
    if collection_path.suffix != ".py" or not config.option.markexpr.startswith(marks.REAL_TIME):
        return None
    return None if marks.may_be_real_time(collection_path.relative_to(_TESTS)) else True


def pytest_itemcollected(item: pytest.Item) -> None:
    marks.mark_by_folder(item, item.path.relative_to(_TESTS).parts[0])


@pytest.fixture(scope="session", autouse=True)
def _place_of_its_own(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Statistics, sockets and what else a run keeps: none shared with another worker or a robot."""
    with pytest.MonkeyPatch.context() as patch:
        place = tmp_path_factory.mktemp("state")
        patch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(place))
        patch.setenv("XDG_STATE_HOME", str(place / "kept"))
        patch.setenv("FIRMWARE_RUNTIME_SETTINGS_DIRECTORY", str(place / "no settings"))
        yield


@pytest.fixture
def command(capsys: pytest.CaptureFixture[str]) -> Command:
    """The command `firmware-runtime` in this process."""
    return Command(capsys)
