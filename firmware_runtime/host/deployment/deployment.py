"""A deployment, step by step; until the last but one the target's robot runs on undisturbed.

1. examine the target; everything it lacks is reported at once
2. make the wheel, those of the packages of its robots, find their dependencies' for the target, and
   lay them out as a virtual environment
3. send it, beside the one in use; what that has already is copied there
4. compare it with its list, and make there what can be made only there
5. `check` and `doctor` by the new program, there
6. stop the robot, put the new program in the old one's place, install the service, start
7. try it; what does not prove itself is taken back, also when this computer has gone

A version that is still there is examined, put in place and tried in the same way.

What is done on the target is in shell scripts beside this file.
"""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from secrets import token_hex
from shutil import which
from tempfile import TemporaryDirectory
from time import monotonic

from firmware_runtime.errors import DeploymentError, Status
from firmware_runtime.host.deployment import wheels
from firmware_runtime.host.deployment.connection import Commands, Connection
from firmware_runtime.host.deployment.package_wheel import packages_of, with_local_dependencies
from firmware_runtime.host.deployment.target import Need, Target
from firmware_runtime.host.deployment.update import update_of, version_called, versions_of
from firmware_runtime.system.packages import module_of_extra

_OF_ROBOTS = ("venvs.sh", "units.sh", "robots.sh", "update.sh")
SENT = "manifest.sent"
"""The list of what is sent, with the sum of each file."""
_OF_EXTRA = ("installer", "packaging")
SIGNED_FOR = "firmware-runtime"
"""The namespace of signatures, which keeps those for anything else from counting."""
WAY_BACK = "firmware-runtime-update.service"
_LONGEST_VERDICT_S = 150.0
"""Beyond the trial: a service may take a minute to begin, and another to be taken back."""
_WAIT_S = 60
"""For so long the target waits in one login, which takes it more than the robot that is tried."""
_PROGRAMS = {"ssh": "openssh-client", "ssh-keygen": "openssh-client", "rsync": "rsync"}
"""What a deployment needs here, by Debian's packages."""


@dataclass(frozen=True, slots=True)
class DeploymentOptions:
    """Options of a deployment: what, where to, and how."""

    host: str
    board: str
    """Empty for the one of the last update."""
    kind: str
    """The kind of that board, whose package is sent along."""
    ssh_options: tuple[str, ...] = ()
    root: str = ""
    """A folder of the target that everything goes below; empty for the target itself."""
    python: str = "python3"
    settings: Path | None = None
    """A file that becomes the board's settings there."""
    wheel: Path | None = None
    """The project's wheel; made here if None."""
    nodes: tuple[str, ...] = ()
    """The board's device nodes, as its settings here have them."""
    start: bool = True
    health_s: int = 30
    """For how long the new version is tried before it is kept."""
    force: bool = False
    """Go on although the doctor found a failure."""
    sign: Path | None = None
    """An ssh key that signs what is sent."""
    to: str = ""
    """A version that is there already, and is gone to; nothing is sent."""

    @property
    def home(self) -> str:
        """Return where the program goes."""
        return f"{self.root}/opt/firmware-runtime"


class Deployment:
    """Deploys by these options; `commands` may be a dry run, which only examines the target."""

    def __init__(self, options: DeploymentOptions, commands: Commands) -> None:
        self._options = options
        self._commands = commands
        self._log = commands.log
        self.board = options.board
        self.connection = Connection(options.host, options.ssh_options, commands)

    def carry_out(self) -> bool:
        """Do all steps; return whether there was anything to do.

        Raises DeploymentError with what kept one from being done.
        """
        options = self._options
        if missing := [name for name in _PROGRAMS if which(name) is None]:
            packages = " ".join(dict.fromkeys(_PROGRAMS[name] for name in missing))
            raise DeploymentError(
                f"{' and '.join(missing)}: not found on this computer",
                expected=f"it installed (Debian: sudo apt install {packages})",
            )
        if not options.to:
            for name in _OF_EXTRA:
                module_of_extra(name, "deploy")
        with self._step(f"inspect {options.host}"):
            target = self._inspect()
        venv = self._version_there(target) if options.to else self._new_version(target)
        if venv is None:
            return False
        with self._step("check the board, examine the computer"):
            self._examine(venv, target)
        with self._step("put that program in place"):
            self._switch(venv)
        if options.start and not options.root:
            with self._step(f"try it for {options.health_s} s"):
                self._await_verdict()
        return True

    def _version_there(self, target: Target) -> str | None:
        """Return the environment of the version that is asked for; None if it is in use."""
        options = self._options
        found = version_called(options.to, versions_of(target.versions.split(";")), options.host)
        self._log_all(found.line())
        return None if found.place == "in-use" else f"{options.home}/{found.folder}"

    def _new_version(self, target: Target) -> str:
        """Return the environment that was made on the target."""
        venv = f"{self._options.home}/venv.{token_hex(3)}"
        with TemporaryDirectory(prefix="firmware-runtime-") as temporary:
            content = Path(temporary, "content")
            with self._step(f"make the new version for {target.platform}"):
                compiled = self._lay_out(target, venv, Path(temporary, "wheels"), content)
            with self._step("send it"):
                self._send(content, venv, target)
        with self._step("compare what arrived, make the rest"):
            arguments = (self._options.root, venv, target.base, "yes" if compiled else "no")
            ended = self.connection.script(["venvs.sh", "signatures.sh", "prepare.sh"], *arguments)
            if ended.status != 0:
                raise DeploymentError(ended.reason, where=self._options.host)
        return venv

    def _inspect(self) -> Target:
        options = self._options
        inspecting = Commands(self._log)  # changes nothing, so it is done in a dry run too
        connection = Connection(options.host, options.ssh_options, inspecting)
        brought = "no" if options.settings is None else "yes"
        asked = (options.root, options.python, options.board, brought, *options.nodes)
        ended = connection.script(["venvs.sh", "units.sh", "probe.sh"], *asked)
        if ended.status != 0:
            raise DeploymentError(ended.reason, where=options.host, expected="a POSIX shell")
        target = Target.read(ended.out)
        self.board = target.board
        need = Need(not options.to, not options.force, options.sign is not None)
        if faults := target.faults(options.python, options.root, need):
            listing = "\n".join(f"  - {fault}" for fault in faults)
            raise DeploymentError(f"not deployed to\n{listing}", where=options.host)
        if target.superuser == "sudo" and not options.root:
            self.connection.become_root()
        self._log_all(target.text())
        return target

    def _lay_out(self, target: Target, venv: str, wheelhouse: Path, content: Path) -> bool:
        """Make the content of the environment; return whether it has its bytecode."""
        from firmware_runtime.host.deployment import environment  # noqa: PLC0415 -- of an extra

        options = self._options
        packages = packages_of({options.kind, *target.kinds.split()})
        collected = wheels.collect(
            self._commands,
            target.platform,
            options.wheel,
            wheelhouse,
            with_local_dependencies(packages),
        )
        self._log_all(collected.text)
        if self._commands.dry_run:
            self._log(f"  (unpack them as {venv})")
            return True
        environment.lay_out(wheelhouse, collected.ours, target, content, venv)
        self._add_way_back(content / "deployment")
        compiled = environment.compile_bytecode(content, target, f"{options.home}/venv")
        if not compiled:
            self._log(f"  no Python {target.minor_version} here: the target makes the bytecode")
        listed = environment.seal(content)
        (content / SENT).write_text(listed)
        size = sum(file.stat().st_size for file in content.rglob("*") if file.is_file())
        self._log(f"  {listed.count(chr(10))} files, {size / 1e6:.1f} MB")
        return compiled

    def _add_way_back(self, folder: Path) -> None:
        """What takes a version back without either program, on the target; and new settings."""
        scripts = folder / "scripts"
        scripts.mkdir(parents=True)
        for name in (*_OF_ROBOTS, "persisted.sh"):
            (scripts / name).write_bytes((Path(__file__).parent / name).read_bytes())
        unit = files("firmware_runtime.host.installation") / "units" / WAY_BACK
        (scripts / WAY_BACK).write_bytes(unit.read_bytes())
        if self._options.settings is not None:
            place = folder / "settings" / f"{self.board}.toml"
            place.parent.mkdir()
            place.write_bytes(self._options.settings.read_bytes())

    def _send(self, content: Path, venv: str, target: Target) -> None:
        options = self._options
        if options.sign is not None:
            words = ["ssh-keygen", "-Y", "sign", "-q", "-f", str(options.sign)]
            words += ["-n", SIGNED_FOR, str(content / SENT)]
            self._commands.demand(words, f"{options.sign}: not signed")
            if not target.signers:
                self._log("  signed; this computer has no allowed_signers and verifies nothing")
        like = f"{options.home}/venv" if target.versions else None
        try:
            self.connection.send(content, venv, like)
        except DeploymentError:
            with suppress(DeploymentError):  # the connection may be lost
                self.connection.command("rm", "-rf", venv)
            raise

    def _examine(self, venv: str, target: Target) -> None:
        options = self._options
        board = target.settings or self.board
        if options.settings is not None:
            board = f"{venv}/deployment/settings/{self.board}.toml"
        force = "yes" if options.force else "no"
        ended = self.connection.script(["venvs.sh", "examine.sh"], venv, board, force)
        self._log_all(ended.out)
        if ended.status == Status.DOCTOR_FAILS:
            raise DeploymentError(
                "the doctor found a failure", where=options.host, expected="it fixed, or --force"
            )
        if ended.status != 0:
            self._log_all(ended.error)
            raise DeploymentError(f"{self.board} did not pass check or doctor", where=options.host)

    def _switch(self, venv: str) -> None:
        options = self._options
        start = "yes" if options.start else "no"
        scripts = [*_OF_ROBOTS, "signatures.sh", "switch.sh"]
        whence = "kept" if options.to else "sent"
        arguments = (options.root, venv, self.board, start, str(options.health_s), whence)
        ended = self.connection.script(scripts, *arguments)
        self._log_all(ended.out)
        self._log_all(ended.error)
        if ended.status != 0:
            raise DeploymentError(ended.reason, where=options.host)

    def _await_verdict(self) -> None:
        """Wait for what the target itself decides; it does so without this computer, too."""
        if self._commands.dry_run:
            return
        give_up_at = monotonic() + self._options.health_s + _LONGEST_VERDICT_S
        while (update := update_of(self.connection, _WAIT_S)).state in {"staged", "trying"}:
            if monotonic() > give_up_at:
                raise DeploymentError(
                    "no verdict on the new version",
                    where=self._options.host,
                    expected="one; see firmware-runtime deploy status HOST",
                )
        self._log_all(update.reason)
        if update.state != "committed":
            back = "the one before is back" if update.state == "reverted" else update.state
            raise DeploymentError(
                f"the new version: {update.reason}; {back}", where=self._options.host
            )

    @contextmanager
    def _step(self, what: str) -> Iterator[None]:
        """Say what begins, and how long it took."""
        self._log(what)
        began_at = monotonic()
        yield
        self._log(f"  {monotonic() - began_at:.1f} s")

    def _log_all(self, text: str) -> None:
        for line in text.splitlines():
            self._log(f"  {line}".rstrip())
