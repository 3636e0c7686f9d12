"""`make pi-full-test`: a whole Debian on an emulated Raspberry Pi 3B, deployed to by ssh.

`python -m tests.pi.full.run deploy restart` carries out these steps alone; all but `deploy` begin
with the card that it left. Exit status as of `make vm-test`.
"""

import sys
from collections.abc import Callable, Iterable
from functools import partial
from typing import Final

from tests.pi.full import deploying
from tests.pi.full.cuts import CHOSEN, EACH, cuts
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


def _deployed(stand: Stand) -> Named:
    check = deploying.a_bare_computer_becomes_a_robot
    return [(check.__name__.replace("_", " "), partial(check, stand))]


STEPS: Final[dict[str, Callable[[Stand], Named]]] = {
    "deploy": _deployed,
    "cuts": partial(cuts, CHOSEN),
    "page": followed,
    "restart": deploying.switched_on_again,
    "each-cut": partial(cuts, EACH),
}
USUAL: Final = ("deploy", "cuts", "page", "restart")


def main() -> int:
    """Run all steps, or those that are named; each check says how long it took."""
    end_in_order()
    names = sys.argv[1:] or list(USUAL)
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
