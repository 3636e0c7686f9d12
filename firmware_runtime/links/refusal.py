"""What is answered to a datagram that cannot be obeyed."""

from firmware_runtime.errors import FirmwareRuntimeError


class Refusal(FirmwareRuntimeError):
    """A datagram is not obeyed, and nothing else happens; the text goes back to its sender."""
