"""`python -m tests.machines`: recordings of every machine, replayed on every machine.

Prints how many values differ, a row for the machine that recorded and a column for the one that
replayed, and leaves what `replay --json` said in build/machines. What cannot be had here is named.
Exit status 0: nothing differs; 1: something does, or fewer than two machines were there to compare;
2: an environment could not be made.
`--only WORD` takes machines with this word in their name; may be repeated.
"""

import argparse
import json
import platform
import sys
from pathlib import Path

from tests.machines.environments import environment_of, wheels_of_the_project
from tests.machines.interpreters import Interpreter, interpreters
from tests.machines.matrix import (
    Machine,
    compared_functions,
    is_same,
    matrix_of,
    recorded,
    replayed,
)
from tests.vm.commands import Unbuildable, show

HOME = Path(__file__).parents[2] / "build" / "machines"


def main() -> int:
    """Build what is missing, record, replay, print."""
    options = argparse.ArgumentParser(prog="python -m tests.machines")
    options.add_argument("--only", action="append", default=[], metavar="WORD")
    only = options.parse_args().only
    try:
        return _compared(only)
    except Unbuildable as error:
        show(f"machines: {error}")
        return 2


def _compared(only: list[str]) -> int:
    wheels = wheels_of_the_project(HOME / "wheels")
    machines = []
    for each in interpreters(HOME / "roots", only):
        if not isinstance(each, Interpreter):
            show(f"not run: {each}")
        else:
            show(f"environment: {each.name}")
            program = environment_of(each, HOME / "environments", wheels)
            machines.append(Machine(each.name, program, each.machine != platform.machine()))
    if not machines:
        show("no machine to compare")
        return 1
    show(compared_functions(machines))
    runs = [run for each in machines for run in recorded(each, HOME / "recordings", show)]
    verdicts = {each.name: replayed(each, runs, show) for each in machines}
    path = HOME / "verdicts.json"
    path.write_text(json.dumps(verdicts, indent=1), encoding="utf-8")
    show(matrix_of(verdicts))
    is_identical = all(is_same(each) for found in verdicts.values() for each in found.values())
    show(f"{'identical' if is_identical else 'NOT IDENTICAL'}: {path}")
    return 0 if is_identical and len(machines) > 1 else 1


if __name__ == "__main__":
    sys.exit(main())
