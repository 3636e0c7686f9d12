"""Exit statuses of the command, the same for every verb."""

from enum import IntEnum


class Status(IntEnum):
    """What the shell sees."""

    OK = 0
    MODEL_ERROR = 1
    """A model failed, a device was never ready, or a policy stopped the run; outputs are off."""
    BAD_INPUT = 2
    """The command line, a board file or a statistics file is not usable; nothing was touched."""
    NO_DEVICE = 3
    """A bus or chip is missing, or the run that a request was for; nothing was actuated."""
    NOT_SAFE = 4
    """The run ended, but some outputs could not be switched off."""
    REFUSED = 5
    """Something speaks against arming, or a trial was not agreed to; nothing was actuated."""
    NOTHING_HAPPENED = 6
    """Timed out waiting for an event."""
    DOCTOR_WARNS = 7
    """The doctor's worst finding is a warning: a run works, but not as well as it could."""
    DOCTOR_FAILS = 8
    """The doctor's worst finding is a failure: a run fails or does not get what it asks for."""
    NOT_DEPLOYED = 9
    """A target could not be reached or did not take the program; the one it had is still there."""
    NOT_PRINTED = 10
    """Done, but not all of it was printed, traced, recorded or drawn, as where a disk is full."""
    CANNOT_TELL = 11
    """`gate`: this machine cannot tell whether HEAD is slower or not."""
    NOT_ALL_COMPARED = 12
    """`replay`, `continuity`: no difference, but not everything could be compared."""
    INTERRUPTED = 130
    TERMINATED = 143

    @classmethod
    def of_comparison(cls, identical: bool | None) -> "Status":  # noqa: FBT001 -- a verdict
        """The status of a comparison; None is one in which not everything could be compared."""
        if identical is None:
            return cls.NOT_ALL_COMPARED
        return cls.OK if identical else cls.MODEL_ERROR
