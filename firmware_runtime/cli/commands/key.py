"""`firmware-runtime key FILE`: a new key for the two ends of a link, or for a bridge."""

import argparse
from pathlib import Path

from firmware_runtime.cli.arguments import SubParsers, add_verb
from firmware_runtime.errors import Status
from firmware_runtime.links.key_file import KEY_BYTES, write_key

_ABOUT = """
Both ends need the same key: copy the file over a channel that is secret, such as
`scp -p FILE robot:`. Its mode stays 0600, or it is refused.
"""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Make a key file, with which two ends on a network know each other's datagrams."
    verb = add_verb(verbs, "key", summary, execute)
    verb.epilog = _ABOUT
    verb.add_argument("file", type=Path, metavar="FILE", help="where; it must not exist yet")


def execute(arguments: argparse.Namespace) -> int:
    """Make the file and say so."""
    write_key(arguments.file)
    print(f"{arguments.file}: a new key of {KEY_BYTES} random bytes, mode 0600")
    return Status.OK
