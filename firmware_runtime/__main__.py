"""`python -m firmware_runtime`: the command, where its script is not on the path."""

import sys

from firmware_runtime.cli.main import main

sys.exit(main())
