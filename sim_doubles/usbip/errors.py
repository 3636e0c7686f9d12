"""What can go wrong between a virtual USB device and the kernel."""

from sim_doubles.served.errors import ServingError


class Stalled(Exception):
    """The device refuses a request, as USB says: the host sees EPIPE."""


class NotUsbip(ServingError):
    """What arrived is no request of USB/IP."""


class NotAttached(ServingError):
    """The kernel did not take the device, or let go of it."""
