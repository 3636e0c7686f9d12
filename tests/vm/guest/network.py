"""A bad network of the kernel's own: `tc netem` on the cable between two network namespaces."""

import json
from tempfile import TemporaryDirectory
from typing import Any, Final

from tests.vm.guest.machine import PROGRAM, expect, run
from tests.vm.guest.report import Check

DELAY_MS: Final = 40.0
IMPAIR: Final = "delay=40ms,jitter=5ms,loss=5%"
SLOW: Final = (
    "controller.period_s=0.1",
    "thrust_pairs.timeout_s=1",
    "overruns.imu.tolerance_us=90000",
    "executive.max_lag_s=5",
)
"""Both ends and their carriers are emulated: six processes beside each other."""


def a_robot_is_driven_over_tc_netem_between_two_namespaces() -> str:
    """Values cross both ways, as late as the kernel was told, and nothing is left of the cable."""
    words = [word for setting in SLOW for word in ("--set", setting)]
    stage = ("--stage", "remote", "--impair", IMPAIR, "--for", "15", "--json")
    with TemporaryDirectory() as apart:  # the service's statistics are the ones to be found later
        state = f"FIRMWARE_RUNTIME_STATE_DIRECTORY={apart}"
        document = json.loads(run("env", state, PROGRAM, "run", "tachobot", *stage, *words))
    link = document["link"]
    by = link["impairment"]["by"]
    expect(by == "tc netem", f"the network is impaired by {by}: {link['impairment']}")
    left = run("ip", "netns", "list").strip()
    expect(not left, f"namespaces are left: {left}")
    return f"{_crossed(link, 'out')}; {_crossed(link, 'back')}; {document['result']}"


def _crossed(link: dict[str, Any], way: str) -> str:
    """Values went this way, and took as long as they were to."""
    found = link[way]
    age_ms = found["age_us"]["p50"] / 1000
    expect(found["received"] > 0, f"nothing went {way}: {found}")
    expect(age_ms >= DELAY_MS - 5, f"{way}: half of the values were {age_ms:.1f} ms old at most")
    counts = f"{found['received']} of {found['sent']} received, {found['repeated']} repeated"
    return f"{way}: p50 of the age {age_ms:.1f} ms, {counts}"


CHECKS: Final[tuple[Check, ...]] = (a_robot_is_driven_over_tc_netem_between_two_namespaces,)
