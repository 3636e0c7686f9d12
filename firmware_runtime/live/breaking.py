"""Faults of the doubles that a run is on, as a page offers them; and the test that they make.

All functions get the socket where the doubles are served. They raise HalError where none are, and
ConfigError for a fault that cannot be made there.
"""

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.hal.served import strikes
from firmware_runtime.hal.served.packets import FaultList
from firmware_runtime.hal.strike import KINDS, OF_NO_DEVICE, Struck

WORLD: Final = "the robot"
"""The device of what strikes no chip, such as a push."""
_TEST: Final = "test_found.py"
_TEST_WITHIN_S: Final = 120.0
_MOST_S: Final = 3600.0


def breaks(socket: Path) -> dict[str, Any]:
    """What can be broken, by device, and what was broken so far, in JSON's types.

    `struck` counts `at_s` from when the run began on these doubles; `for_s` None has no end yet.
    """
    return _said(strikes.faults_of(socket))


def strike(
    socket: Path,
    kind: object,
    device: object = "",
    for_s: object = None,
    amount: object = None,
) -> dict[str, Any]:
    """Make a fault now, and return the same: `for_s` None lasts until it is cleared, 0 is once."""
    if not isinstance(kind, str) or not isinstance(device, str):
        raise ConfigError.of_one("break", "no kind", expected=f"one of {', '.join(KINDS)}")
    known = KINDS.get(kind)
    is_moment = known is not None and known.is_moment
    has_no_device = known is not None and known.of in OF_NO_DEVICE
    return _said(
        strikes.strike(
            socket,
            kind,
            "" if has_no_device or device == WORLD else device,
            for_s=None if is_moment else _number("for_s", for_s, _MOST_S),
            amount=_number("amount", amount, float("inf")),
        )
    )


def clear(socket: Path) -> dict[str, Any]:
    """End all faults, and return the same."""
    return _said(strikes.clear(socket))


def test_text(socket: Path) -> str:
    """A pytest file that breaks the robot, in virtual time, as it was broken in this run.

    The script is run before it is written, in a process of its own: `doubles fault --as-test`.
    """
    with TemporaryDirectory() as folder:
        test = Path(folder) / _TEST
        words = ["doubles", "fault", "--as-test", str(test), "--socket", str(socket)]
        try:
            done = subprocess.run(  # noqa: S603 -- this very program
                [sys.executable, "-m", "firmware_runtime.cli", *words],
                capture_output=True,
                text=True,
                timeout=_TEST_WITHIN_S,
                check=False,
                stdin=subprocess.DEVNULL,
            )
        except subprocess.TimeoutExpired as error:
            fault = f"its script took over {_TEST_WITHIN_S:g} s"
            raise ConfigError.of_one("break", fault, expected="fewer or shorter faults") from error
        if done.returncode != 0:
            raise ConfigError("break", [_why(done.stderr)])
        return test.read_text(encoding="utf-8")


def _said(listing: FaultList) -> dict[str, Any]:
    began = listing.at if listing.began_at is None else listing.began_at
    devices: list[dict[str, Any]] = [
        {"name": each.name, "what": each.what, "line": each.line, "kinds": list(each.kinds)}
        for each in listing.places
    ]
    of_world = [each.name for each in listing.kinds if each.of in OF_NO_DEVICE]
    if of_world:
        devices.append({"name": WORLD, "what": "world", "line": None, "kinds": of_world})
    return {
        "board": listing.board,
        "kinds": {each.name: each.meaning for each in listing.kinds},
        "amounts": {
            each.name: {"amount": each.amount, "unit": each.unit}
            for each in listing.kinds
            if each.amount is not None
        },
        "devices": devices,
        "struck": [_struck(each, began) for each in listing.struck],
    }


def _struck(struck: Struck, began: int) -> dict[str, Any]:
    return {
        "kind": struck.kind,
        "device": WORLD if KINDS[struck.kind].of in OF_NO_DEVICE else struck.device or "all",
        "at_s": (struck.at - began) / SECOND,
        "for_s": None if struck.span is None else struck.span / SECOND,
        "amount": struck.amount,
    }


def _number(name: str, value: object, most: float) -> float | None:
    """A number, or None. Raises ConfigError for anything else, and what no double may be told."""
    if value is None:
        return None
    if isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= most:
        return float(value)
    raise ConfigError.of_one(name, f"{value!r}"[:40], expected=f"a number, {most:g} at most")


def _why(said: str) -> str:
    lines = [each.strip() for each in said.splitlines() if each.strip()]
    return lines[-1].removeprefix("firmware-runtime: ").removeprefix("- ") if lines else "no word"
