"""`firmware-runtime completion bash|zsh|fish`: what lets a shell complete this command."""

import argparse

from firmware_runtime.cli.arguments import SubParsers, add_verb
from firmware_runtime.errors import Status
from firmware_runtime.system.packages import module_of_extra

SHELLS = ("bash", "zsh", "fish")

_ABOUT = """
bash: put `source <(firmware-runtime completion bash)` into ~/.bashrc. zsh: the same with zsh, into
~/.zshrc after compinit. fish: `firmware-runtime completion fish >
~/.config/fish/completions/firmware-runtime.fish`.
"""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Print a script with which a shell completes this command."
    verb = add_verb(verbs, "completion", summary, execute)
    verb.epilog = _ABOUT
    verb.add_argument("shell", choices=SHELLS, help="the shell that reads the script")


def execute(arguments: argparse.Namespace) -> int:
    """Print the script, which is argcomplete's. Raises ConfigError without the extra."""
    argcomplete = module_of_extra("argcomplete", "completion")
    print(argcomplete.shellcode(["firmware-runtime"], shell=arguments.shell))
    return Status.OK
