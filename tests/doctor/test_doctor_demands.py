"""What the doctor compares the machine with comes from the board's own file."""

from firmware_runtime.board import registry
from firmware_runtime.host.doctor.registry import demands_of


def test_demands_of_tachobot() -> None:
    demands = demands_of(registry.load("tachobot", ["executive.cpus=[3]"]))
    assert demands.bus_hz == {"/dev/i2c-1": 400_000}
    assert sorted(demands.addresses["/dev/i2c-1"]) == [0x40, 0x68]
    assert demands.stretching == {"/dev/i2c-1": []}
    assert (demands.fifo_priority, demands.lock_memory, demands.cpus) == (60, True, (3,))
    assert demands.keep_cpu_awake


def test_demands_of_the_detective_name_the_chips_that_may_stretch() -> None:
    demands = demands_of(registry.load("detective"))
    assert sorted(demands.addresses["/dev/i2c-1"]) == [0x40, 0x58, 0x61, 0x62, 0x73, 0x75]
    assert set(demands.stretching["/dev/i2c-1"]) == {"srf08", "cmps12", "md25"}
    assert demands.ports == []


def test_a_chip_with_one_address_only_needs_none_in_the_file() -> None:
    board = registry.load("detective", ["radar_compass.chip='hmc5883l'"])
    assert 0x1E in demands_of(board).addresses["/dev/i2c-1"]
