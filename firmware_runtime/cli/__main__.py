"""Lets `python -m firmware_runtime.cli` stand for the installed command."""

import sys

from firmware_runtime.cli.main import main

sys.exit(main())
