"""What `try` and `probe` know of the Plumb and the Brook."""

from typing import Final

from firmware_drivers.catalogue.trial import Identity, OnBus, OnPort, Options, Quantity, Sensor
from firmware_drivers.chips.step import Step

from firmware_runtime import I2cBus
from firmware_runtime.hal.serial import SerialPort
from underwater.brook.driver import ANSWER_NS, BAUD, Brook
from underwater.plumb.driver import ADDRESS, CONVERSION_NS, PRESSURE, TEMPERATURE, Plumb


def _gauge(bus: I2cBus, address: int, _options: Options) -> Sensor:
    chip, counts = Plumb(bus, address), [0, 0]

    def begin(conversion: int) -> Step:
        return Step("convert", lambda: chip.begin(conversion), CONVERSION_NS)

    def take(place: int) -> Step:
        return Step("take", lambda: counts.__setitem__(place, chip.read()), 0)

    def read() -> tuple[Quantity, ...]:
        found = chip.sounding(*counts)
        return (
            Quantity("depth_m", found.depth_m, "depth", "m", 3),
            Quantity("water_c", found.water_c, "water", "degC"),
        )

    return Sensor(
        place=chip.place,
        bring_up=chip.bring_up,
        measure=lambda: (begin(PRESSURE), take(0), begin(TEMPERATURE), take(1)),
        read=read,
    )


def _evidence(bus: I2cBus, address: int) -> str:
    Plumb(bus, address).identify()
    return "its coefficients agree with their check"


def _meter(port: SerialPort, _options: Options) -> Sensor:
    meter = Brook(port)
    return Sensor(
        place=meter.place,
        bring_up=meter.bring_up,
        measure=lambda: (Step("ask", meter.ask_flow, ANSWER_NS),),
        read=lambda: (Quantity("flow_l_s", meter.read_flow_l_s(), "flow", "l/s", 3),),
    )


PLUMB: Final = OnBus(
    name="plumb",
    title="Plumb, depth gauge",
    address=ADDRESS,
    addresses=(ADDRESS,),
    build=_gauge,
    identity=Identity("Plumb", (ADDRESS,), _evidence),
)
BROOK: Final = OnPort(name="brook", title="Brook, flow meter", baud=BAUD, build=_meter)
