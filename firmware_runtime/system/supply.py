"""What a Raspberry Pi says of its supply and its heat, now: too little voltage, a clock held down.

Asking the firmware takes longer than any counter (a mailbox), so it is asked for only where it
could explain something. Elsewhere nothing is shown, which reads as None.

Source: Raspberry Pi documentation, `vcgencmd get_throttled`, bits 0 to 3; hwmon driver rpi_volt.
"""

from firmware_runtime.system.files import SystemFiles

UNDER_VOLTAGE, CAPPED, THROTTLED, TOO_HOT = 1, 2, 4, 8
_FLAGS = "/sys/devices/platform/soc*/*firmware/get_throttled"
_ALARMS = "/sys/class/hwmon/hwmon*/in0_lcrit_alarm"


class Supply:
    """Finds once where the firmware shows its flags; call it to read them."""

    def __init__(self, files: SystemFiles) -> None:
        self._files = files
        self._flags = next(iter(files.matching(_FLAGS)), None)
        alarms = files.matching(_ALARMS)
        monitors = [each for each in alarms if _monitor(files, each) == "rpi_volt"]
        self._alarm = next(iter(monitors), None)

    def __call__(self) -> int | None:
        """The bits that are set now; None where nothing is shown."""
        if self._flags is not None:
            return _bits(self._files.text(self._flags))
        alarm = None if self._alarm is None else self._files.integer(self._alarm)
        return None if alarm is None else UNDER_VOLTAGE * (alarm != 0)


def _monitor(files: SystemFiles, alarm: str) -> str | None:
    return files.text(f"{alarm.rpartition('/')[0]}/name")


def _bits(text: str | None) -> int | None:
    try:
        return None if text is None else int(text, 16) & 0xF
    except ValueError:
        return None
