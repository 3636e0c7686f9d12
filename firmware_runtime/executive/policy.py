"""What happens when an activation of a periodic model comes late."""

from math import inf
from typing import Literal, TypeAlias, get_args

from msgspec import Struct

from firmware_runtime.devs.time import MICROSECOND, NEVER

Policy: TypeAlias = Literal["skip", "catch-up", "stop"]
POLICIES: tuple[str, ...] = get_args(Policy)


class ActivationPolicy(Struct, frozen=True):
    """The policy of one periodic model.

    - `skip`: the late activation runs once, the periods missed meanwhile are dropped, the phase is
      kept. What controllers want: the newest sample at the right rhythm.
    - `catch-up`: every missed activation runs, one after the other. What counts events or
      integrates step by step wants.
    - `stop`: every missed activation runs, but once one is later than `stop_after_us` the run ends
      and outputs are made safe.

    Lateness up to `tolerance_us` (default a tenth of the period) is no overrun. Raises ValueError
    for another policy, when `stop` has no limit or another one has, or a number is not positive.
    """

    policy: Policy = "skip"
    tolerance_us: float | None = None
    stop_after_us: float | None = None

    def __post_init__(self) -> None:
        if self.policy not in POLICIES:
            raise ValueError(f"policy {self.policy!r}: expected one of {', '.join(POLICIES)}")
        if (self.policy == "stop") != (self.stop_after_us is not None):
            raise ValueError(f"policy {self.policy}: stop_after_us belongs to policy stop, always")
        for name in ("tolerance_us", "stop_after_us"):
            value = getattr(self, name)
            if value is not None and not 0 < value < inf:
                raise ValueError(f"{name} = {value}: expected a positive number of microseconds")

    def tolerance(self, period: int) -> int:
        """Nanoseconds of lateness that are no overrun, for a model of this period."""
        return period // 10 if self.tolerance_us is None else round(self.tolerance_us * MICROSECOND)

    def stop_after(self) -> int:
        """Nanoseconds of lateness beyond which the run ends; NEVER unless the policy is `stop`."""
        return NEVER if self.stop_after_us is None else round(self.stop_after_us * MICROSECOND)


SKIP = ActivationPolicy()
