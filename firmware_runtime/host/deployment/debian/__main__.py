"""`make deb`: builds the Debian package into dist/."""

import argparse
import sys
from pathlib import Path

from firmware_runtime.host.deployment.commands import Commands
from firmware_runtime.host.deployment.debian.build import build, platform_for
from firmware_runtime.host.deployment.errors import DeploymentError


def main() -> int:
    """Build it; say in one sentence why that was not possible."""
    parser = argparse.ArgumentParser(prog="make deb", description=__doc__)
    parser.add_argument("--architecture", metavar="ARCH", help="amd64 or arm64; default: ours")
    parser.add_argument("--python-version", metavar="X.Y", help="default: that of /usr/bin/python3")
    parser.add_argument("--into", type=Path, default=Path("dist"), metavar="DIR")
    arguments = parser.parse_args()
    commands = Commands(_log)
    try:
        platform = platform_for(commands, arguments.architecture, arguments.python_version)
        _log(f"{build(commands, platform, arguments.into)}, for {platform}")
    except DeploymentError as error:
        sys.stderr.write(f"make deb: {error}\n")
        return 1
    return 0


def _log(line: str) -> None:
    sys.stdout.write(f"{line}\n")


if __name__ == "__main__":
    raise SystemExit(main())
