"""A new chip: a package with driver and double made from a register table, and its test."""

import math
from collections.abc import Iterable
from importlib.resources import files
from pathlib import Path
from typing import Final

from firmware_runtime.board.registers.register_file import parse_table
from firmware_runtime.board.registers.register_table import Register, RegisterTable
from firmware_runtime.errors import ConfigError
from firmware_runtime.host.scaffold.package import PLACE, class_name, name_fault, write_package
from firmware_runtime.system.atomic_file import read_text
from firmware_runtime.system.packages import installed

EXAMPLE: Final = "example_registers.toml"
LONGEST_INLINE: Final = 30
CHIPS: Final = "firmware_runtime.chips"
"""Entry points of chips that `try` and `probe` know."""


def write_chip(name: str, folder: Path, registers: Path | None) -> list[Path]:
    """Write a chip's package into a folder, from a register table or an example; return its files.

    Raises ConfigError for a name that a package or a chip cannot have, for every fault of the
    table, and for a folder with something in it.
    """
    taken = any(each.name == name for each in installed(CHIPS))
    fault = "a chip of that name is installed; expected another name" if taken else name_fault(name)
    if fault is not None:
        raise ConfigError.of_one("new chip", fault)
    text = _example(name) if registers is None else read_text(registers)
    table = parse_table(text, str(registers))
    return write_package("chip_template", folder, _words(name, table, text))


def _example(name: str) -> str:
    text = (files(PLACE) / EXAMPLE).read_text(encoding="utf-8")
    return text.replace("ChipName", class_name(name))


def _words(name: str, table: RegisterTable, text: str) -> dict[str, str]:
    """Return the replacement of each word of the template; the user's own words come last."""
    return {
        "chipname": name,
        "ChipName": class_name(name),
        "CHIP_ADDRESSES": _tuple(0, [f"0x{each:02X}" for each in table.addresses], short=True),
        "REGISTER_CONSTANTS": "\n".join(map(_constant, table.registers)),
        "REGISTER_NAMES": _tuple(0, [each.name for each in table.registers], short=True),
        "IDENTITY_ROWS": _tuple(0, map(_identity, table.identities or table.readable[:1])),
        "SETTING_ROWS": _tuple(0, map(_setting, table.brought_up)),
        "QUANTITY_METHODS": "".join(map(_method, table.quantities)),
        "QUANTITY_ROWS": _tuple(
            8, map(_quantity, table.quantities) if table.quantities else map(_word, table.readable)
        ),
        "CHIP_PRINTED": table.chip,
        "CHIP_TITLE": table.title,
        "CHIP_SOURCE": table.source,
        "REGISTERS_TOML": text,
    }


def _tuple(depth: int, items: Iterable[str], *, short: bool = False) -> str:
    """The items as a tuple in a source text: each on a line of its own, if they are long."""
    given = list(items)
    if len(given) == 1:
        return f"({given[0]},)"
    inline = f"({', '.join(given)})"
    if not given or (short and len(inline) <= LONGEST_INLINE):
        return inline
    lines = "".join(f"{' ' * depth}    {each},\n" for each in given)
    return f"(\n{lines}{' ' * depth})"


def _constant(register: Register) -> str:
    signed = ", signed=True" if register.signed else ""
    layout = f', {register.bytes}, "{register.order}"' if register.bytes > 1 else ""
    made = f'ChipRegister("{register.name}", 0x{register.address:02X}{layout}{signed})'
    about = f"{register.about}; " if register.about else ""
    return f'{register.name}: Final = {made}\n"""{about}{register.source}"""'


def _identity(register: Register) -> str:
    word = f"0x{register.reset:02X}" if register.identity else "None"
    return f"Expected({register.name}, {word})"


def _setting(register: Register) -> str:
    word = register.bring_up or 0
    wait_ns = register.busy_ns if word & register.self_clearing else 0
    return f"Setting({register.name}, 0x{word:02X}, 0x{register.kept_bits:02X}, {wait_ns:_})"


def _method(register: Register) -> str:
    offset = "" if not register.offset else f" + {register.offset!r}"
    scale = "1.0" if register.scale is None else repr(register.scale)
    count = f"self.read({register.name})"
    if register.lowest_bit:
        count = f"({count} >> {register.lowest_bit})"
    return (
        f"\n\n    def read_{register.quantity}(self) -> float:\n"
        f'        """Read {register.name}, in {register.unit}: one transaction.\n\n'
        "        Raises NoAcknowledge if the chip is absent.\n"
        '        """\n'
        f"        return {count} * {scale}{offset}"
    )


def _quantity(register: Register) -> str:
    quantity = str(register.quantity)
    label = " ".join(quantity.split("_")[:-1]) or quantity
    step = abs(1.0 if register.scale is None else register.scale)
    decimals = min(9, max(0, math.ceil(-math.log10(step))))
    value = f"chip.read_{quantity}()"
    return f'Quantity("{quantity}", {value}, "{label}", "{register.unit}", {decimals})'


def _word(register: Register) -> str:
    value = f'float(chip.read_by_name("{register.name}"))'
    return f'Quantity("{register.name}", {value}, "{register.name}", "", 0)'
