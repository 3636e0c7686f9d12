"""Bugs in a model, each named with the model's path and the time."""

from firmware_runtime.devs.time import format_time
from firmware_runtime.errors import FirmwareRuntimeError


class ModelError(FirmwareRuntimeError):
    """A model broke a law of the formalism: our bug. Stop, outputs off, exit non-zero."""


class CouplingError(ModelError, ValueError):
    """Two ports that cannot be coupled, or a name that is taken."""


class ModelTimeError(ModelError):
    """A `ModelError` that happened to one model at one instant of simulated time."""

    def __init__(self, path: str, at: int, fault: str) -> None:
        self.path = path
        self.at = at
        super().__init__(f"{path} at {format_time(at)}: {fault}")


class TimeAdvanceError(ModelTimeError, ValueError):
    """A time advance that is negative or not a whole number of nanoseconds."""


class PortTypeError(ModelTimeError, TypeError):
    """A value of another type than its port carries."""


class SentOutsideOutput(ModelTimeError):
    """A model sent at a time when it may not: values leave in the output function only."""


class IllegitimateModel(ModelTimeError):
    """Endless zero-time steps: simulated time would never pass this instant."""


class OutputChangedState(ModelTimeError):
    """An output function changed its model's state; it may only send."""


class SelectError(ModelTimeError, ValueError):
    """A `select` that chose none of the components it was given."""


class ModelFailure(ModelTimeError):
    """A model's own code raised; the cause is chained."""
