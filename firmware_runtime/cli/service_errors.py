"""Refusals and failures of `firmware-runtime service` as one sentence and an exit status."""

import argparse
import sys

from firmware_runtime.cli.arguments import Execute
from firmware_runtime.host.installation.errors import InstallationRefused, StepFailed
from firmware_runtime.status import Status


def explained(execute: Execute) -> Execute:
    """The action, with its errors explained: 2 if nothing was touched, 6 if it was begun."""

    def action(arguments: argparse.Namespace) -> int:
        try:
            return execute(arguments)
        except InstallationRefused as error:
            return _refuse(error, Status.BAD_INPUT)
        except StepFailed as error:
            return _refuse(error, Status.NOTHING_HAPPENED)

    return action


def _refuse(error: Exception, status: Status) -> int:
    print(f"firmware-runtime: {error}", file=sys.stderr)
    return status
