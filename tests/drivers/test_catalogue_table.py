"""Chips of other packages beside ours: what is taken, and what is left out with a sentence."""

from collections.abc import Iterator
from typing import NamedTuple

import pytest
from firmware_drivers.catalogue import table
from firmware_drivers.catalogue.sensors import HMC5883L, MAXBOTIX
from firmware_drivers.catalogue.trial import Identity, OnBus


class EntryPoint(NamedTuple):
    name: str
    loaded: object

    def load(self) -> object:
        if isinstance(self.loaded, Exception):
            raise self.loaded
        return self.loaded


def evidence(_bus: object, _address: int) -> str:
    return "it says so"


MINE = OnBus(
    name="mine",
    title="a chip of my own",
    address=0x29,
    addresses=(0x29,),
    build=HMC5883L.build,
    identity=Identity("MINE", (0x29,), evidence, certain=True),
)


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[EntryPoint]]:
    found = [EntryPoint("hmc5883l", HMC5883L), EntryPoint("maxbotix", MAXBOTIX)]
    monkeypatch.setattr(table, "installed", lambda _: found)
    forget()
    yield found
    forget()


def forget() -> None:
    table.chips.cache_clear()
    table.identities.cache_clear()


def test_a_chip_of_another_package_is_tried_and_recognised_like_ours(
    installed: list[EntryPoint],
) -> None:
    installed.append(EntryPoint("mine", MINE))
    assert list(table.chips()) == ["hmc5883l", "maxbotix", "mine"]
    addresses = [min(each.addresses) for each in table.identities()]
    assert addresses == sorted(addresses)
    assert "MINE" in {each.chip for each in table.identities()}


@pytest.mark.parametrize("loaded", [ImportError("no module named x"), 3, MINE])
def test_what_cannot_be_loaded_is_left_out_with_a_sentence(
    loaded: object, installed: list[EntryPoint], capsys: pytest.CaptureFixture[str]
) -> None:
    installed.append(EntryPoint("broken", loaded))
    assert list(table.chips()) == ["hmc5883l", "maxbotix"]
    assert "chip broken left out" in capsys.readouterr().err
