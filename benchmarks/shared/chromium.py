"""Headless Chromium, spoken to by the DevTools protocol over a pair of pipes."""

import json
import os
import shutil
from base64 import b64decode
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

FOUND = shutil.which("chromium")
_ARGUMENTS = (
    *("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"),
    *("--no-first-run", "--disable-background-networking", "--disable-component-update"),
    *("--remote-debugging-pipe", "--hide-scrollbars"),
)
_READS, _WRITES = 3, 4
"""The descriptors on which a browser that is started so listens and answers."""


class BrowserError(RuntimeError):
    """The browser has gone, or the page is not as expected."""


class Page:
    """A page in a browser: what it asked for over the network, and what it complained of."""

    def __init__(self, browser: "_Browser") -> None:
        self.requests: list[str] = []
        self.complaints: list[str] = []
        self._browser = browser
        target = browser.ask("Target.createTarget", url="about:blank")["targetId"]
        attached = browser.ask("Target.attachToTarget", targetId=target, flatten=True)
        self._session: str = attached["sessionId"]
        for domain in ("Page", "Network", "Log", "Runtime"):
            self._ask(f"{domain}.enable")

    def open(self, page: Path | str, scheme: str, width: int = 1100, height: int = 900) -> None:
        """Load a file or an address in a colour scheme, and wait until all it wants is there.

        `requests` and `complaints` are those of this page.
        """
        self._browser.events.clear()
        self.requests.clear()
        self.complaints.clear()
        features = [{"name": "prefers-color-scheme", "value": scheme}]
        self._ask("Emulation.setEmulatedMedia", features=features)
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self._ask("Emulation.setDeviceMetricsOverride", **size)
        address = page.as_uri() if isinstance(page, Path) else page
        loader = self._ask("Page.navigate", url=address).get("loaderId")
        is_there = loader is None  # the same document; until then a load is that of a page before
        while (event := self._browser.event())["method"] != "Page.loadEventFired" or not is_there:
            if event["method"] == "Page.frameNavigated":
                is_there = is_there or event["params"]["frame"]["loaderId"] == loader
            self._note(event)
        self.evaluate("document.fonts.ready")
        for event in self._browser.events:
            self._note(event)
        self._browser.events.clear()

    def evaluate(self, expression: str) -> Any:  # noqa: ANN401 -- whatever JavaScript answers
        """The value of an expression in the page."""
        answer = self._ask(
            "Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True
        )
        _check("exceptionDetails" not in answer, answer)
        return answer["result"].get("value")

    def wait_for(self, condition: str, timeout_s: float = 60.0) -> None:
        """Wait until an expression is true in the page. Raises BrowserError where it never is."""
        _check(self.comes_true(condition, timeout_s), f"never: {condition}")

    def wait_until_no_wider(self, width: int) -> None:
        """Wait until nothing scrolls sideways: plots are fitted in a frame of their own."""
        self.wait_for(f"document.documentElement.scrollWidth <= {width}")

    def comes_true(self, condition: str, timeout_s: float) -> bool:
        """Return whether an expression becomes true in the page within that time."""
        looks = round(timeout_s / 0.05)
        found = self.evaluate(
            f"""new Promise((done) => {{
                let left = {looks};
                const timer = setInterval(() => {{
                    let is = false;
                    try {{ is = Boolean({condition}); }} catch {{ }}
                    if (is || --left < 0) {{ clearInterval(timer); done(is); }}
                }}, 50);
            }})"""
        )
        return bool(found)

    def click(self, words: str, within: str = "body") -> None:
        """Press the button with these words, or of this label. Raises BrowserError without one."""
        found = self.evaluate(
            f"""(() => {{
                const all = [...document.querySelectorAll({json.dumps(within)} + " button")];
                const button = all.find((each) => each.textContent.trim() === {json.dumps(words)}
                    || each.getAttribute("aria-label") === {json.dumps(words)});
                button?.click();
                return Boolean(button);
            }})()"""
        )
        _check(found, f"no button {words}")

    def picture(self, path: Path, *, is_whole: bool = False) -> None:
        """Write what is seen, or the whole page, as PNG."""
        shot = self._ask("Page.captureScreenshot", format="png", captureBeyondViewport=is_whole)
        path.write_bytes(b64decode(shot["data"]))

    def processor_s(self) -> float:
        """Processor time that all processes of the browser have taken so far."""
        found = self._browser.ask("SystemInfo.getProcessInfo")["processInfo"]
        return float(sum(each["cpuTime"] for each in found))

    def ask(self, method: str, **parameters: object) -> dict[str, Any]:
        """One call of the protocol."""
        return self._ask(method, **parameters)

    def _ask(self, method: str, **parameters: object) -> dict[str, Any]:
        answer: dict[str, Any] = self._browser.ask(method, self._session, **parameters)
        return answer

    def _note(self, event: dict[str, Any]) -> None:
        method, parameters = event["method"], event["params"]
        if method == "Network.requestWillBeSent":
            self.requests.append(parameters["request"]["url"])
        elif method in {"Log.entryAdded", "Runtime.consoleAPICalled", "Runtime.exceptionThrown"}:
            self.complaints.append(json.dumps(parameters))


class _Browser:
    """One browser process: calls, their answers, and the events between them."""

    def __init__(self, commands: int, answers: int) -> None:
        self.events: list[dict[str, Any]] = []
        self._commands = commands
        self._answers = os.fdopen(answers, "rb")
        self._calls = 0
        self._rest = b""

    def ask(self, method: str, session: str | None = None, /, **parameters: object) -> Any:  # noqa: ANN401
        """Call a method and wait for its answer; what happens meanwhile is kept in `events`."""
        self._calls += 1
        call = {"id": self._calls, "method": method, "params": parameters}
        if session is not None:
            call["sessionId"] = session
        os.write(self._commands, json.dumps(call).encode() + b"\0")
        while True:
            message = self._message()
            if message.get("id") == self._calls:
                _check("error" not in message, (method, message))
                return message["result"]
            if "method" in message:
                self.events.append(message)

    def event(self) -> dict[str, Any]:
        """The next event."""
        return self.events.pop(0) if self.events else self._message()

    def _message(self) -> dict[str, Any]:
        while b"\0" not in self._rest:
            more = os.read(self._answers.fileno(), 1 << 16)
            _check(more, "chromium has gone")
            self._rest += more
        first, _, self._rest = self._rest.partition(b"\0")
        message: dict[str, Any] = json.loads(first)
        return message

    def close(self) -> None:
        """Let go of both pipes."""
        os.close(self._commands)
        self._answers.close()


@contextmanager
def open_page(profile: Path) -> Iterator[Page]:
    """A page in a browser of its own that keeps what it must in the folder `profile`."""
    if FOUND is None:
        raise BrowserError("expected the Debian package chromium")
    to_browser, commands = os.pipe()
    answers, from_browser = os.pipe()
    words = [FOUND, *_ARGUMENTS, f"--user-data-dir={profile}", "about:blank"]
    silent = os.open(os.devnull, os.O_RDWR)
    process = os.posix_spawn(
        FOUND,
        words,
        os.environ,
        file_actions=[
            (os.POSIX_SPAWN_DUP2, silent, 1),
            (os.POSIX_SPAWN_DUP2, silent, 2),
            (os.POSIX_SPAWN_DUP2, to_browser, _READS),
            (os.POSIX_SPAWN_DUP2, from_browser, _WRITES),
        ],
    )
    for descriptor in (to_browser, from_browser, silent):
        os.close(descriptor)
    browser = _Browser(commands, answers)
    try:
        yield Page(browser)
        browser.ask("Browser.close")
    finally:
        browser.close()
        os.waitpid(process, 0)


def _check(is_so: object, otherwise: object) -> None:
    if not is_so:
        raise BrowserError(str(otherwise))
