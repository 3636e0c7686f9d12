"""An HTTP server for Prometheus, on this machine only: a loopback address or a Unix socket."""

import os
from collections.abc import Callable
from ipaddress import ip_address
from pathlib import Path
from socket import AF_INET6, AF_UNIX, SOCK_STREAM, socket
from socketserver import BaseServer
from threading import Thread
from typing import Any
from wsgiref.simple_server import WSGIRequestHandler, WSGIServer

from prometheus_client import CollectorRegistry, make_wsgi_app
from prometheus_client.registry import Collector

from firmware_runtime.errors import ConfigError
from firmware_runtime.system.whole_numbers import whole_number

UNIX = "unix:"


class _Quiet(WSGIRequestHandler):
    """Logs nothing, and does not ask who a Unix socket's client is."""

    def log_message(self, format: str, *arguments: Any) -> None:  # noqa: A002, ANN401
        """Say nothing."""

    def address_string(self) -> str:
        """Name the client."""
        return "local"


class _UnixServer(WSGIServer):
    address_family = AF_UNIX

    def server_bind(self) -> None:
        """Bind to a path, which has neither host name nor port."""
        path = Path(os.fspath(self.server_address))  # type: ignore[call-overload] # a path
        if path.is_socket() and not _answers(path):
            path.unlink()  # of an exporter that is gone
        self.socket.bind(os.fspath(path))
        self.server_name, self.server_port = "localhost", 0
        self.setup_environ()

    def get_request(self) -> tuple[Any, Any]:
        """Accept; a Unix socket's client has no address."""
        request, _ = super().get_request()
        return request, ("local", 0)


class _Ip6Server(WSGIServer):
    address_family = AF_INET6


def serve(listen: str, collector: Collector, wait: Callable[[str], object]) -> None:
    """Answer with what the collector finds until `wait` returns, which gets where it listens."""
    with exporter(listen, collector) as server:
        thread = Thread(target=server.serve_forever)
        thread.start()
        wait(_place(server.server_address))
        server.shutdown()
        thread.join()


def _place(address: Any) -> str:  # noqa: ANN401 -- as sockets have it
    """Where a server listens, in the words in which that is stated."""
    if not isinstance(address, tuple):
        return f"{UNIX}{os.fsdecode(address)}"
    host, port, *_ = address
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def exporter(listen: str, collector: Collector) -> BaseServer:
    """A server that answers with what the collector finds; `serve_forever` runs it.

    `listen` is `ADDRESS:PORT` of the loopback interface, or `unix:PATH`. Raises ConfigError for any
    other, and when it is taken: of what is at PATH, only a socket without a listener is replaced.
    """
    registry = CollectorRegistry()
    registry.register(collector)
    try:
        server = _server(listen)
    except OSError as error:
        raise ConfigError("--serve", [f"{listen}: {error.strerror or error}"]) from error
    server.set_app(make_wsgi_app(registry))
    return server


def _server(listen: str) -> WSGIServer:
    if listen.startswith(UNIX):
        return _UnixServer(listen.removeprefix(UNIX), _Quiet)  # type: ignore[arg-type] # a path
    host, _, port = listen.rpartition(":")
    host = host.strip("[]")
    number = whole_number(port, 0xFFFF)
    if number is None or not _is_loopback(host):
        fault = f"{listen}: expected unix:PATH, or a loopback address such as 127.0.0.1:9798"
        raise ConfigError("--serve", [fault])
    kind = _Ip6Server if ":" in host else WSGIServer
    return kind((host, number), _Quiet)


def _is_loopback(host: str) -> bool:
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False


def _answers(path: Path) -> bool:
    """Return whether a socket's path has a listener."""
    with socket(AF_UNIX, SOCK_STREAM) as asking:
        return asking.connect_ex(os.fspath(path)) == 0
