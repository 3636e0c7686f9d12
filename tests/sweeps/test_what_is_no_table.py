"""A file that is no sweep's table, or one that was spoiled, is refused in a sentence."""

from pathlib import Path

import pytest

from firmware_runtime.cli.main import main

HEAD = "row,board,set,outcome"


@pytest.mark.parametrize("verb", ["show", "rerun"])
@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("", "it has no rows"),
        ("a,b\n1,2\n", "rows without a number"),
        (f"{HEAD}\n0,,,ended\n", "row 0 has no board"),
        ("row,set,outcome\n0,,ended\n", "row 0 has no board"),
        ("row,board,set\n0,tachobot,\n", "row 0 has no outcome"),
        (f"{HEAD}\n0,tachobot,,\n", "row 0 has no outcome"),
        (f"{HEAD}\n0,tachobot,[garbage,ended\n", "what row 0 has set is no list"),
        (f'{HEAD}\n0,tachobot,"{{""a"": 1}}",ended\n', "what row 0 has set is no list"),
        (f"{HEAD}\n0,tachobot\n", "not whole"),
        (f"{HEAD}\n0,tachobot,,ended,5\n", "not whole"),
        (f'{HEAD}\n0,"tachobot"x,,ended\n', "not whole"),
    ],
)
def test_what_is_no_table_is_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, verb: str, text: str, fault: str
) -> None:
    path = tmp_path / "table.csv"
    path.write_text(text, encoding="utf-8")
    assert main(["sweep", verb, str(path), *(["0"] if verb == "rerun" else [])]) == 2
    refused = capsys.readouterr().err
    assert fault in refused
    assert "expected one that `sweep` has written" in refused
