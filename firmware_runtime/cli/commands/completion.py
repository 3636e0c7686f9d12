"""`firmware-runtime completion bash|zsh|fish`: what lets a shell complete this command.

The script that is printed asks this very verb at each Tab, with the words so far behind `--`, so
verbs, options and boards are those of the program that is installed. Where it knows nothing, the
shell offers files.
"""

import argparse
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any

from firmware_runtime.blackbox.found import kept_recordings, last_recordings
from firmware_runtime.blackbox.listed import name_of
from firmware_runtime.board.experiments import ALL
from firmware_runtime.board.in_force import known_names
from firmware_runtime.cli.arguments import SubParsers, add_verb
from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.entry_points import installed
from firmware_runtime.errors import ConfigError
from firmware_runtime.status import Status

Words = Sequence[str]
CHIP_DOUBLES = "firmware_runtime.chip_doubles"
"""Entry points of what `--chip` names."""

BASH = """\
_firmware_runtime() {
    COMPREPLY=()
    local line
    while IFS= read -r line; do
        COMPREPLY+=("$line")
    done < <("${COMP_WORDS[0]}" completion bash -- "${COMP_WORDS[@]:1:COMP_CWORD}" 2>/dev/null)
    case "${COMPREPLY[0]-}" in *=) compopt -o nospace 2>/dev/null ;; esac
}
complete -o default -F _firmware_runtime firmware-runtime
"""
ZSH = """\
#compdef firmware-runtime
_firmware_runtime() {
    local -a found
    found=("${(@f)$("${words[1]}" completion zsh -- "${(@)words[2,CURRENT]}" 2>/dev/null)}")
    if [[ -z "${found[1]}" ]]; then
        _files
    elif [[ "${found[1]}" == *= ]]; then
        compadd -S '' -- "${found[@]}"
    else
        compadd -- "${found[@]}"
    fi
}
if [[ "${funcstack[1]}" == _firmware_runtime ]]; then
    _firmware_runtime "$@"
else
    compdef _firmware_runtime firmware-runtime
fi
"""
FISH = """\
function __firmware_runtime
    set -l before (commandline -opc)
    set -l current (commandline -ct)
    $before[1] completion fish -- $before[2..-1] "$current" 2>/dev/null
end
complete -c firmware-runtime -a '(__firmware_runtime)'
"""
SCRIPTS = {"bash": BASH, "zsh": ZSH, "fish": FISH}

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
    verb.add_argument("shell", choices=list(SCRIPTS), help="the shell that reads the script")
    words = verb.add_argument(
        "words",
        nargs=argparse.REMAINDER,  # a `--` among them is a word that is being typed
        metavar="WORD",
        help="what has been typed: print how it may go on",
    )
    words.required = False


def execute(arguments: argparse.Namespace) -> int:
    """Print the script, or one way to go on a line."""
    from firmware_runtime.cli.main import parser, verb_names  # noqa: PLC0415 -- it imports this module

    if not arguments.words:
        print(SCRIPTS[arguments.shell], end="")
        return Status.OK
    for word in candidates(arguments.words, verb_names(), parser):
        print(word)
    return Status.OK


def candidates(
    words: Words,
    verbs: Iterable[str],
    parser: Callable[[Words], argparse.ArgumentParser],
) -> list[str]:
    """How the last of these words may go on."""
    *before, current = words
    if not before and not current.startswith("-"):
        return _beginning_with(current, verbs)
    place = _Place(parser(before or ["completion"]), before)
    return _beginning_with(current, place.ways_on(current))


def _beginning_with(current: str, words: Iterable[str]) -> list[str]:
    return [word for word in words if word.startswith(current)]


class _Place:
    """Where in the command line the next word would be, after the words before it."""

    def __init__(self, parser: argparse.ArgumentParser, before: Words) -> None:
        self._parser = parser
        self._board: str | None = None
        self._wanted: argparse.Action | None = None
        self._positionals = _positionals(parser)
        for word in before:
            self._pass(word)

    def ways_on(self, current: str) -> Iterable[str]:
        """What may come here, as far as it is known."""
        if self._wanted is not None:
            return self._values(self._wanted)
        if current.startswith("-"):
            return [option for option in self._parser._option_string_actions if len(option) > 2]
        return self._values(self._positionals[0]) if self._positionals else ()

    def _pass(self, word: str) -> None:
        if self._wanted is not None:
            self._wanted = None
        elif word.startswith("-"):
            option = self._parser._option_string_actions.get(word)
            self._wanted = None if option is None or option.nargs in {0, "?"} else option
        elif self._positionals:
            first, *left = self._positionals
            if first.dest != "compared":  # of `gate`: many
                self._positionals = left
            if first.dest == "board":
                self._board = word
            if isinstance(first, argparse._SubParsersAction) and word in first.choices:
                self._parser = first.choices[word]
                self._positionals = _positionals(self._parser)

    def _values(self, action: argparse.Action) -> Iterable[str]:
        if action.choices is not None:
            return map(str, action.choices)
        if not action.option_strings and action.dest == "run":
            return _recordings(known_names())
        if action.dest in {"board", "compared"}:
            return [*known_names(), *self._beside_boards()]
        if action.dest == "experiment":
            return _experiments()
        if action.dest == "chips":
            return sorted(each.name for each in installed(CHIP_DOUBLES))
        return self._keys() if action.dest in {"assignments", "vary"} else ()

    def _beside_boards(self) -> Iterable[str]:
        """What may stand where a board may, for this verb."""
        verb = self._parser.prog.rpartition(" ")[2]
        if verb == "export":
            return _recordings(())
        return {"sweep": ("show", "rerun"), "recordings": ("keep", "recover")}.get(verb, ())

    def _keys(self) -> Iterable[str]:
        """The keys of the board that was named."""
        if self._board is None:
            return ()
        try:
            return [f"{key}=" for key in _leaves(chosen_board(self._board).table)]
        except ConfigError:
            return ()


def _experiments() -> list[str]:
    """The experiments of every kind of board that can be read, and the word for all."""
    from firmware_runtime.experiments.known import experiments_of  # noqa: PLC0415 -- for this alone

    found = {ALL}
    for name in known_names():
        with suppress(ConfigError):
            found.update(experiments_of(chosen_board(name)))
    return sorted(found)


def _recordings(boards: Iterable[str]) -> Iterable[str]:
    """Boards, each for its last run, and the names of recordings; none of them is opened."""
    with suppress(OSError):
        boards = [*boards, *map(name_of, [*last_recordings(), *kept_recordings()])]
    return dict.fromkeys(boards)


def _positionals(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    return [action for action in parser._actions if not action.option_strings]


def _leaves(table: Mapping[str, Any], prefix: str = "") -> Iterator[str]:
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{prefix}{key}.")
        else:
            yield prefix + key
