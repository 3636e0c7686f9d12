"""A register table as a page.

Called as `python -m firmware_runtime.host.scaffold.register_page FILE.toml`.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

from firmware_runtime.board.registers.register_file import load_table
from firmware_runtime.board.registers.register_table import Register, RegisterTable
from firmware_runtime.errors import ConfigError, Status

_HEAD = (
    "| address | register | access | bits | after power-up | what | source |\n"
    "|---|---|---|---|---|---|---|\n"
)


def page(table: RegisterTable) -> str:
    """The page, in Markdown."""
    addresses = ", ".join(f"0x{each:02x}" for each in table.addresses)
    pointer = "goes on after each byte" if table.auto_increment else "stays where it is"
    refused = table.reserved == "refused"
    reserved = "is not acknowledged" if refused else f"reads 0x{table.reserved:02x}"
    rows = "".join(f"{_row(each)}\n" for each in sorted(table.registers, key=lambda r: r.address))
    return (
        f"# {table.chip}, {table.title}\n\n"
        f"Source: {table.source}. On the bus at {addresses}. The register pointer {pointer}; an "
        f"address without a register {reserved}.\n\n{_HEAD}{rows}"
    )


def _row(register: Register) -> str:
    bits = f"{register.width}" + (f", {register.order} end first" if register.width == 16 else "")
    reset = f"0x{register.reset:0{register.width // 4}x}"
    what = "; ".join(_sentences(register))
    cells = (
        *(f"0x{register.address:02x}", register.name, register.access, bits),
        *(reset, what, register.source),
    )
    return f"| {' | '.join(cells)} |"


def _sentences(register: Register) -> Iterator[str]:
    if register.about is not None:
        yield register.about
    if register.identity:
        yield "identifies the chip"
    if register.quantity is not None:
        sign = "signed" if register.signed else "unsigned"
        step = 1.0 if register.scale is None else register.scale
        offset = f" from {register.offset:g}" if register.offset else ""
        begins = f", from bit {register.lowest_bit} on" if register.lowest_bit else ""
        yield f"`{register.quantity}`: {step:g} {register.unit} a count{offset}, {sign}{begins}"
    if register.bring_up is not None:
        yield f"0x{register.bring_up:02x} is written at bring-up"
    if "w" in register.access and register.writable is not None:
        yield f"bits 0x{register.writable:02x} can be written"
    if register.self_clearing:
        bits, busy_us = register.self_clearing, register.busy_us
        yield f"bits 0x{bits:02x} clear by themselves after {busy_us:g} us"
    if register.clear_on_read:
        yield f"bits 0x{register.clear_on_read:02x} are cleared by reading"


def main() -> int:
    """Print the page of the table whose file is named."""
    try:
        sys.stdout.write(page(load_table(Path(sys.argv[1]))))
    except ConfigError as error:
        sys.stderr.write(f"{error}\n")
        return Status.BAD_INPUT
    return Status.OK


if __name__ == "__main__":
    sys.exit(main())
