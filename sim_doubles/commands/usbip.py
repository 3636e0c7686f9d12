"""`firmware-runtime doubles usbip BOARD`: doubles behind a real `/dev/i2c-N`."""

import argparse
from pathlib import Path

from firmware_runtime.cli.arguments import SubParsers, add_output_log, add_verb
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.system.messages import Notices
from firmware_runtime.system.signals import stop_on_signals
from sim_doubles.commands.chosen import Chosen, add_choice, chosen
from sim_doubles.served.logs import OutputLog
from sim_doubles.served.server import DoublesServer, RealClock
from sim_doubles.served.service import DoublesService
from sim_doubles.usbip.host_controller import load_modules
from sim_doubles.usbip.plugged import plugged_in

_ABOUT = """
Each I2C bus of the board, or the one of the chips, becomes an adapter of this machine, by a USB
device that exists in this process only: any program can use it, i2c-tools and smbus2 as well as
`run`, through the kernel's own I2C stack. It needs root and the modules vhci-hcd, i2c-tiny-usb and
i2c-dev. A signal ends it and takes the adapters away. A transaction takes longer than on a real
bus.
"""


def add_usbip_to(actions: SubParsers) -> None:
    """Add this action of `doubles`."""
    summary = "Plug doubles of a board, or of chips, into this machine as real I2C adapters."
    verb = add_verb(actions, "usbip", summary, execute)
    verb.epilog = _ABOUT
    add_choice(verb)
    verb.add_argument(
        "--socket",
        type=Path,
        metavar="PATH",
        help="where `doubles fault` finds them; default: /run/BOARD.doubles, or /run/chips.doubles",
    )
    add_output_log(verb)


def execute(arguments: argparse.Namespace) -> int:
    """Serve until a signal comes."""
    clock = RealClock()
    doubles = chosen(arguments, clock)
    _refuse_ports(doubles)
    load_modules()
    name, rig = doubles
    path = arguments.socket or Path(f"/run/{name}.doubles")
    for double in rig.buses.values():
        double.be_behind("i2c-tiny-usb")
    with OutputLog(arguments.log, rig) as log:
        service = DoublesService(name, rig, clock, log)
        with (
            DoublesServer(path, service, log, clock) as server,
            stop_on_signals(lambda _signal: server.stop()),
        ):
            log.event(0, "serving", board=name, monotonic_ns=clock.started_at)
            with plugged_in(name, list(rig.buses), service, server, clock) as devices:
                for bus, device in devices.items():
                    log.event(clock(), "attached", bus=bus, device=str(device))
                    print(f"{name}: {bus} is {device}", flush=True)
                Notices.from_environment().ready()
                server.serve()
            log.event(clock(), "stopped")
    return Status.OK


def _refuse_ports(doubles: Chosen) -> None:
    faults = [
        f"ports.{name}: a serial port, expected I2C buses only; `doubles serve` has ports too"
        for name in doubles.rig.ports
    ]
    if faults:
        raise ConfigError(doubles.name, faults)
