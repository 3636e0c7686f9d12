"""Imports point one way; the contracts are in pyproject.toml."""

import pytest
from importlinter import cli


@pytest.mark.slow
def test_every_import_contract_is_kept() -> None:
    assert cli.lint_imports(no_cache=True) == cli.EXIT_STATUS_SUCCESS
