"""The MPU-9250's auxiliary I2C master: SLV0 to SLV3 at every sample, SLV4 once on request.

Source: InvenSense RM-MPU-9250A rev. 1.6, I2C_MST_CTRL to I2C_SLV4_DI. Not modelled: the time its
transactions take, its clock setting, several masters, interrupts, and the AK8963 hanging when the
master is reset in the middle of a transfer.
"""

from msgspec import Struct

from sim_doubles.chips.ak8963 import Ak8963Double
from sim_doubles.chips.mpu9250_registers import (
    EXT_SENS_DATA_00,
    EXTERNAL_BYTES,
    FIFO_EN,
    I2C_MST_CTRL,
    I2C_MST_DELAY_CTRL,
    I2C_MST_EN,
    I2C_MST_STATUS,
    I2C_SLV0_ADDR,
    I2C_SLV0_DO,
    I2C_SLV4_ADDR,
    I2C_SLV4_CTRL,
    I2C_SLV4_DI,
    SLV3_FIFO,
    SLV4_DONE,
    SLV4_NACK,
    USER_CTRL,
)

READ = 0x80  # ADDR
EN, BYTE_SW, REG_DIS, GRP, LENG = 0x80, 0x40, 0x20, 0x10, 0x0F  # CTRL
MST_DLY = 0x1F  # I2C_SLV4_CTRL


class Slave(Struct, frozen=True):
    """One enabled slave: what to do for it at a sample, and where its bytes go."""

    number: int
    address: int
    register: int | None
    length: int
    reads: bool
    first_swapped: int | None
    place: int
    in_fifo: bool


class AuxiliaryMaster:
    """The master of the auxiliary bus, which has one target at most: the AK8963."""

    def __init__(self, registers: bytearray, magnetometer: Ak8963Double | None) -> None:
        self.enabled = False
        self._registers = registers
        self._magnetometer = magnetometer
        self._slaves: list[Slave] = []
        self._delayed = 0
        self._delay = 1

    def configure(self) -> None:
        """Take over the slaves as they stand in the registers."""
        registers = self._registers
        self.enabled = bool(registers[USER_CTRL] & I2C_MST_EN)
        self._delayed = registers[I2C_MST_DELAY_CTRL]
        self._delay = 1 + (registers[I2C_SLV4_CTRL] & MST_DLY)
        self._slaves = []
        place = EXT_SENS_DATA_00
        for index in range(4):
            address, register, control = registers[I2C_SLV0_ADDR + 3 * index :][:3]
            if control & EN:
                slave = self._slave(index, address, register, control, place)
                self._slaves.append(slave)
                place += slave.length if slave.reads else 0

    def run(self, at: int, number: int) -> None:
        """Carry out the transactions of sample number `number`, taken at `at`."""
        on_turn = number % self._delay == 0
        for slave in self._slaves:
            if on_turn or not self._delayed & 1 << slave.number:
                self._serve(at, slave)
        if self._registers[I2C_SLV4_CTRL] & EN and (on_turn or not self._delayed & 0x10):
            self._serve_slave_4(at)

    def fifo_bytes(self) -> bytes:
        """Return the external bytes that go into the FIFO with each sample."""
        return b"".join(
            self._registers[slave.place : self._end(slave)]
            for slave in self._slaves
            if slave.reads and slave.in_fifo
        )

    def _slave(self, index: int, address: int, register: int, control: int, place: int) -> Slave:
        in_fifo = self._registers[FIFO_EN] & 1 << index
        if index == 3:
            in_fifo = self._registers[I2C_MST_CTRL] & SLV3_FIFO
        odd_pairs = 1 if control & GRP else 0
        return Slave(
            index,
            address & ~READ,
            None if control & REG_DIS else register,
            control & LENG,
            bool(address & READ),
            (register ^ odd_pairs) & 1 if control & BYTE_SW else None,
            place,
            bool(in_fifo),
        )

    def _end(self, slave: Slave) -> int:
        return min(slave.place + slave.length, EXT_SENS_DATA_00 + EXTERNAL_BYTES)

    def _serve(self, at: int, slave: Slave) -> None:
        if not slave.reads:
            content = self._registers[I2C_SLV0_DO + slave.number]
            if not self._write(at, slave.address, slave.register, content):
                self._registers[I2C_MST_STATUS] |= 1 << slave.number
            return
        answer = self._read(at, slave.address, slave.register, slave.length)
        if answer is None:
            self._registers[I2C_MST_STATUS] |= 1 << slave.number
            return
        if slave.first_swapped is not None:
            answer = _swapped(answer, slave.first_swapped)
        end = self._end(slave)
        self._registers[slave.place : end] = answer[: end - slave.place]

    def _serve_slave_4(self, at: int) -> None:
        address, register, content, control = self._registers[I2C_SLV4_ADDR:I2C_SLV4_DI]
        pointer = None if control & REG_DIS else register
        if address & READ:
            answer = self._read(at, address & ~READ, pointer, 1)
            done = answer is not None
            if answer is not None:
                self._registers[I2C_SLV4_DI] = answer[0]
        else:
            done = self._write(at, address, pointer, content)
        self._registers[I2C_SLV4_CTRL] &= ~EN
        self._registers[I2C_MST_STATUS] |= SLV4_DONE if done else SLV4_DONE | SLV4_NACK

    def _write(self, at: int, address: int, register: int | None, content: int) -> bool:
        target = self._magnetometer
        if target is None or not target.start_from_mpu(at, address, read=False):
            return False
        done = (register is None or target.write(register)) and target.write(content)
        target.stop()
        return done

    def _read(self, at: int, address: int, register: int | None, length: int) -> bytes | None:
        target = self._magnetometer
        return None if target is None else target.read_from_mpu(at, address, register, length)


def _swapped(answer: bytes, first: int) -> bytes:
    """Swap the bytes of each whole pair, the first of which begins at index `first`."""
    swapped = bytearray(answer)
    for high in range(first, len(answer) - 1, 2):
        swapped[high], swapped[high + 1] = answer[high + 1], answer[high]
    return bytes(swapped)
