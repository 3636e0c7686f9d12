"""A deployment, step by step; until the last but one the target's robot runs on undisturbed.

1. examine the target; everything it lacks is reported at once
2. make the wheel, those of the packages of its robots, find their dependencies' for the target
3. send them
4. make a virtual environment beside the one in use
5. `check` and `doctor` by the new program, there
6. stop the robot, put the new program in the old one's place, install the service, start
7. try it; what does not prove itself is taken back, also when this computer has gone

What is done on the target is in shell scripts beside this file.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import Distribution
from importlib.resources import files
from pathlib import Path
from shutil import which
from tempfile import TemporaryDirectory
from time import monotonic, sleep

from firmware_runtime.errors import DeploymentError, Status
from firmware_runtime.host.deployment import wheels
from firmware_runtime.host.deployment.connection import Commands, Connection
from firmware_runtime.host.deployment.package_wheel import packages_of, with_local_dependencies
from firmware_runtime.host.deployment.target import Target
from firmware_runtime.host.deployment.update import update_of

_OF_ROBOTS = ("venvs.sh", "units.sh", "robots.sh", "update.sh")
WAY_BACK = "firmware-runtime-update.service"
_LONGEST_VERDICT_S = 150.0
"""Beyond the trial: a service may take a minute to begin, and another to be taken back."""
_PROGRAMS = {"ssh": "openssh-client", "rsync": "rsync"}
"""What a deployment needs here, by Debian's packages."""


@dataclass(frozen=True, slots=True)
class DeploymentOptions:
    """Options of a deployment: what, where to, and how."""

    host: str
    board: str
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
        self._packages: list[Distribution] = []
        self.connection = Connection(options.host, options.ssh_options, commands)

    def carry_out(self) -> None:
        """Do all steps. Raises DeploymentError with what kept one from being done."""
        options = self._options
        if missing := [name for name in _PROGRAMS if which(name) is None]:
            packages = " ".join(_PROGRAMS[name] for name in missing)
            raise DeploymentError(
                f"{' and '.join(missing)}: not found on this computer",
                expected=f"it installed (Debian: sudo apt install {packages})",
            )
        with self._step(f"inspect {self._options.host}"):
            target = self._inspect()
        with TemporaryDirectory(prefix="firmware-runtime-") as temporary:
            parcel = Path(temporary)
            with self._step(f"collect wheels for {target.platform}"):
                self._log_all(self._collect(target, parcel))
            with self._step("send them"):
                self.connection.send(parcel, f"{self._options.home}/parcel")
        with self._step("make a virtual environment"):
            venv = self._prepare()
        with self._step("check the board, examine the computer"):
            self._examine(venv, target)
        with self._step("put the new program in place"):
            self._switch(venv)
        if options.start and not options.root:
            with self._step(f"try it for {options.health_s} s"):
                self._await_verdict()

    def _inspect(self) -> Target:
        options = self._options
        inspecting = Commands(self._log)  # changes nothing, so it is done in a dry run too
        connection = Connection(options.host, options.ssh_options, inspecting)
        brought = "no" if options.settings is None else "yes"
        asked = (options.root, options.python, options.board, brought, *options.nodes)
        ended = connection.script(["units.sh", "probe.sh"], *asked)
        if ended.status != 0:
            raise DeploymentError(ended.reason, where=options.host, expected="a POSIX shell")
        target = Target.read(ended.out)
        if faults := target.faults(options.python, options.root, force=options.force):
            listing = "\n".join(f"  - {fault}" for fault in faults)
            raise DeploymentError(f"not deployed to\n{listing}", where=options.host)
        if target.superuser == "sudo" and not options.root:
            self.connection.become_root()
        self._log_all(target.text())
        return target

    def _collect(self, target: Target, parcel: Path) -> str:
        options = self._options
        if options.settings is not None:
            place = parcel / "settings" / f"{options.board}.toml"
            place.parent.mkdir()
            place.write_bytes(options.settings.read_bytes())
        self._packages = packages_of({options.kind, *target.kinds.split()})
        self._add_way_back(parcel / "scripts")
        wheelhouse = parcel / "wheels"
        taken_along = with_local_dependencies(self._packages)
        return wheels.collect(
            self._commands, target.platform, options.wheel, wheelhouse, taken_along
        )

    def _add_way_back(self, folder: Path) -> None:
        """What takes a version back without either program, on the target."""
        folder.mkdir()
        for name in (*_OF_ROBOTS, "persisted.sh"):
            (folder / name).write_bytes((Path(__file__).parent / name).read_bytes())
        unit = files("firmware_runtime.host.installation") / "units" / WAY_BACK
        (folder / WAY_BACK).write_bytes(unit.read_bytes())

    def _prepare(self) -> str:
        options = self._options
        names = [package.name for package in self._packages]
        ended = self.connection.script(
            ["venvs.sh", "prepare.sh"], options.root, options.python, *names
        )
        if ended.status != 0:
            raise DeploymentError(f"the new program: {ended.reason}", where=options.host)
        # The last word: a login may say something of its own before.
        return (ended.out.split() or [f"{options.home}/venv.XXXXXX"])[-1]

    def _examine(self, venv: str, target: Target) -> None:
        options = self._options
        board = target.settings or options.board
        if options.settings is not None:
            board = f"{options.home}/parcel/settings/{options.board}.toml"
        force = "yes" if options.force else "no"
        ended = self.connection.script(["examine.sh"], venv, board, force)
        self._log_all(ended.out)
        if ended.status == Status.DOCTOR_FAILS:
            raise DeploymentError(
                "the doctor found a failure", where=options.host, expected="it fixed, or --force"
            )
        if ended.status != 0:
            self._log_all(ended.error)
            raise DeploymentError(
                f"{options.board} did not pass check or doctor", where=options.host
            )

    def _switch(self, venv: str) -> None:
        options = self._options
        start = "yes" if options.start else "no"
        scripts = [*_OF_ROBOTS, "switch.sh"]
        arguments = (options.root, venv, options.board, start, str(options.health_s))
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
        while (update := update_of(self.connection)).state in {"staged", "trying"}:
            if monotonic() > give_up_at:
                raise DeploymentError(
                    "no verdict on the new version",
                    where=self._options.host,
                    expected="one; see firmware-runtime deploy status HOST",
                )
            sleep(1.0)
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
