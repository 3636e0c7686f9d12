"""A page that is served by a process of its own, and what a program asks of it."""

import json
import urllib.error
import urllib.request
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, NamedTuple

from benchmarks.shared.page import served
from tests.support.waiting import PATIENCE_S


class Answer(NamedTuple):
    """What the server answered."""

    status: int
    headers: Mapping[str, str]
    content: bytes

    @property
    def document(self) -> Any:  # noqa: ANN401 -- as of json.loads
        """The JSON in it."""
        return json.loads(self.content)


class ServedPage:
    """The page at an address of this machine."""

    def __init__(self, address: str) -> None:
        self.address = address.rstrip("/")

    def ask(
        self, path: str, content: bytes | None = None, headers: Mapping[str, str] | None = None
    ) -> Answer:
        """Ask for a path as its own page does; with `content`, a change."""
        own = {"Origin": self.address} if headers is None else headers
        request = urllib.request.Request(f"{self.address}{path}", content, dict(own))  # noqa: S310
        try:
            with urllib.request.urlopen(request, timeout=PATIENCE_S) as answer:  # noqa: S310
                return Answer(answer.status, dict(answer.headers), answer.read())
        except urllib.error.HTTPError as error:
            with error:
                return Answer(error.code, dict(error.headers), error.read())

    def said(self, path: str) -> Any:  # noqa: ANN401 -- as of json.loads
        """The document at a path that is there."""
        answer = self.ask(path)
        assert answer.status == 200, answer
        return answer.document


@contextmanager
def served_page(*words: object, **options: Any) -> Iterator[ServedPage]:  # noqa: ANN401 -- of Popen
    """`view` with these words, on any free port, until the block ends."""
    with served("view", *words, **options) as found:
        yield ServedPage(found.address)
