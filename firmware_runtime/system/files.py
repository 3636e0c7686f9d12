"""The kernel's files, read below a root that tests put elsewhere.

What is absent, hidden or refused reads as None or as empty: in a container, or under a unit with
`ProcSubset=pid`, much of /proc is not shown, and no reader may stumble over that.
"""

from pathlib import Path

from msgspec import Struct


class SystemFiles(Struct, frozen=True):
    """Files of the kernel by their usual absolute path, such as `/proc/loadavg`."""

    root: Path = Path("/")

    def path(self, name: str) -> Path:
        """Where a file really is."""
        return self.root / name.lstrip("/")

    def content(self, name: str) -> bytes | None:
        """All bytes of a file, None if it cannot be read."""
        try:
            return self.path(name).read_bytes()
        except OSError:
            return None

    def text(self, name: str) -> str | None:
        """A file's text without the line end or the zero byte it closes with."""
        content = self.content(name)
        return None if content is None else content.decode(errors="replace").strip("\0\n ")

    def lines(self, name: str) -> list[str]:
        """A file's lines; none if it cannot be read."""
        return (self.text(name) or "").splitlines()

    def integer(self, name: str) -> int | None:
        """The whole number a file consists of, None if it is something else."""
        text = self.text(name)
        try:
            return None if text is None else int(text)
        except ValueError:
            return None

    def exists(self, name: str) -> bool:
        """Whether there is such a file, as far as this user can see."""
        try:
            return self.path(name).exists()
        except OSError:
            return False

    def matching(self, pattern: str) -> list[str]:
        """The usual paths that match a pattern such as `/dev/i2c-*`, in order."""
        try:
            found = sorted(self.root.glob(pattern.lstrip("/")))
        except OSError:
            return []
        return [f"/{path.relative_to(self.root)}" for path in found]


THIS_MACHINE = SystemFiles()


def cpu_list(text: str | None) -> list[int] | None:
    """The processors of a list such as `0-2,5`; none in an empty one, None if it is no list.

    A kernel built for it but started without writes `(null)`, which is empty too.
    """
    if text is None:
        return None
    cpus: list[int] = []
    for part in text.replace("(null)", "").split(","):
        first, _, last = part.strip().partition("-")
        try:
            cpus += range(int(first), int(last or first) + 1) if first else ()
        except ValueError:
            return None
    return cpus
