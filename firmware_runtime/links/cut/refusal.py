"""Refusal of a datagram of a link: the reasons by which refusals are counted."""

from enum import StrEnum

from firmware_runtime.errors import FirmwareRuntimeError


class Reason(StrEnum):
    """One counter each; the order is that of the cells in the statistics."""

    MALFORMED = "malformed"
    """No frame of this format, or a value that its port does not carry."""
    OVERSIZED = "oversized"
    """Longer than any frame."""
    FORGED = "forged"
    """Its authentication code is not the one that the key makes."""
    REPLAYED = "replayed"
    """Its counter has been accepted before, or this end sent it itself."""
    STALE = "stale"
    """It was sent long before the newest one, or before its sender said that it ends."""
    WENT_BACK = "went_back"
    """Its counter and the instant at which it was sent contradict those of another one."""
    WRONG_SESSION = "wrong_session"
    """It is meant for another session than this one, or comes from one that is not the peer's."""
    OTHER_CUT = "other_cut"
    """The other end is cut elsewhere, or its ports have other types."""
    TOO_OLD = "too_old"
    """What it bears, or it itself, is older than `timeout_s`."""
    UNKNOWN_PORT = "unknown_port"
    """Its number is none of a port that this end takes values for."""
    NOT_FINITE = "not_finite"
    """A number in its value is NaN or infinite."""
    OUT_OF_LIMITS = "out_of_limits"
    """A number in its value is outside of the port's limits."""


class Refused(FirmwareRuntimeError):
    """A datagram is refused; `reason` is how it is counted, the text says more."""

    def __init__(self, reason: Reason, text: str = "") -> None:
        super().__init__(text or reason.value)
        self.reason = reason
