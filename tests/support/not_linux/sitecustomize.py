"""A Python on Linux that looks like one on macOS: with this folder first on PYTHONPATH.

It hides what Linux alone has: names of the standard library, functions of the C library, /proc,
/sys, /run and device nodes, Unix sockets of packets. It does not emulate macOS: what differs there
otherwise (lengths of socket paths, numbers of errors and signals) stays as it is on Linux.

Source: "Availability" of each name in the documentation of Python's standard library.
"""

import ctypes
import errno
import fcntl
import importlib
import mmap
import os
import re
import resource
import select
import selectors
import signal
import socket
import sys
import time
import types
from collections.abc import Callable, Sequence
from typing import Any

_LACKS: Sequence[tuple[types.ModuleType, str]] = (
    (os, r"sched_(get|set)(scheduler|param|affinity)|sched_(param|rr_get_interval)"),
    (os, r"SCHED_(BATCH|IDLE|RESET_ON_FORK)|(EFD|TFD|MFD|RWF|GRND|CLONE|POSIX_FADV|SPLICE)_.*"),
    (os, r"eventfd.*|timerfd_.*|memfd_create|pidfd_open|P_PIDFD|posix_(fallocate|fadvise)|waitid"),
    (os, r"fdatasync|pipe2|(get|set)res[ug]id|copy_file_range|splice|getrandom|.*xattr.*|XATTR_.*"),
    (os, r"O_(TMPFILE|PATH|DIRECT|NOATIME|LARGEFILE|RSYNC)|unshare|setns"),
    (time, r"CLOCK_(BOOTTIME|TAI)|pthread_getcpuclockid"),
    (select, r"epoll|EPOLL.*|POLLRDHUP|POLLMSG"),
    (signal, r"sigtimedwait|sigwaitinfo|SIGRT.*|SIGPWR|SIGSTKFLT|SIGPOLL|SIGCLD"),
    (resource, r"RUSAGE_THREAD|prlimit|RLIMIT_(RTPRIO|RTTIME|NICE|SIGPENDING|MSGQUEUE|OFILE)"),
    (mmap, r"MAP_(POPULATE|STACK|DENYWRITE|EXECUTABLE)|MADV_(HUGEPAGE|DONTFORK|REMOVE|HWPOISON).*"),
    (socket, r"SOCK_(CLOEXEC|NONBLOCK)|SO_(PEERCRED|PASSCRED|BINDTODEVICE|MARK|PRIORITY|DOMAIN)"),
    (socket, r"AF_(NETLINK|PACKET|CAN|VSOCK|ALG|TIPC|QIPCRTR)|SCM_CREDENTIALS|CAN_.*|NETLINK_.*"),
    (fcntl, r"F_(SETPIPE_SZ|GETPIPE_SZ|ADD_SEALS|GET_SEALS|SEAL_.*|OFD_.*|NOTIFY)|DN_.*"),
    (errno, r"EREMOTEIO|ECOMM|ENOMEDIUM|EMEDIUMTYPE|EUCLEAN|ERESTART|ECHRNG|EBADE|ENONET|ENOKEY"),
)
_C_LACKS = re.compile(
    r"timerfd_.*|eventfd.*|epoll_.*|prctl|sched_getcpu|sched_(get|set)(affinity|scheduler|param)"
    r"|setns|unshare|signalfd|inotify_.*|mlock2|syscall|posix_fallocate|memfd_create"
)
_ABSENT = re.compile(
    r"/(proc|sys|run)(/|$)|/dev/(i2c-|tty(S|AMA|USB|ACM)|gpiochip|shm|cpu_dma|watchdog)"
)


def _hide_names() -> None:
    twins = {name: sys.modules.get(name) for name in ("posix", "_socket", "_signal")}
    by_name = {"os": twins["posix"], "socket": twins["_socket"], "signal": twins["_signal"]}
    for module, pattern in _LACKS:
        for each in (module, by_name.get(module.__name__)):
            for name in [] if each is None else [*vars(each)]:
                if re.fullmatch(pattern, name):
                    delattr(each, name)


def _refuse_absent(path: object) -> None:
    try:
        name = os.path.normpath(os.fsdecode(path))  # type: ignore[arg-type]
    except TypeError:  # a descriptor
        return
    if _ABSENT.match(name):
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), name)


def _is_there(path: object) -> bool:
    try:
        _refuse_absent(path)
    except FileNotFoundError:
        return False
    return True


def _audit(event: str, arguments: tuple[Any, ...]) -> None:
    if event in {"open", "os.listdir", "os.scandir", "os.mkdir"} and arguments[0] is not None:
        _refuse_absent(arguments[0])
    elif event == "socket.__new__":
        _, family, kind, _ = arguments
        if family == socket.AF_UNIX and kind & 0xF == socket.SOCK_SEQPACKET:
            raise OSError(errno.EPROTONOSUPPORT, os.strerror(errno.EPROTONOSUPPORT))


def _looked_up(function: Callable[..., Any]) -> Callable[..., Any]:
    def look_up(path: Any, *arguments: Any, **named: Any) -> Any:  # noqa: ANN401 -- as the system's
        _refuse_absent(path)
        return function(path, *arguments, **named)

    return look_up


def _hide_functions() -> None:
    found = ctypes.CDLL.__getattr__

    def look_up(library: ctypes.CDLL, name: str) -> Any:  # noqa: ANN401 -- as that of ctypes
        if _C_LACKS.fullmatch(name):
            raise AttributeError(f"dlsym: symbol not found: {name}")
        return found(library, name)

    ctypes.CDLL.__getattr__ = look_up  # type: ignore[method-assign]


def _hide() -> None:
    _hide_names()
    importlib.reload(selectors)  # `socket` had it loaded, with epoll
    _hide_functions()
    for name in ("stat", "lstat", "readlink"):
        setattr(os, name, _looked_up(getattr(os, name)))
    access = os.access
    os.access = lambda path, *more, **named: _is_there(path) and access(path, *more, **named)
    machine = os.uname().machine
    os.uname = lambda: os.uname_result(("Darwin", "mac", "24.6.0", "Darwin Kernel", machine))
    # urllib asks this part of macOS for proxies
    proxies = types.ModuleType("_scproxy")
    vars(proxies).update(_get_proxies=dict, _get_proxy_settings=dict)
    sys.modules["_scproxy"] = proxies
    os.environ["_PYTHON_SYSCONFIGDATA_NAME"] = (
        f"_sysconfigdata__linux_{sys.implementation._multiarch}"
    )
    sys.platform = "darwin"
    sys.addaudithook(_audit)


_hide()
