"""One target under atheris, in a process of its own.

    python -m tests.reliability.fuzz_one NAME [OPTION...] [FOLDER...]

What follows the name are libFuzzer's options and folders of inputs. It ends with 77 at the first
finding, whose input it keeps.
"""

import sys
from contextlib import ExitStack

import atheris

with atheris.instrument_imports(
    include=["firmware_runtime", "firmware_drivers", "firmware_boards", "sim_doubles", "tomllib"],
):
    from tests.reliability.fuzz_targets import built


def main() -> None:
    """Fuzz until libFuzzer's options say that it is enough."""
    name, *options = sys.argv[1:]
    stack = ExitStack()
    one = built(name, stack)
    atheris.Setup([sys.argv[0], *options], one)
    with stack:
        atheris.Fuzz()


if __name__ == "__main__":
    main()
