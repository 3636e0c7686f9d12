"""Reads a register table: every fault of the file at once, each with its key and the reason."""

import math
import re
from collections.abc import Callable, Iterator
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Final, TypeAlias

from firmware_runtime.board import strict
from firmware_runtime.board.registers.register_table import Register, RegisterTable
from firmware_runtime.errors import ConfigError
from firmware_runtime.system.atomic_file import read_text

TAKEN: Final = frozenset({"ADDRESSES", "REGISTERS", "IDENTITY", "BRING_UP", "by_name"})
"""Names that the driver has for something else."""
_NAME: Final = re.compile(r"[A-Z][A-Z0-9_]{0,40}")
_QUANTITY: Final = re.compile(r"[a-z][a-z0-9_]{0,40}")
_NOT_IN_TEXTS: Final = re.compile(r'[\x00-\x1f\x7f"\\|]')
"""Texts go into sources and tables as they are."""


def load_table(path: Path | Traversable) -> RegisterTable:
    """Read a table. Raises ConfigError with every fault found."""
    text = read_text(path) if isinstance(path, Path) else path.read_text("utf-8")
    return parse_table(text, str(path))


def parse_table(text: str, where: str) -> RegisterTable:
    """Read a table from its text. Raises ConfigError with every fault found."""
    faults: list[str] = []
    raw = strict.parse_toml(text, faults)
    table = None if faults else strict.convert(raw, RegisterTable, faults)
    if table is None:
        raise ConfigError(where, faults)
    faults += _faults(table)
    if faults:
        raise ConfigError(where, faults)
    return table


# What cannot be --------------------------------------------------------------------------------


def _faults(table: RegisterTable) -> Iterator[str]:
    yield from _text_faults(table, "chip", "title", "source")
    for index, each in enumerate(table.registers):
        where = f"registers[{index}]"
        for fault in _faults_of(each):
            yield f"{where}.{fault}"
        if table.span(each)[-1] > 0xFF:
            yield f"{where}.address: 0x{each.address:02x}: 16 bits of it end beyond 0xff"
    yield from _doubled(table)
    if not table.readable:
        yield "registers: none can be read; expected one, so that an absent chip is noticed"


def _doubled(table: RegisterTable) -> Iterator[str]:
    """Yield what two registers have, and only one can."""
    names: dict[str, int] = {}
    quantities: dict[str, int] = {}
    addresses: dict[int, str] = {}
    for index, each in enumerate(table.registers):
        if names.setdefault(each.name, index) != index:
            yield f"registers[{index}].name: {each.name} is that of registers[{names[each.name]}]"
        quantity = each.quantity
        if quantity is not None and quantities.setdefault(quantity, index) != index:
            other = quantities[quantity]
            yield f"registers[{index}].quantity: {quantity} is that of registers[{other}]"
        for address in table.span(each):
            taken_by = addresses.setdefault(address, f"[{index}]")
            if taken_by != f"[{index}]":
                yield f"registers[{index}].address: 0x{address:02x} is taken by registers{taken_by}"
                break
    if len(set(table.addresses)) != len(table.addresses):
        yield "addresses: one of them twice; expected each once"


def _text_faults(table: RegisterTable | Register, *keys: str) -> Iterator[str]:
    for key in keys:
        text = getattr(table, key)
        if text is not None and (not text.strip() or _NOT_IN_TEXTS.search(text)):
            expected = "expected one line without double quotes, backslashes and bars"
            yield f"{key}: {strict.shown(text)}: {expected}"


def _name_faults(register: Register) -> Iterator[str]:
    name, quantity = register.name, register.quantity
    if not _NAME.fullmatch(name):
        yield f"name: {strict.shown(name)}: expected capital letters, digits and _, 41 at most"
    if quantity is not None and not _QUANTITY.fullmatch(quantity):
        expected = "expected small letters, digits and _, 41 at most, such as light_lx"
        yield f"quantity: {strict.shown(quantity)}: {expected}"
    for key, word in (("name", name), ("quantity", quantity)):
        if word in TAKEN:
            yield f"{key}: {word}: the driver has it for something else; expected another"


def _faults_of(register: Register) -> Iterator[str]:
    yield from _name_faults(register)
    yield from _text_faults(register, "source", "about", "unit")
    for key in ("reset", "writable", "bring_up", "clear_on_read", "self_clearing"):
        word = getattr(register, key)
        if word is not None and word > register.all_bits:
            yield f"{key}: 0x{word:x}: more than {register.width} bits"
    for key in ("unit", "scale", "offset", "signed"):
        if register.quantity is None and getattr(register, key) is not None:
            yield f"{key}: has no effect without quantity"
    for key, reason, is_wrong in _RULES:
        if is_wrong(register):
            yield f"{key}: {reason}"


_Rule: TypeAlias = tuple[str, str, Callable[[Register], bool]]
_RULES: Final[tuple[_Rule, ...]] = (
    ("byte_order", "has no effect on 8 bits", lambda r: r.width == 8 and r.byte_order is not None),
    (
        "writable",
        "has no effect; access is r",
        lambda r: r.access == "r" and r.writable is not None,
    ),
    (
        "identity",
        "is the power-up value read back; expected access r",
        lambda r: r.identity and r.access != "r",
    ),
    (
        "bring_up",
        "is written and read back; expected access rw",
        lambda r: r.bring_up is not None and r.access != "rw",
    ),
    (
        "clear_on_read",
        "happens on reading; expected access r or rw",
        lambda r: r.clear_on_read > 0 and r.access == "w",
    ),
    (
        "clear_on_read",
        "an identity always reads the same; expected one of the two",
        lambda r: r.clear_on_read > 0 and r.identity,
    ),
    (
        "self_clearing",
        "is for bits that are written; expected access w or rw",
        lambda r: r.self_clearing > 0 and r.access == "r",
    ),
    (
        "self_clearing",
        "and clear_on_read: the same bits; expected them in one of the two",
        lambda r: r.self_clearing & r.clear_on_read > 0,
    ),
    (
        "busy_us",
        "has no effect without self_clearing",
        lambda r: r.busy_us > 0 and r.self_clearing == 0,
    ),
    (
        "quantity",
        "is read; expected access r, and no clear_on_read",
        lambda r: r.quantity is not None and (r.access != "r" or r.clear_on_read > 0),
    ),
    (
        "quantity",
        "changes, an identity does not; expected one of the two",
        lambda r: r.quantity is not None and r.identity,
    ),
    (
        "unit",
        "missing; expected that of the quantity",
        lambda r: r.quantity is not None and r.unit is None,
    ),
    (
        "lowest_bit",
        "has no effect without quantity",
        lambda r: r.lowest_bit > 0 and r.quantity is None,
    ),
    (
        "lowest_bit",
        "leaves no bit for the count; expected less than width",
        lambda r: r.lowest_bit >= r.width,
    ),
    (
        "scale",
        "expected a finite number other than 0",
        lambda r: r.scale is not None and not (math.isfinite(r.scale) and r.scale != 0),
    ),
)
