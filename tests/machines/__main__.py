"""`python -m tests.machines`: recordings of every machine, replayed on every machine.

Prints how many output events differ, a row for the machine that recorded and a column for the one
that replayed, and leaves the page in build/machines. What cannot be had here is named. Exit status
0: nothing differs; 1: something does, or fewer than two machines were there to compare; 2: an
environment could not be made.
`--only WORD` takes machines with this word in their name; may be repeated.
"""

import argparse
import platform
import sys
from pathlib import Path

from tests.machines.environments import environment_of, wheels_of_the_project
from tests.machines.interpreters import Interpreter, interpreters
from tests.machines.matrix import Machine, certified, compared_functions, matrix_of, recorded
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
    document = certified(machines, runs, HOME, show)
    show(matrix_of(machines, document))
    show(f"{'identical' if document['identical'] else 'NOT IDENTICAL'}: {HOME}/certificate.html")
    return 0 if document["identical"] and len(machines) > 1 else 1


if __name__ == "__main__":
    sys.exit(main())
