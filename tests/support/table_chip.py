"""A driver and a double of any register table, as `new chip` would write them."""

from types import MappingProxyType

from firmware_drivers.chips.register_chip import ChipRegister, Expected, RegisterChip, Setting

from firmware_runtime.board.registers.register_file import parse_table
from firmware_runtime.board.registers.register_table import Register, RegisterTable
from firmware_runtime.hal.i2c import I2cBus
from sim_doubles.chips.register_table_double import RegisterTableDouble, World
from sim_doubles.clock import Now
from sim_doubles.contract.table_row import TableRow

EIGHT_BITS = """
chip = "EIGHT"
title = "a chip of 8-bit registers"
source = "none"
addresses = [0x29]
auto_increment = true
reserved = "refused"

[[registers]]
name = "ID"
address = 0x00
access = "r"
reset = 0x5A
identity = true
source = "1"

[[registers]]
name = "CONTROL"
address = 0x01
access = "rw"
reset = 0x10
writable = 0x81
self_clearing = 0x80
busy_us = 500
bring_up = 0x81
source = "2"

[[registers]]
name = "STATUS"
address = 0x02
access = "rw"
reset = 0x02
clear_on_read = 0x03
source = "3"

[[registers]]
name = "DATA"
address = 0x04
width = 16
byte_order = "little"
access = "r"
reset = 0
quantity = "force_n"
unit = "N"
scale = 0.5
offset = -10
signed = true
source = "4"

[[registers]]
name = "COMMAND"
address = 0x08
access = "w"
reset = 0
self_clearing = 0xFF
source = "5"
"""
WORDS = """
chip = "WORDS"
title = "a chip of 16-bit registers"
source = "none"
addresses = [0x40, 0x41]
auto_increment = false
reserved = 0xA5

[[registers]]
name = "CONFIG"
address = 0x00
width = 16
access = "rw"
reset = 0x399F
source = "1"

[[registers]]
name = "VALUE"
address = 0x01
width = 16
access = "r"
reset = 0x0102
source = "2"

[[registers]]
name = "SWAPPED"
address = 0x02
width = 16
byte_order = "little"
access = "rw"
reset = 0xABCD
source = "3"
"""

ABOVE_FLAGS = """
chip = "FLAGS"
title = "a chip whose counts begin above flags"
source = "none"
addresses = [0x41]
auto_increment = false
reserved = 0xA5

[[registers]]
name = "SUPPLY"
address = 0x02
width = 16
access = "r"
reset = 0x0005
quantity = "supply_v"
unit = "V"
scale = 0.004
lowest_bit = 3
source = "1"

[[registers]]
name = "SHUNT"
address = 0x03
width = 16
access = "r"
reset = 0xFFF0
quantity = "shunt_mv"
unit = "mV"
lowest_bit = 4
signed = true
source = "2"
"""


def table_of(text: str) -> RegisterTable:
    return parse_table(text, "table")


def driver_of(table: RegisterTable) -> type[RegisterChip]:
    registers = {each.name: _register(each) for each in table.registers}

    class Driver(RegisterChip):
        chip = table.chip
        addresses = table.addresses
        identity = [
            Expected(registers[each.name], each.reset if each.identity else None)
            for each in table.identities or table.readable[:1]
        ]
        settings = [
            Setting(registers[each.name], each.bring_up or 0, each.kept_bits, each.busy_ns)
            for each in table.brought_up
        ]

        def read_force_n(self) -> float:
            return self.read(self.registers["DATA"]) * 0.5 - 10

    Driver.registers = MappingProxyType(registers)
    return Driver


def row_of(text: str) -> type[TableRow]:
    table_ = table_of(text)
    driver = driver_of(table_)

    class Row(TableRow):
        table = table_

        def make_driver(self, bus: I2cBus, address: int) -> RegisterChip:
            return driver(bus, address)

        def make_double(self, now: Now, address: int, world: World) -> RegisterTableDouble:
            return RegisterTableDouble(now, table_, address, world)

    return Row


def _register(each: Register) -> ChipRegister:
    return ChipRegister(each.name, each.address, each.bytes, each.order, bool(each.signed))
