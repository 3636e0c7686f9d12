"""A deployment to a whole system, by ssh into it, where a robot runs on its doubles."""

from pathlib import Path

import pytest

from firmware_runtime.cli.main import main
from firmware_runtime.errors import Status
from tests.support.scratch_system import GUARD, PROGRAM, ROBOT, SETTINGS, ScratchSystem
from tests.support.ssh_target import HOST, missing_packages, ssh_target

KEYS = "/etc/ssh/keys_of_pi"


@pytest.mark.slow
@pytest.mark.usefixtures("downloaded")
def test_a_robot_runs_after_each_deployment_that_could_make_it_safe(
    system: ScratchSystem, wheel: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if missing := missing_packages():
        pytest.skip(f"nothing to deploy to; install Debian packages {missing}")
    if not system.has("/usr/bin/sudo"):
        pytest.skip("sudo not found; install Debian package sudo")
    assert system.run("useradd", "--create-home", "--password=*", "pi").returncode == 0
    system.write("/etc/sudoers.d/pi", "pi ALL=(ALL) NOPASSWD: ALL\n", 0o440)
    with ssh_target(system.folder / "ssh", inside=system.inside, keys=KEYS) as target:
        system.write(KEYS, target.identity.with_suffix(".pub").read_text())
        host = f"pi@{HOST}"
        words = ["deploy", host, "tachobot", *target.words, "--wheel", str(wheel), "--force"]
        words += ["--health", "2"]
        assert main(words) == Status.OK, system.read("/run/robot.log")
        assert system.read("/run/units").split() == [GUARD, ROBOT]
        printed = capsys.readouterr().out
        assert "root by sudo" in printed
        assert "  healthy for 2 s: " in printed
        summary = printed.splitlines()[-1]
        assert "100 Hz" in summary
        assert "skip" in summary
        first = system.run("readlink", "/opt/firmware-runtime/venv").stdout
        assert "tachobot" in system.run("/usr/local/bin/firmware-runtime", "show").stdout
        configured = system.read("/opt/firmware-runtime/venv/pyvenv.cfg")
        assert "include-system-site-packages = true" in configured
        unit = system.read("/etc/systemd/system/firmware-runtime@.service")
        assert f"ExecStart={PROGRAM} run" in unit

        system.let_safe_state_end_with(4)
        assert main(words) == Status.NOT_DEPLOYED
        assert "cut the power of its motors" in capsys.readouterr().err
        assert system.run("readlink", "/opt/firmware-runtime/venv").stdout == first
        assert system.read("/run/units").split() == [GUARD], "it goes on trying"

        assert system.run("systemctl", "start", GUARD, ROBOT).returncode == 0
        system.let_safe_state_end_with(0)
        system.write(SETTINGS, system.read(SETTINGS) + "# mine\n")
        assert main(words) == Status.OK
        assert system.read("/run/units").split() == [GUARD, ROBOT]
        assert system.run("readlink", "/opt/firmware-runtime/venv").stdout != first
        assert system.run("readlink", "/opt/firmware-runtime/previous").stdout == first
        assert system.read(SETTINGS).endswith("# mine\n")
        stops = [x for x in system.read("/run/systemctl.log").splitlines() if "stop" in x]
        assert stops == [f"stop {ROBOT}", f"stop {ROBOT}", f"stop {GUARD}"]
