"""The value on a hardware model's fault port, as all drivers here import it."""

from firmware_runtime.hal.wire_errors import Fault

__all__ = ["Fault"]
