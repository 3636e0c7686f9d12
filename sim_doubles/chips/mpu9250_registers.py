"""The MPU-9250's register map: numbers, bits, power-up values.

Source: InvenSense RM-MPU-9250A rev. 1.6. The factory values (self-test codes, accelerometer trim)
differ from chip to chip; these are plausible and not zero, as on any real one.
"""

SELF_TEST_GYRO = 0x00
SELF_TEST_ACCEL = 0x0D
XG_OFFSET_H = 0x13
SMPLRT_DIV = 0x19
CONFIG = 0x1A
GYRO_CONFIG = 0x1B
ACCEL_CONFIG = 0x1C
ACCEL_CONFIG2 = 0x1D
FIFO_EN = 0x23
I2C_MST_CTRL = 0x24
I2C_SLV0_ADDR = 0x25  # ADDR, REG, CTRL of SLV0 to SLV3
I2C_SLV4_ADDR = 0x31  # ADDR, REG, DO, CTRL, DI
I2C_SLV4_CTRL = 0x34
I2C_SLV4_DI = 0x35
I2C_MST_STATUS = 0x36
INT_PIN_CFG = 0x37
INT_STATUS = 0x3A
ACCEL_XOUT_H = 0x3B
TEMP_OUT_H = 0x41
GYRO_XOUT_H = 0x43
EXT_SENS_DATA_00 = 0x49
I2C_SLV0_DO = 0x63
I2C_MST_DELAY_CTRL = 0x67
SIGNAL_PATH_RESET = 0x68
USER_CTRL = 0x6A
PWR_MGMT_1 = 0x6B
PWR_MGMT_2 = 0x6C
FIFO_COUNTH = 0x72
FIFO_COUNTL = 0x73
FIFO_R_W = 0x74
WHO_AM_I = 0x75
XA_OFFSET_H = 0x77

FIFO_MODE = 0x40  # CONFIG: stop when full
SLV3_FIFO = 0x20  # I2C_MST_CTRL
ANYRD_2CLEAR, BYPASS_EN = 0x10, 0x02  # INT_PIN_CFG
FIFO_OFLOW, RAW_DATA_RDY = 0x10, 0x01  # INT_STATUS
SLV4_DONE, SLV4_NACK = 0x40, 0x10  # I2C_MST_STATUS
FIFO_ENABLE, I2C_MST_EN, I2C_IF_DIS = 0x40, 0x20, 0x10  # USER_CTRL
FIFO_RST, I2C_MST_RST, SIG_COND_RST = 0x04, 0x02, 0x01
H_RESET, SLEEP, CYCLE, GYRO_STANDBY, PD_PTAT, CLKSEL = (
    0x80,
    0x40,
    0x20,
    0x10,
    0x08,
    0x07,
)  # PWR_MGMT_1
CLOCK_STOPPED = 7  # CLKSEL

EXTERNAL_BYTES = 24  # EXT_SENS_DATA_00 to 23

GYRO_SELF_TEST_CODES = (0x97, 0x9A, 0x94)
ACCEL_SELF_TEST_CODES = (0x64, 0x66, 0x61)
ACCEL_TRIM = (0x1B39, 0xEA85, 0x20F7)  # offset words; bit 0 is the factory's

READ_ONLY = frozenset(
    {I2C_SLV4_DI, I2C_MST_STATUS, *range(INT_STATUS, 0x61), FIFO_COUNTH, FIFO_COUNTL, WHO_AM_I}
)


def power_up(who_am_i: int) -> bytes:
    """Return all registers as they are after power-up or H_RESET."""
    registers = bytearray(128)
    registers[SELF_TEST_GYRO : SELF_TEST_GYRO + 3] = bytes(GYRO_SELF_TEST_CODES)
    registers[SELF_TEST_ACCEL : SELF_TEST_ACCEL + 3] = bytes(ACCEL_SELF_TEST_CODES)
    registers[PWR_MGMT_1] = 0x01
    registers[WHO_AM_I] = who_am_i
    for axis, word in enumerate(ACCEL_TRIM):
        place = XA_OFFSET_H + 3 * axis
        registers[place : place + 2] = word.to_bytes(2, "big")
    return bytes(registers)


def signed_word(registers: bytearray, high: int) -> int:
    """Return the signed 16-bit word whose high byte is at `high`."""
    return int.from_bytes(registers[high : high + 2], "big", signed=True)
