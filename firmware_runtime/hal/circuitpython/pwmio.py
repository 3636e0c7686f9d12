"""CircuitPython's `pwmio` for a machine without pins: a PWM output that keeps what it is set to."""


class PWMOut:
    """The PWM of one pin; `duty_cycle` is of 65535."""

    def __init__(
        self,
        pin: object,
        *,
        duty_cycle: int = 0,
        frequency: int = 500,
        variable_frequency: bool = False,
    ) -> None:
        del variable_frequency  # it always is
        self.pin = pin
        self.duty_cycle = duty_cycle
        self.frequency = frequency

    def deinit(self) -> None:
        """Let the pin go: it is low."""
        self.duty_cycle = 0
