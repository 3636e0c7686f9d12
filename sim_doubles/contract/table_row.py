"""A row of the contract for a chip whose registers are a table: the table says what to expect."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import ClassVar, Protocol

from firmware_runtime.board.registers.register_table import Register, RegisterTable
from firmware_runtime.hal.i2c import I2cBus
from sim_doubles.chips.register_table_double import RegisterTableDouble, World
from sim_doubles.clock import Now
from sim_doubles.contract.row import Row, Step
from sim_doubles.i2c_target import Target

VALUES_SWEPT = 101


class TableDriver(Protocol):
    """Driver of such a chip; it has a method `read_QUANTITY` for each quantity, too."""

    @property
    def registers(self) -> Mapping[str, object]:
        """Its registers by their names."""

    def bring_up(self) -> Sequence[Step]:
        """Give the steps from any state to ready."""

    def verify(self) -> None:
        """Check that the chip still is as brought up. Raises NotReady."""

    def read_by_name(self, name: str) -> int:
        """Read a register."""

    def write_by_name(self, name: str, word: int) -> None:
        """Write a register."""


class TableRow(Row):
    """A subclass states the table, and how driver and double are made; the rest follows."""

    table: ClassVar[RegisterTable]

    def __init_subclass__(cls) -> None:
        """Take what the contract asks of every row from the table."""
        table = cls.table
        cls.name = table.chip
        cls.address = table.addresses[0]
        cls.wrong_identity = _wrong_identity(table)
        cls.keeps_nothing = all(
            (each.reset ^ (each.bring_up or 0)) & each.kept_bits == 0 for each in table.brought_up
        )

    def __init__(self, adapter: str = "bcm2835", *, absent: bool = False) -> None:
        super().__init__(adapter, absent=absent)
        self.driver = self.make_driver(self.bus, self.address)

    def make_driver(self, bus: I2cBus, address: int) -> TableDriver:
        """Make the driver."""
        raise NotImplementedError

    def make_double(self, now: Now, address: int, world: World) -> RegisterTableDouble:
        """Make the double."""
        raise NotImplementedError

    def build(self) -> Sequence[Target]:
        """Make the double, in a world whose quantities the row sets."""
        self.values = {
            str(each.quantity): each.value(each.count(each.reset)) for each in self.table.quantities
        }
        self.double = self.make_double(self.clock, self.address, lambda _: self.values)
        return [self.double]

    def steps(self) -> Sequence[Step]:
        """Give the driver's bring-up."""
        return self.driver.bring_up()

    def use(self) -> None:
        """Read everything that can be read."""
        for each in self.table.readable:
            self.driver.read_by_name(each.name)

    def verify(self) -> None:
        """Have the driver check its settings."""
        self.driver.verify()

    def sweep(self) -> Iterator[tuple[float, float, float]]:
        """Every quantity over its scale; without any, what the registers hold."""
        for each in self.table.quantities:
            read: Callable[[], float] = getattr(self.driver, f"read_{each.quantity}")
            for count in _spread(each.counts):
                true = each.value(count)
                self.values[str(each.quantity)] = true
                yield true, read(), abs(each.value(1) - each.value(0)) / 2 + 1e-9 * abs(true)
        for each in () if self.table.quantities else self.table.readable:
            yield self.double.word(each.name), self.driver.read_by_name(each.name), 0

    def warnings(self) -> list[str]:
        """List what the double objects to."""
        return list(self.double.warnings)

    # For the table's own checks -------------------------------------------------------------------

    def read_raw(self, address: int, length: int) -> bytes:
        """Read bytes from an address of the chip, past the driver."""
        return self.wire.write_read(self.address, bytes((address,)), length)

    def write_raw(self, register: Register, word: int) -> None:
        """Write a register, past the driver."""
        data = word.to_bytes(register.bytes, register.order)
        self.wire.write(self.address, bytes((register.address,)) + data)


def _wrong_identity(table: RegisterTable) -> tuple[int, int] | None:
    for each in table.identities:
        first = each.reset.to_bytes(each.bytes, each.order)[0]
        return each.address, first ^ 0xFF
    return None


def _spread(counts: range) -> Iterator[int]:
    last = len(counts) - 1
    return (counts[last * n // (VALUES_SWEPT - 1)] for n in range(VALUES_SWEPT))
