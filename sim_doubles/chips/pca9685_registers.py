"""The PCA9685's register map: numbers, power-up values, writable bits, auto-increment order.

Source: NXP PCA9685 data sheet rev. 4, register summary and 7.3.
"""

MODE1 = 0x00
MODE2 = 0x01
SUBADR1 = 0x02
ALLCALLADR = 0x05
LED0_ON_L = 0x06
LED15_OFF_H = 0x45
ALL_LED_ON_L = 0xFA
ALL_LED_OFF_H = 0xFD
PRE_SCALE = 0xFE

# MODE1
RESTART = 0x80
EXTCLK = 0x40
AI = 0x20
SLEEP = 0x10
ENABLES = (0x08, 0x04, 0x02, 0x01)  # SUB1, SUB2, SUB3, ALLCALL: in the order of their registers

# MODE2
INVRT = 0x10
OCH = 0x08
OUTDRV = 0x04
OUTNE = 0x03

FULL = 0x1000  # bit 4 of LEDn_ON_H and LEDn_OFF_H, in the 16-bit word
CHANNELS = 16
LEAST_PRE_SCALE = 3
SOFTWARE_RESET = 0x06

_LED_POWER_UP = (0x00, 0x00, 0x00, 0x10) * CHANNELS
_LED_WRITABLE = (0xFF, 0x1F, 0xFF, 0x1F) * CHANNELS

POWER_UP = bytes([0x11, 0x04, 0xE2, 0xE4, 0xE8, 0xE0, *_LED_POWER_UP, *[0] * 184, 0x1E, 0])
WRITABLE = bytes([0x3F, 0x1F, 0xFE, 0xFE, 0xFE, 0xFE, *_LED_WRITABLE])
NEXT = bytes([*range(1, 0x46), 0, *range(0x47, 0xFF), 0, 0])
