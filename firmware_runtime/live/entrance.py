"""Who may ask the page's server: this page itself, on this machine, or who has the token.

A browser sends requests of any page that it shows. So a request must name this server as its host
(no name that another DNS server leads here), and if it says from which page it comes, that must be
this one; what changes something must say so.
"""

from collections.abc import Mapping
from hmac import compare_digest
from ipaddress import ip_address
from pathlib import Path
from typing import Final
from urllib.parse import urlsplit

from firmware_runtime.errors import ConfigError
from firmware_runtime.links.key_file import read_key

COOKIE: Final = "firmware-runtime-token"
_FORBIDDEN_SITES: Final = frozenset({"cross-site", "same-site"})
_READS: Final = frozenset({"GET", "HEAD"})


class Entrance:
    """Judges requests by their headers. Raises ConfigError for an address that is none, or open.

    `address` is one of this machine's, or a name of it; other than loopback only with a
    `token_file` of mode 0600, a key as `new key FILE` makes one.
    """

    def __init__(self, address: str, port: int, token_file: Path | None = None) -> None:
        self.address, self.port = address, port
        self.token = None if token_file is None else read_key(token_file, "--token-file").hex()
        if not _is_loopback(address) and self.token is None:
            fault = f"{address} can be reached from other machines"
            raise ConfigError.of_one("--address", fault, expected="a --token-file with it")

    def why_not(
        self, method: str, headers: Mapping[str, str], cookies: Mapping[str, str]
    ) -> str | None:
        """Return why a request is refused; None where it is not."""
        if not self._is_own_host(headers.get("Host", "")):
            return "another host"
        origin = headers.get("Origin")
        if origin is not None and not self._is_own_origin(origin, headers.get("Host", "")):
            return "another origin"
        if origin is None and method not in _READS:
            return "no origin"
        if (
            headers.get("Sec-Fetch-Site") in _FORBIDDEN_SITES
            and headers.get("Sec-Fetch-Mode") != "navigate"
        ):
            return "another site"
        if self.token is not None and not self._has_token(headers, cookies):
            return "no token"
        return None

    def is_token(self, text: str) -> bool:
        """Return whether this is the token."""
        return self.token is not None and compare_digest(text.encode(), self.token.encode())

    def _has_token(self, headers: Mapping[str, str], cookies: Mapping[str, str]) -> bool:
        said = headers.get("Authorization", "").removeprefix("Bearer ")
        return self.is_token(said) or self.is_token(cookies.get(COOKIE, ""))

    def _is_own_host(self, host: str) -> bool:
        try:
            parts = urlsplit(f"//{host}")
            name, port = parts.hostname or "", parts.port or 80
        except ValueError:
            return False
        if port != self.port:
            return False
        return name == self.address or _is_loopback(name) or _is_any(self.address)

    def _is_own_origin(self, origin: str, host: str) -> bool:
        parts = urlsplit(origin)
        return parts.scheme in {"http", "https"} and parts.netloc == host


def _is_loopback(address: str) -> bool:
    try:
        return address == "localhost" or ip_address(address).is_loopback
    except ValueError:
        return False


def _is_any(address: str) -> bool:
    """Return whether it stands for all addresses of this machine; then a token is needed."""
    try:
        return ip_address(address).is_unspecified
    except ValueError:
        return False
