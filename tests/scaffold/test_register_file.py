"""Register tables: every fault at once with key and reason."""

from pathlib import Path

import pytest

from firmware_runtime.board.registers.register_file import load_table, parse_table
from firmware_runtime.errors import ConfigError
from sim_doubles.chips.register_table_double import RegisterTableDouble
from sim_doubles.i2c_bus import I2cBusDouble
from tests.support.table_chip import ABOVE_FLAGS, EIGHT_BITS, WORDS, table_of

HEAD = """
chip = "X"
title = "x"
source = "none"
addresses = [0x29]
auto_increment = true
reserved = 0
"""


def faults(text: str) -> list[str]:
    with pytest.raises(ConfigError) as refused:
        parse_table(text, "x.toml")
    return [fault.partition(": ")[0] for fault in refused.value.faults]


def with_registers(*registers: str) -> str:
    rows = "".join(f"[[registers]]\nsource = '1'\n{each}\n" for each in registers)
    return f"{HEAD}{rows}"


READABLE = "name='R'\naddress=0\naccess='r'\nreset=0"


@pytest.mark.parametrize(
    ("register", "key"),
    [
        ("name='R R'\naddress=0\naccess='r'\nreset=0", "name"),
        ("name='REGISTERS'\naddress=0\naccess='r'\nreset=0", "name"),
        ("name='R'\naddress=256\naccess='r'\nreset=0", "address"),
        ("name='R'\naddress=255\naccess='r'\nreset=0\nwidth=16", "address"),
        ("name='R'\naddress=0\naccess='x'\nreset=0", "access"),
        ("name='R'\naddress=0\naccess='r'\nreset=256", "reset"),
        ("name='R'\naddress=0\naccess='r'\nreset=0\nwidth=12", "width"),
        (f"{READABLE}\nbyte_order='big'", "byte_order"),
        (f"{READABLE}\nwritable=1", "writable"),
        (f"{READABLE}\nbring_up=1", "bring_up"),
        (f"{READABLE}\nself_clearing=1", "self_clearing"),
        (f"{READABLE}\nclear_on_read=256", "clear_on_read"),
        (f"{READABLE}\nclear_on_read=1\nidentity=true", "clear_on_read"),
        (f"{READABLE}\nbusy_us=1", "busy_us"),
        (f"{READABLE}\nunit='m'", "unit"),
        (f"{READABLE}\nscale=1.0", "scale"),
        (f"{READABLE}\noffset=1.0", "offset"),
        (f"{READABLE}\nsigned=true", "signed"),
        (f"{READABLE}\nlowest_bit=3", "lowest_bit"),
        (f"{READABLE}\nlowest_bit=8\nquantity='length_m'\nunit='m'", "lowest_bit"),
        (f"{READABLE}\nquantity='Length m'\nunit='m'", "quantity"),
        (f"{READABLE}\nquantity='length_m'", "unit"),
        (f"{READABLE}\nquantity='length_m'\nunit='m'\nscale=0.0", "scale"),
        (f"{READABLE}\nquantity='length_m'\nunit='m'\nidentity=true", "quantity"),
        (f"{READABLE}\nabout='a | b'", "about"),
        (f"{READABLE}\nabout=' '", "about"),
        (f"{READABLE}\nquantity='by_name'\nunit='m'", "quantity"),
        (f"{READABLE}\nadress=1", "adress"),
        ("name='R'\naddress=0\naccess='rw'\nreset=0\nidentity=true", "identity"),
        (
            "name='R'\naddress=0\naccess='rw'\nreset=0\nself_clearing=3\nclear_on_read=2",
            "self_clearing",
        ),
    ],
)
def test_a_register_that_cannot_be_is_named_by_its_key(register: str, key: str) -> None:
    assert faults(with_registers(register)) == [f"registers[0].{key}"]


def test_all_faults_are_listed_at_once() -> None:
    found = faults(
        with_registers(
            "name='A'\naddress=0\naccess='r'\nreset=0\nwidth=16",
            "name='A'\naddress=1\naccess='r'\nreset=999",
            "name='B'\naddress=3\naccess='r'\nreset=0\nquantity='x_m'\nunit='m'",
            "name='C'\naddress=4\naccess='r'\nreset=0\nquantity='x_m'\nunit='m'",
        ).replace("[0x29]", "[0x29, 0x29]")
    )
    assert found == [
        *("registers[1].reset", "registers[1].name", "registers[1].address"),
        *("registers[3].quantity", "addresses"),
    ]


@pytest.mark.parametrize(
    ("text", "keys"),
    [
        ("", ["chip", "title", "source", "addresses", "auto_increment", "reserved", "registers"]),
        ("chip = ", ["not valid TOML"]),
        (HEAD + "registers = []", ["registers"]),
        (with_registers("name='W'\naddress=0\naccess='w'\nreset=0"), ["registers"]),
        (with_registers(READABLE).replace("[0x29]", "[0x03]"), ["addresses"]),
        (with_registers(READABLE).replace('"none"', "'a\\b'"), ["source"]),
        (with_registers(READABLE).replace("reserved = 0", "reserved = 'zero'"), ["reserved"]),
    ],
)
def test_a_table_that_cannot_be_is_named_by_its_keys(text: str, keys: list[str]) -> None:
    assert faults(text) == keys


def test_a_file_that_is_not_there_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "binary.toml").write_bytes(b"\xff")
    for path in (tmp_path / "none.toml", tmp_path, tmp_path / "binary.toml"):
        with pytest.raises(ConfigError, match="cannot be read"):
            load_table(path)


def test_words_of_16_bits_take_two_addresses_only_where_the_pointer_goes_on() -> None:
    words = table_of(WORDS)
    assert words.free == [*range(3, 256)]
    eight_bits = table_of(EIGHT_BITS)
    assert eight_bits.free[:5] == [3, 6, 7, 9, 10]


def test_counts_and_words_and_values_agree_over_the_whole_scale() -> None:
    data = table_of(EIGHT_BITS).registers[3]
    for count in data.counts:
        word = count & 0xFFFF
        assert data.count(word) == count
        assert data.word(data.value(count)) == word


def test_counts_above_flags_have_the_bits_that_are_left() -> None:
    supply, shunt = table_of(ABOVE_FLAGS).registers
    assert (supply.counts, shunt.counts) == (range(1 << 13), range(-(1 << 11), 1 << 11))
    for register in (supply, shunt):
        for count in register.counts:
            word = register.word(register.value(count))
            assert register.count(word) == register.count(word | 0b101) == count
    assert supply.word(1e9) == 0xFFF8


def test_flags_stay_when_the_double_measures() -> None:
    double = RegisterTableDouble(
        lambda: 0, table_of(ABOVE_FLAGS), 0x41, {"supply_v": 12.0, "shunt_mv": -1.0}
    )
    bus = I2cBusDouble("i2c1", lambda: 0, [double])
    assert bus.transaction(0x41, [b"\x02", 2]) == (3000 << 3 | 0b101).to_bytes(2)
    double.put("SUPPLY", 0b010)
    assert bus.transaction(0x41, [b"\x02", 2]) == (3000 << 3 | 0b010).to_bytes(2)
    assert bus.transaction(0x41, [b"\x03", 2]) == b"\xff\xf0"
