"""Every sensor with a driver, read in SI units."""

import math
from functools import partial
from typing import Final

from firmware_drivers.catalogue.identity import (
    ADS1115_IDENTITY,
    AK8963_IDENTITY,
    CMPS12_IDENTITY,
    HMC5883L_IDENTITY,
    MPU9250_IDENTITY,
    SRF08_IDENTITY,
)
from firmware_drivers.catalogue.trial import (
    OnBus,
    OnPort,
    Option,
    Options,
    Quantity,
    Reading,
    Sensor,
)
from firmware_drivers.chips import ads1115, ak8963, cmps12, hmc5883l, maxbotix, srf08
from firmware_drivers.chips.ads1115 import Ads1115, Ads1115Settings
from firmware_drivers.chips.ak8963 import Ak8963
from firmware_drivers.chips.cmps12 import Cmps12
from firmware_drivers.chips.hmc5883l import Hmc5883l, Hmc5883lSettings
from firmware_drivers.chips.maxbotix import Maxbotix
from firmware_drivers.chips.mounting import Vector
from firmware_drivers.chips.mpu9250 import Mpu9250
from firmware_drivers.chips.mpu9250_settings import Mpu9250Settings
from firmware_drivers.chips.srf08 import Srf08, Srf08Settings
from firmware_drivers.chips.step import Step
from firmware_drivers.sonar import RangeFinder
from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.serial import SerialPort

_MOUNTING: Final = Option(
    "mounting", str, "chip axes along body x, y and z, such as '+y -x +z'", "+x +y +z"
)


def _field(field: Vector | None) -> Quantity:
    return Quantity("field_t", field, "field", "uT", 1, 1e6)


def _inertial(bus: I2cBus, address: int, options: Options) -> Sensor:
    chip = Mpu9250(bus, address, Mpu9250Settings(mounting=options["mounting"]))

    def read() -> Reading:
        sample = chip.read_sample()
        return (
            Quantity("acceleration_m_s2", sample.acceleration, "acceleration", "m/s2"),
            Quantity("rate_rad_s", sample.rate, "rate", "rad/s", 3),
            _field(sample.field),
            Quantity("temperature_c", sample.temperature_c, "temperature", "C", 1),
        )

    return Sensor(place=chip.place, bring_up=chip.bring_up, read=read, warnings=chip.warnings)


def _magnetometer(bus: I2cBus, address: int, options: Options) -> Sensor:
    chip = Ak8963(bus, address)
    host = Mpu9250(bus, options["imu_address"])
    return Sensor(
        place=chip.place,
        bring_up=lambda: (*host.open_bypass(), *chip.bring_up()),
        read=lambda: (_field(chip.read_field()),),
        end=host.close_bypass,
    )


def _compass(bus: I2cBus, address: int, _options: Options) -> Sensor:
    chip = Cmps12(bus, address)

    def read() -> Reading:
        found = chip.read_bearing()
        bearing = math.radians(found.bearing_deg)
        return (
            Quantity("bearing_rad", bearing, "bearing", "deg", 1, 180 / math.pi),
            Quantity("calibration", found.calibration, "calibration", "of 3", 0),
        )

    return Sensor(place=chip.place, bring_up=chip.bring_up, read=read)


def _field_sensor(bus: I2cBus, _address: int, options: Options) -> Sensor:
    settings = Hmc5883lSettings(range_gauss=options["range_gauss"], mounting=options["mounting"])
    chip = Hmc5883l(bus, settings)
    return Sensor(
        place=chip.place,
        bring_up=chip.bring_up,
        measure=lambda: chip.measurement,
        read=lambda: (_field(chip.read_field()),),
    )


def _range_finder(chip: RangeFinder) -> Sensor:
    wait_ns = max(chip.ranging_ns, chip.interval_ns)
    return Sensor(
        place=chip.place,
        bring_up=chip.bring_up,
        measure=lambda: (Step("range", chip.start_ranging, wait_ns),),
        read=lambda: (Quantity("distance_m", chip.read_distance(), "distance", "m"),),
    )


def _sonar(bus: I2cBus, address: int, options: Options) -> Sensor:
    settings = Srf08Settings(max_range_m=options["max_range_m"], gain=options["gain"])
    return _range_finder(Srf08(bus, address, settings))


def _serial_sonar(port: SerialPort, options: Options) -> Sensor:
    return _range_finder(Maxbotix(port, options["family"]))


def _voltage(bus: I2cBus, address: int, options: Options) -> Sensor:
    settings = Ads1115Settings(full_scale_v=options["full_scale_v"], rate_sps=options["rate_sps"])
    chip = Ads1115(bus, address, settings)
    measurement = chip.measurement(options["inputs"])
    return Sensor(
        place=chip.place,
        bring_up=chip.bring_up,
        measure=lambda: measurement,
        read=lambda: (Quantity("voltage_v", chip.read_voltage(), "voltage", "V", 4),),
    )


MPU9250: Final = OnBus(
    name="mpu9250",
    title="MPU-9250: acceleration, rate, field, temperature",
    address=0x68,
    addresses=Mpu9250.addresses,
    build=_inertial,
    options=(_MOUNTING,),
    identity=MPU9250_IDENTITY,
)
AK8963: Final = OnBus(
    name="ak8963",
    title="AK8963, the magnetometer in an MPU-9250, through its bypass: field",
    address=ak8963.ADDRESS,
    addresses=(ak8963.ADDRESS,),
    build=_magnetometer,
    options=(Option("imu-address", partial(int, base=0), "the MPU-9250's address", "0x68"),),
    identity=AK8963_IDENTITY,
)
SRF08: Final = OnBus(
    name="srf08",
    title="SRF08 sonar: distance",
    address=srf08.SHIPPED_AT,
    addresses=srf08.ADDRESSES,
    build=_sonar,
    options=(
        Option("max-range-m", float, "farthest echo that is waited for", 6.0),
        Option("gain", int, "greatest gain, 0 to 31", 31),
    ),
    identity=SRF08_IDENTITY,
)
MAXBOTIX: Final = OnPort(
    name="maxbotix",
    title="MaxBotix serial sonar: distance",
    baud=maxbotix.BAUD,
    build=_serial_sonar,
    options=(
        Option("family", str, "which frames it sends", "xl", choices=tuple(maxbotix.FAMILIES)),
    ),
)
CMPS12: Final = OnBus(
    name="cmps12",
    title="CMPS12 or CMPS14 compass: bearing",
    address=cmps12.SHIPPED_AT,
    addresses=cmps12.ADDRESSES,
    build=_compass,
    identity=CMPS12_IDENTITY,
)
HMC5883L: Final = OnBus(
    name="hmc5883l",
    title="HMC5883L magnetometer: field",
    address=hmc5883l.ADDRESS,
    addresses=(hmc5883l.ADDRESS,),
    build=_field_sensor,
    options=(Option("range-gauss", float, "full scale in gauss", 1.3), _MOUNTING),
    identity=HMC5883L_IDENTITY,
)
ADS1115: Final = OnBus(
    name="ads1115",
    title="ADS1115 analog-to-digital converter: voltage",
    address=ads1115.ADDRESSES[0],
    addresses=ads1115.ADDRESSES,
    build=_voltage,
    options=(
        Option(
            "inputs",
            str,
            "one input against ground, or two",
            "AIN0",
            choices=tuple(ads1115.CODES_OF_INPUTS),
        ),
        Option("full-scale-v", float, "full scale in V", 4.096),
        Option("rate-sps", int, "conversions a second", 128),
    ),
    identity=ADS1115_IDENTITY,
)
