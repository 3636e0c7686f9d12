"""The scripts that run on a target, here, with a program that does as it is set."""

import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import firmware_runtime.host.deployment
from firmware_runtime.host.deployment.deployment import SIGNED_FOR, WAY_BACK
from firmware_runtime.host.deployment.environment import seal
from tests.support.ssh_target import make_key

FOLDER = Path(firmware_runtime.host.deployment.__file__).parent
SENT = (
    ("venvs.sh", "units.sh", "probe.sh"),
    ("venvs.sh", "signatures.sh", "prepare.sh"),
    ("venvs.sh", "examine.sh"),
    ("venvs.sh", "units.sh", "robots.sh", "update.sh", "signatures.sh", "switch.sh"),
    ("venvs.sh", "units.sh", "robots.sh", "update.sh", "persisted.sh"),
)
PROGRAM = """\
#!/bin/sh
echo "$@" >>{log}
case $1 in
check) exit {check} ;;
doctor) exit {doctor} ;;
service)
	[ "$3" != --help ] || exit 0
	[ "$2" != health ] || {{ echo "firmware-runtime: two faults"; exit {health}; }}
	echo installed || exit 9; printf {name} >{unit}; exit {service}
	;;
esac
"""


NOTED = """\
#!/bin/sh
echo "{name} $*" >>{log}
exec {real} "$@"
"""


@pytest.fixture(autouse=True)
def noted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """What was moved and when the disk was waited for, which a test does not."""
    tools, log = tmp_path / "tools", tmp_path / "noted"
    tools.mkdir()
    for name, real in (("sync", "true"), ("mv", shutil.which("mv")), ("systemctl", "true")):
        tool = tools / name
        tool.write_text(NOTED.format(name=name, log=log, real=real))
        tool.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tools}:{os.environ['PATH']}")
    return log


def run(names: tuple[str, ...], *arguments: object) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        ["sh", "-s", "--", *map(str, arguments)],
        input="".join((FOLDER / name).read_text() for name in names),
        capture_output=True,
        text=True,
        check=False,
    )


def make_venv(
    home: Path,
    name: str,
    *,
    check: int = 0,
    doctor: int = 0,
    service: int = 0,
    health: int = 0,
    unit: Path = Path(os.devnull),
    settings: str = "",
) -> Path:
    """A virtual environment whose program ends with these statuses, and notes what was asked.

    As a service it installs a unit with its name in it. It brings settings, if there are any.
    """
    program = home / name / "bin" / "firmware-runtime"
    program.parent.mkdir(parents=True)
    log = home / f"{name}.log"
    ends = {"check": check, "doctor": doctor, "service": service, "health": health}
    program.write_text(PROGRAM.format(log=log, unit=unit, name=name, **ends))
    program.chmod(0o755)
    scripts = home / name / "deployment" / "scripts"
    scripts.mkdir(parents=True)
    for each in ("venvs.sh", "units.sh", "robots.sh", "update.sh", "persisted.sh"):
        shutil.copy(FOLDER / each, scripts)
    shutil.copy(FOLDER.parent / "installation/units" / WAY_BACK, scripts)
    if settings:
        place = home / name / "deployment" / "settings" / "tachobot.toml"
        place.parent.mkdir()
        place.write_text(settings)
    write_manifest(home / name)
    return home / name


def write_manifest(venv: Path) -> None:
    (venv / "manifest.sent").write_text(seal(venv))
    in_venvs(f'finish_venv "{venv}" /usr/bin/python3 yes')


def in_venvs(words: str) -> str:
    """What these words print behind the functions of virtual environments."""
    script = f"{(FOLDER / 'venvs.sh').read_text()}\n{words}\n"
    done = subprocess.run(["sh", "-s"], input=script, capture_output=True, text=True, check=True)
    return done.stdout


@pytest.mark.parametrize(
    ("check", "doctor", "force", "status"),
    [
        (0, 0, "no", 0),
        (0, 7, "no", 0),
        (0, 8, "no", 8),
        (0, 8, "yes", 0),
        (2, 0, "no", 1),
        (2, 0, "yes", 1),
    ],
)
def test_a_program_stays_if_it_passes_or_is_forced(
    tmp_path: Path, check: int, doctor: int, force: str, status: int
) -> None:
    venv = make_venv(tmp_path, "venv.abcdef", check=check, doctor=doctor)
    assert run(SENT[2], venv, "tachobot", force).returncode == status
    assert venv.exists() == (status == 0)


@pytest.fixture
def home(tmp_path: Path) -> Path:
    """Where programs are, below a root, with one in use."""
    place = tmp_path / "opt" / "firmware-runtime"
    make_venv(place, "venv.before")
    (place / "venv").symlink_to(place / "venv.before")
    return place


def switch(
    home: Path, venv: Path, start: str = "yes", whence: str = "sent"
) -> "subprocess.CompletedProcess[str]":
    return run(SENT[3], home.parents[1], venv, "tachobot", start, 30, whence)


def test_a_new_program_takes_the_place_and_the_one_before_is_kept(home: Path) -> None:
    orphan, venv = make_venv(home, "venv.orphan"), make_venv(home, "venv.newest")
    under_way = make_venv(home, "venv.others")
    os.utime(orphan, (0, 0))
    assert switch(home, venv).returncode == 0
    assert (home / "venv").readlink() == venv
    assert (home / "previous").readlink() == home / "venv.before"
    assert not orphan.exists()
    assert under_way.exists()
    link = home.parents[1] / "usr" / "local" / "bin" / "firmware-runtime"
    assert link.resolve() == venv / "bin" / "firmware-runtime"
    asked = f"service install tachobot --root {home.parents[1]}\n"
    assert (home / "venv.newest.log").read_text() == asked


def test_a_service_that_is_not_to_be_started_is_installed_and_no_more(home: Path) -> None:
    assert switch(home, make_venv(home, "venv.newest"), start="no").returncode == 0
    asked = f"service install tachobot --root {home.parents[1]} --no-start\n"
    assert (home / "venv.newest.log").read_text() == asked


def test_a_service_that_does_not_start_brings_program_and_settings_from_before_back(
    home: Path,
) -> None:
    there = settings_there(home)
    venv = make_venv(home, "venv.newest", service=6, settings="new")
    ended = switch(home, venv)
    assert ended.returncode == 1
    assert (home / "venv").readlink() == home / "venv.before"
    assert not venv.exists()
    assert there.read_text() == "old"
    assert "the one from before is back" in ended.stderr


def test_the_first_program_stays_when_its_service_does_not_start(
    home: Path,
) -> None:
    (home / "venv").unlink()
    venv = make_venv(home, "venv.newest", service=6)
    ended = switch(home, venv)
    assert ended.returncode == 1
    assert (home / "venv").readlink() == venv
    assert "see firmware-runtime service logs tachobot" in ended.stderr


def test_what_was_begun_is_finished_when_the_connection_is_lost(home: Path) -> None:
    venv = make_venv(home, "venv.newest")
    text = "".join((FOLDER / name).read_text() for name in SENT[3])
    words = ["sh", "-s", "--", str(home.parents[1]), str(venv), "tachobot", "yes", "30", "sent"]
    with subprocess.Popen(
        words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdout.close()
        process.stdin.write(text)
        process.stdin.close()
        assert process.wait() == 0
    assert (home / "venv").readlink() == venv
    assert (home.parents[1] / "usr/local/bin/firmware-runtime").is_symlink()


def settings_there(home: Path) -> Path:
    """The settings in force, which are old."""
    there = home.parents[1] / "etc" / "firmware-runtime" / "tachobot.toml"
    there.parent.mkdir(parents=True)
    there.write_text("old")
    return there


def test_settings_that_came_along_replace_those_there_and_keep_them(home: Path) -> None:
    there = settings_there(home)
    assert switch(home, make_venv(home, "venv.newest", settings="new")).returncode == 0
    assert there.read_text() == "new"
    assert there.with_name("tachobot.toml.previous").read_text() == "old"


def test_a_program_that_has_gone_is_not_switched_to(home: Path) -> None:
    ended = switch(home, home / "venv.gone")
    assert "deploy again" in ended.stderr
    assert (home / "venv").readlink() == home / "venv.before"


def empty(file: Path) -> None:
    file.write_bytes(b"")


@pytest.mark.parametrize("damage", [empty, Path.unlink], ids=["an empty file", "a missing one"])
def test_a_program_that_is_not_whole_is_not_switched_to(
    home: Path, damage: Callable[[Path], None]
) -> None:
    venv = make_venv(home, "venv.newest")
    damage(venv / "bin" / "firmware-runtime")
    ended = switch(home, venv)
    assert (ended.returncode, ended.stdout) == (1, "")
    assert "deploy again" in ended.stderr
    assert (home / "venv").readlink() == home / "venv.before"


def test_the_link_moves_when_all_is_on_the_disk(home: Path, noted: Path) -> None:
    venv = make_venv(home, "venv.newest")
    assert switch(home, venv).returncode == 0
    done = noted.read_text().splitlines()
    moved = done.index(f"mv -T {home}/venv.link {home}/venv")
    assert done.index("mv manifest.sent manifest") < moved
    assert done[moved - 1] == done[moved + 1] == f"sync -f {home}"


def cut_at(step: int, home: Path, tools: Path, venv: Path) -> int:
    """Switch, and end everything before that step of what changes the disk; its status."""
    steps = tools.with_name("steps")
    steps.unlink(missing_ok=True)
    for name in ("ln", "mv", "cp", "sync", "tar", "rm", "mkdir"):
        tool = tools / name
        real = "/bin/true" if name == "sync" else shutil.which(name, path="/usr/bin:/bin")
        tool.write_text(CUT.format(steps=steps, step=step, real=real))
        tool.chmod(0o755)
    text = "".join((FOLDER / name).read_text() for name in SENT[3])
    words = ["sh", "-s", "--", str(home.parents[1]), str(venv), "tachobot", "yes", "30", "sent"]
    ended = subprocess.run(
        words, input=text, text=True, capture_output=True, start_new_session=True, check=False
    )
    for name in ("ln", "mv", "cp", "sync", "tar", "rm", "mkdir"):
        (tools / name).unlink()
    return ended.returncode


CUT = """\
#!/bin/sh
echo step >>{steps}
[ "$(wc -l <{steps})" != {step} ] || kill -9 0
exec {real} "$@"
"""


@pytest.mark.slow
def test_wherever_the_power_is_cut_there_is_a_whole_version_afterwards(
    tmp_path: Path, home: Path, noted: Path
) -> None:
    """With its own units and settings; the state says which."""
    root, tools = home.parents[1], noted.with_name("tools")
    there = settings_there(home)
    unit = root / "etc/systemd/system/firmware-runtime@.service"
    unit.parent.mkdir(parents=True)
    unit.write_text("venv.before")
    kept = tmp_path / "kept"
    shutil.copytree(home.parents[1] / "etc", kept / "etc", symlinks=True)
    shutil.copytree(home, kept / "home", symlinks=True)
    states: dict[str, int] = {}
    for step in range(1, 100):
        shutil.rmtree(root / "etc")
        shutil.rmtree(home)
        shutil.copytree(kept / "etc", root / "etc", symlinks=True)
        shutil.copytree(kept / "home", home, symlinks=True)
        venv = make_venv(home, "venv.newest", unit=unit, settings="new")
        ended = cut_at(step, home, tools, venv)
        if (home / "update.sh").exists():
            # what was killed lets go of it when the kernel has ended it
            subprocess.run(["flock", home / "update.lock", "true"], check=True)
            booted = subprocess.run(
                ["sh", str(home / "update.sh"), "boot"], capture_output=True, text=True, check=False
            )
            assert booted.returncode == 0, booted.stderr
        used = (home / "venv").readlink()
        in_venvs(f'is_whole "{used}"')
        assert unit.read_text() == used.name
        assert there.read_text() == {"venv.before": "old", "venv.newest": "new"}[used.name]
        state = state_of(home)
        assert (used.name == "venv.newest") == (state == "committed")
        states[state] = states.get(state, 0) + 1
        if ended == 0:
            break
    assert ended == 0
    assert states.keys() == {"", "reverted", "committed"}
    assert states["reverted"] >= 10


@pytest.mark.parametrize(
    ("health", "state", "used"),
    [(0, "committed", "venv.newest"), (8, "reverted", "venv.before")],
    ids=["healthy", "not healthy"],
)
def test_what_is_tried_is_kept_if_it_is_healthy(
    home: Path, health: int, state: str, used: str
) -> None:
    there = settings_there(home)
    venv = make_venv(home, "venv.newest", health=health, settings="new")
    assert switch(home, venv).returncode == 0
    update = home / "update"
    update.write_text(update.read_text().replace("state committed", "state trying"))
    asked = ["sh", str(home / "update.sh"), "watch", "1", str(venv)]
    subprocess.run(asked, check=True, capture_output=True)
    assert state_of(home) == state
    assert "reason two faults\n" in update.read_text()
    assert (home / "venv").readlink().name == used
    assert (there.read_text() == "new") == (health == 0)
    assert venv.exists() == (health == 0)


FULL = """\
#!/bin/sh
case "$1 $2 $3" in
"service "*" --help") exit 0 ;;
"service {at} "*) printf new >{unit}; cat /dev/urandom >{home}/filler 2>/dev/null; exit {status} ;;
esac
"""


@pytest.fixture
def small_disk(tmp_path: Path, home: Path) -> Iterator[Path]:
    """The home of programs, on a disk of 12 MiB; with units and settings of the version in use."""
    disk = tmp_path / "disk"
    disk.mkdir()
    words = ["mount", "-t", "tmpfs", "-o", "size=12m", "tmpfs", str(disk)]
    mounted = subprocess.run(words, capture_output=True, text=True, check=False)
    if mounted.returncode != 0:
        pytest.skip(f"no small disk: {mounted.stderr.strip()}; expected to run as root")
    try:
        place = disk / "opt" / "firmware-runtime"
        shutil.copytree(home, place, symlinks=True)
        (place / "venv").unlink()
        (place / "venv").symlink_to(place / "venv.before")
        unit = disk / "etc/systemd/system/firmware-runtime@.service"
        unit.parent.mkdir(parents=True)
        unit.write_text("old")
        settings_there(place)
        yield place
    finally:
        subprocess.run(["umount", str(disk)], check=True)


def make_filling_venv(home: Path, at: str, status: int) -> Path:
    """A version that brings settings and fills the disk when it is asked for `at`."""
    venv = make_venv(home, "venv.newest", settings="new")
    unit = home.parents[1] / "etc/systemd/system/firmware-runtime@.service"
    program = venv / "bin/firmware-runtime"
    program.write_text(FULL.format(at=at, unit=unit, home=home, status=status))
    for each in ("manifest", "bin/python", "bin/python3"):
        (venv / each).unlink()
    write_manifest(venv)
    return venv


@pytest.mark.slow
@pytest.mark.parametrize(
    ("at", "status", "state"),
    [("install", 6, "reverted"), ("health", 8, "reverted"), ("health", 0, "committed")],
    ids=["not installed", "not healthy", "healthy"],
)
def test_a_disk_that_is_full_by_then_keeps_nothing_from_coming_to_its_end(
    small_disk: Path, at: str, status: int, state: str
) -> None:
    home, root = small_disk, small_disk.parents[1]
    venv = make_filling_venv(home, at, status)
    switched = switch(home, venv)
    if at == "health":
        assert switched.returncode == 0, switched.stderr
        update, reserve = home / "update", home / "reserve"
        update.write_text(update.read_text().replace("state committed", "state trying"))
        reserve.write_bytes(os.urandom(4 << 20))
        words = ["sh", str(home / "update.sh"), "watch", "1", str(venv)]
        subprocess.run(words, check=True, capture_output=True)
    assert (home / "filler").stat().st_size > 1 << 20
    assert state_of(home) == state
    assert not (home / "reserve").exists()
    word = "new" if state == "committed" else "old"
    assert (home / "venv").readlink().name == ("venv.newest" if word == "new" else "venv.before")
    unit = root / "etc/systemd/system/firmware-runtime@.service"
    assert unit.read_text() == word
    assert (root / "etc/firmware-runtime/tachobot.toml").read_text() == word


def test_a_disk_without_room_to_come_back_is_not_switched_on(small_disk: Path) -> None:
    venv = make_filling_venv(small_disk, "install", 0)
    room = shutil.disk_usage(small_disk).free
    (small_disk / "other").write_bytes(bytes(room - (1 << 20)))
    ended = switch(small_disk, venv)
    assert ended.returncode == 1
    assert "the way back could not be prepared" in ended.stderr
    assert "No space left on device" in ended.stderr
    assert (small_disk / "venv").readlink() == small_disk / "venv.before"
    assert not venv.exists()
    assert not (small_disk / "reserve").exists()


def make_sent(home: Path, sign: Path | None = None) -> Path:
    """A version as it arrives, signed by a key if there is one."""
    venv = make_venv(home, "venv.newest")
    for each in ("manifest", "bin/python", "bin/python3"):
        (venv / each).unlink()
    (venv / "manifest.sent").write_text(seal(venv))
    if sign is not None:
        words = ["ssh-keygen", "-Y", "sign", "-q", "-f", str(sign), "-n", SIGNED_FOR]
        subprocess.run([*words, str(venv / "manifest.sent")], check=True)
    return venv


def prepare(home: Path, venv: Path) -> "subprocess.CompletedProcess[str]":
    return run(SENT[1], home.parents[1], venv, "/usr/bin/python3", "yes")


def allow(root: Path, *lines: str) -> None:
    place = root / "etc/firmware-runtime/allowed_signers"
    place.parent.mkdir(parents=True, exist_ok=True)
    place.write_text("".join(f"{line}\n" for line in lines))


def altered(venv: Path) -> None:
    (venv / "bin/firmware-runtime").write_text("#!/bin/sh\n")


def added(venv: Path) -> None:
    (venv / "lib/python3.11/site-packages").mkdir(parents=True)
    (venv / "lib/python3.11/site-packages/sitecustomize.py").write_text("")


def linked(venv: Path) -> None:
    (venv / "bin/python").symlink_to("/usr/bin/true")


def listed(venv: Path) -> None:
    added(venv)
    (venv / "manifest.sent").write_text("")
    (venv / "manifest.sent").write_text(seal(venv).replace("manifest.sent", "manifest.was"))


def unsigned(venv: Path) -> None:
    (venv / "manifest.sent.sig").unlink(missing_ok=True)


@pytest.mark.parametrize("tamper", [altered, added, linked])
def test_what_arrives_otherwise_than_it_was_sent_is_no_program(
    home: Path, tamper: Callable[[Path], None]
) -> None:
    venv = make_sent(home)
    tamper(venv)
    ended = prepare(home, venv)
    assert (ended.returncode, ended.stderr) == (
        1,
        "what arrived is not what was sent; deploy again\n",
    )
    assert not venv.exists()


def test_what_arrives_as_it_was_sent_is_a_program(home: Path) -> None:
    venv = make_sent(home)
    assert prepare(home, venv).returncode == 0
    assert (venv / "bin/python3").resolve() == Path("/usr/bin/python3").resolve()
    assert in_venvs(f'is_whole "{venv}" && echo whole') == "whole\n"


def test_bytecode_that_was_not_sent_is_made_and_is_of_the_program(home: Path) -> None:
    venv = make_sent(home)
    module = venv / "lib/python3/site-packages/heron.py"
    module.parent.mkdir(parents=True)
    module.write_text("A = 1\n")
    (venv / "manifest.sent").unlink()
    (venv / "manifest.sent").write_text(seal(venv))
    done = run(SENT[1], home.parents[1], venv, "/usr/bin/python3", "no")
    assert done.returncode == 0, done.stderr
    (bytecode,) = module.parent.glob("__pycache__/*.pyc")
    assert in_venvs(f'is_whole "{venv}" && echo whole') == "whole\n"
    empty(bytecode)
    assert in_venvs(f'is_whole "{venv}" || echo damaged') == "damaged\n"


@pytest.fixture
def keys(tmp_path: Path) -> dict[str, Path]:
    """Two ssh keys."""
    if shutil.which("ssh-keygen") is None:
        pytest.skip("ssh-keygen not found; install Debian package openssh-client")
    return {name: make_key(tmp_path / name) for name in ("builder", "stranger")}


def public(key: Path) -> str:
    return key.with_suffix(".pub").read_text().strip()


@pytest.mark.parametrize(
    ("signer", "tamper", "allowed", "said"),
    [
        ("builder", None, "me@lab,you@lab {builder}", ""),
        ("builder", None, "* {stranger}\n# ours\n*@lab {builder}", ""),
        ("builder", None, 'me@lab namespaces="firmware-runtime" {builder}', ""),
        ("builder", None, 'me@lab namespaces="git" {builder}', "not signed by a key"),
        ("stranger", None, "me@lab {builder}", "not signed by a key"),
        (None, None, "me@lab {builder}", "not signed by a key"),
        ("builder", unsigned, "me@lab {builder}", "not signed by a key"),
        ("builder", listed, "me@lab {builder}", "not signed by a key"),
        ("builder", altered, "me@lab {builder}", "not what was sent"),
        ("builder", added, "me@lab {builder}", "not what was sent"),
        ("builder", linked, "me@lab {builder}", "not what was sent"),
        ("builder", None, "", "not signed by a key"),
        ("builder", None, "nonsense", "not signed by a key"),
        (None, None, None, ""),
    ],
)
def test_a_computer_with_allowed_signers_takes_what_they_signed_as_it_was(  # noqa: PLR0917
    home: Path,
    keys: dict[str, Path],
    signer: str | None,
    tamper: Callable[[Path], None] | None,
    allowed: str | None,
    said: str,
) -> None:
    if allowed is not None:
        allow(home.parents[1], allowed.format(**{name: public(key) for name, key in keys.items()}))
    venv = make_sent(home, keys[signer] if signer else None)
    if tamper is not None:
        tamper(venv)
    ended = prepare(home, venv)
    assert said in ended.stderr
    assert (ended.returncode, venv.exists()) == ((1, False) if said else (0, True))
    assert len(ended.stderr.splitlines()) == bool(said)
    assert not (home / "venv.newest.log").exists(), "nothing of it was run"
    assert said or switch(home, venv).returncode == 0


def test_a_version_from_before_that_was_not_signed_is_not_gone_back_to(
    home: Path, keys: dict[str, Path]
) -> None:
    assert switch(home, make_venv(home, "venv.newest")).returncode == 0
    allow(home.parents[1], f"me@lab {public(keys['builder'])}")
    ended = switch(home, home / "venv.before", whence="kept")
    assert "venv.before is not signed by a key of" in ended.stderr
    assert (home / "venv").readlink() == home / "venv.newest"
    assert (home / "venv.before").exists()


@pytest.mark.slow
def test_a_version_that_is_there_is_gone_to_and_forward_again(home: Path) -> None:
    there = settings_there(home)
    newest = make_venv(home, "venv.newest", settings="new")
    assert switch(home, newest).returncode == 0
    there.write_text("mine")
    for one, other in (("venv.before", "venv.newest"), ("venv.newest", "venv.before")):
        ended = switch(home, home / one, whence="kept")
        assert ended.returncode == 0, ended.stderr
        assert (home / "venv").readlink() == home / one
        assert (home / "previous").readlink() == home / other
        assert state_of(home) == "committed"
    assert there.read_text() == "mine"


def test_a_version_from_before_that_does_not_start_is_not_lost(home: Path) -> None:
    unit = home.parents[1] / "etc/systemd/system/firmware-runtime@.service"
    unit.parent.mkdir(parents=True)
    older = make_venv(home, "venv.oldest", service=6, unit=unit)
    (home / "previous").symlink_to(older)
    (home / "update.sh").write_text("exit\n")
    ended = switch(home, older, whence="kept")
    assert "the one from before is back" in ended.stderr
    assert (home / "venv").readlink() == home / "venv.before"
    assert (home / "previous").readlink() == older
    assert in_venvs(f'is_whole "{older}" && echo whole') == "whole\n"
    assert not unit.exists()


def test_its_way_back_says_how_it_stands(home: Path) -> None:
    assert switch(home, make_venv(home, "venv.newest")).returncode == 0
    asked = ["sh", str(home / "update.sh"), "status", "600"]
    shown = subprocess.run(asked, check=True, capture_output=True, text=True).stdout.splitlines()
    versions = [line.split() for line in shown[:2]]
    assert [(each[0], each[2], each[4]) for each in versions] == [
        ("version", "venv.before", "before"),
        ("version", "venv.newest", "in-use"),
    ]
    assert shown[2:4] == ["state committed", "board tachobot"]


def state_of(home: Path) -> str:
    update = home / "update"
    found = update.read_text() if update.exists() else ""
    return found.partition("\n")[0].removeprefix("state ")


@pytest.mark.parametrize(
    ("damage", "sound"),
    [
        (lambda _: None, "venv.before"),
        (lambda venv: (venv / "manifest").unlink(), "venv.before"),
        (lambda venv: empty(venv / "bin/firmware-runtime"), "venv.newest"),
        (lambda venv: shutil.rmtree(venv / "bin"), "venv.newest"),
        (lambda venv: (venv / "bin/firmware-runtime").write_text("#!/bin/sh"), "venv.newest"),
    ],
    ids=["whole", "without a manifest", "emptied", "gone", "changed"],
)
def test_robots_are_made_safe_by_a_program_that_is_whole(
    home: Path, damage: Callable[[Path], object], sound: str
) -> None:
    before, newest = home / "venv.before", make_venv(home, "venv.newest")
    damage(before)
    asked = f'sound_venv "{before}" "{newest}"'
    assert in_venvs(asked) == f"{home / sound}\n"


@pytest.mark.slow
@pytest.mark.parametrize("names", SENT, ids=str)
def test_shellcheck_finds_nothing_to_say(names: tuple[str, ...]) -> None:
    if shutil.which("shellcheck") is None:
        pytest.skip("shellcheck not found; install Debian package shellcheck")
    text = "".join((FOLDER / name).read_text() for name in names)
    done = subprocess.run(
        ["shellcheck", "--shell=sh", "-"], input=text, capture_output=True, text=True, check=False
    )
    assert done.stdout == ""
    assert done.returncode == 0
