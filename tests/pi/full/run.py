"""`make pi-full-test`: a whole Debian on an emulated Raspberry Pi 3B, deployed to by ssh.

`python -m tests.pi.full.run deploy reboot` carries out these steps alone; all but `deploy` begin
with the card that it left. Exit status as of `make vm-test`.
"""

import sys
from collections.abc import Callable, Iterable
from functools import partial
from typing import Final

from tests.pi.full import deploying
from tests.pi.full.cuts import EVERY, cuts
from tests.pi.full.image import KIND, built, make_card
from tests.pi.full.page import followed
from tests.pi.full.stand import Stand, card_in
from tests.pi.image import built as emulator_built
from tests.pi.image import why_impossible
from tests.pi.run import HOME as SMALL
from tests.pi.run import NEEDED as SMALL_NEEDED
from tests.pi.run import wheels_in
from tests.vm.commands import Unbuildable, end_in_order, lacking, show
from tests.vm.guest.report import Check, verdict
from tests.vm.run import stage
from tests.vm.tally import END, Tally

HOME: Final = SMALL.with_name("pi-full")
NEEDED: Final = {
    **SMALL_NEEDED,
    "mmdebstrap": "mmdebstrap",
    "qemu-aarch64-static": "qemu-user-static",
    "mke2fs": "e2fsprogs",
    "modprobe": "kmod",
    "ssh": "openssh-client",
    "rsync": "rsync",
}

Named = Iterable[tuple[str, Check]]


def _of(*checks: Callable[[Stand], str]) -> Callable[[Stand], Named]:
    return lambda stand: [
        (check.__name__.replace("_", " "), partial(check, stand)) for check in checks
    ]


STEPS: Final[dict[str, Callable[[Stand], Named]]] = {
    "deploy": _of(deploying.a_bare_computer_becomes_a_robot),
    "reboot": _of(deploying.it_comes_back_when_it_is_switched_on_again),
    "update": _of(deploying.an_update_that_proves_itself_is_committed),
    "bad": _of(
        deploying.a_build_that_does_not_start_is_taken_back,
        deploying.a_build_that_is_slow_is_taken_back,
    ),
    "cuts": partial(cuts, 1),
    **{f"cuts-{first}": partial(cuts, first) for first in range(2, EVERY + 1)},
    "page": followed,
}


def main() -> int:
    """Run all steps, or those that are named; each check says how long it took."""
    end_in_order()
    names = sys.argv[1:] or list(STEPS)
    if unknown := [name for name in names if name not in STEPS]:
        show(f"pi-full-test: {', '.join(unknown)}: no step; expected {', '.join(STEPS)}")
        return 2
    if why := why_impossible():
        show(f"pi-full-test: skipped: {why}")
        return 0
    if missing := lacking(NEEDED, "pi-full-test", "makes a file system"):
        show(f"pi-full-test: {missing}")
        return 2
    try:
        stand = _stand(is_new="deploy" in names)
    except Unbuildable as error:
        show(f"pi-full-test: {error}")
        return 1
    tally = Tally()
    for name in names:
        with stage(name):
            for what, check in STEPS[name](stand):
                tally.take(verdict(what, check))
    tally.take(END)
    show(tally.closing_line())
    return 0 if tally.has_passed else 1


def _stand(*, is_new: bool) -> Stand:
    if not is_new and not card_in(HOME, "deployed").exists():
        raise Unbuildable("no computer was deployed to; expected step deploy before")
    with stage("emulator"):
        emulator = emulator_built(SMALL, [KIND])
    with stage("image"):
        image = built(HOME / "image", emulator)
    stand = Stand(emulator, image, HOME, HOME / "wheels")
    if is_new:
        with stage("wheel and card"):
            make_card(stand.card("bare"), image, wheels_in(stand.wheels))
    return stand


if __name__ == "__main__":
    sys.exit(main())
