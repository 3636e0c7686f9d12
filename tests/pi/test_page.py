"""The commands of docs/raspberry-pi.md are those that the emulated computer is given."""

from tests.pi.full.page import PAGE, TABLE, commands_of


def test_of_each_command_of_the_page_it_is_said_what_becomes_of_it() -> None:
    assert set(commands_of(PAGE.read_text(encoding="utf-8"))) == set(TABLE)


def test_a_command_is_taken_from_the_page_without_the_remark_behind_it() -> None:
    page = "Say\n\n    sudo reboot    # now\n    firmware-runtime probe\n\n    not a command\n"
    assert commands_of(page) == ["sudo reboot", "firmware-runtime probe"]
