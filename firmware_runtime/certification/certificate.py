"""The certificate: what every machine's replay of every recording has in common with the run.

    {"identical": true, "recordings": 4,
     "machines": [{"machine": {"name": "CPython 3.13.0, x86_64, glibc 2.36", ...},
                   "findings": [{"recording": "flight.recording", "events": 923, "differences": 0,
                                 "first": null, ...}]}],
     "not_run": {"qemu-aarch64-static ...": "..."}}

Certificates of several machines are merged by their machines; a recording is known by its SHA-256.
"""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import msgspec
from msgspec import Struct

from firmware_runtime.certification.finding import Finding
from firmware_runtime.certification.machine import Machine
from firmware_runtime.errors import ConfigError

FORMAT: Final = 1


class OfMachine(Struct, frozen=True, kw_only=True):
    """What one machine found."""

    machine: Machine
    findings: list[Finding]


class Certificate(Struct, frozen=True, kw_only=True):
    """What all machines found; `not_run`: machines that should have, and why they did not."""

    format: int = FORMAT
    machines: list[OfMachine]
    not_run: dict[str, str] = {}

    @property
    def recordings(self) -> dict[str, Finding]:
        """A finding for each recording, by SHA-256, in the order in which they were named."""
        every = (finding for each in self.machines for finding in each.findings)
        found: dict[str, Finding] = {}
        for finding in every:
            found.setdefault(finding.sha256, finding)
        return found

    @property
    def missing(self) -> list[tuple[str, str]]:
        """Machines and the recordings that they did not replay."""
        return [
            (each.machine.name, finding.recording)
            for each in self.machines
            for sha256, finding in self.recordings.items()
            if sha256 not in {known.sha256 for known in each.findings}
        ]

    @property
    def codes(self) -> dict[str, set[str]]:
        """By recording, SHA-256 of the code that replayed it; more than one: not the same code."""
        found: dict[str, set[str]] = {sha256: set() for sha256 in self.recordings}
        for each in self.machines:
            for finding in each.findings:
                found[finding.sha256] |= {finding.code_sha256} - {None}  # type: ignore[arg-type]
        return found

    def lacking(self) -> Iterator[str]:
        """What keeps it from being a pass other than a difference, in sentences."""
        for interpreter, why in self.not_run.items():
            yield f"not run: {interpreter}: {why}"
        for machine, recording in self.missing:
            yield f"not run: {recording} on {machine}"
        for sha256, codes in self.codes.items():
            if len(codes) > 1:
                hashes = ", ".join(sorted(codes))
                yield f"{self.recordings[sha256].recording}: replayed by several codes: {hashes}"

    @property
    def is_identical(self) -> bool:
        """Whether every machine replayed every recording, by the same code, to the same bits."""
        every = [finding for each in self.machines for finding in each.findings]
        is_whole = bool(every) and not any(self.lacking())
        return is_whole and all(finding.is_identical for finding in every)

    def as_json(self) -> dict[str, Any]:
        """For a program."""
        plain: dict[str, Any] = msgspec.to_builtins(self)
        counts = {"identical": self.is_identical, "recordings": len(self.recordings)}
        return {**counts, **plain}


def merged(certificates: Iterable[Certificate]) -> Certificate:
    """One certificate of all their machines, a machine that is in several once."""
    by_machine: dict[str, tuple[Machine, dict[str, Finding]]] = {}
    not_run: dict[str, str] = {}
    for certificate in certificates:
        not_run |= certificate.not_run
        for each in certificate.machines:
            key = msgspec.json.encode(each.machine).decode()
            _, known = by_machine.setdefault(key, (each.machine, {}))
            known |= {finding.sha256: finding for finding in each.findings}
    machines = [
        OfMachine(machine=machine, findings=list(known.values()))
        for machine, known in by_machine.values()
    ]
    return Certificate(machines=machines, not_run=not_run)


def read_certificate(path: Path) -> Certificate:
    """Read one that `certify -o FILE.json` wrote. Raises ConfigError."""
    try:
        return certificate_of(path.read_bytes())
    except (OSError, ValueError) as error:
        said = getattr(error, "strerror", None) or str(error)
        raise ConfigError.of_one(str(path), f"{said}; expected a certificate") from error


def certificate_of(content: bytes) -> Certificate:
    """A certificate of its JSON. Raises ValueError."""
    certificate = msgspec.json.decode(content, type=Certificate)
    if certificate.format != FORMAT:
        raise ValueError(f"a certificate of format {certificate.format}, expected {FORMAT}")
    return certificate


def in_columns(certificate: Certificate) -> Sequence[tuple[Finding, list[Finding | None]]]:
    """The matrix: each recording with what every machine found, None where it did not."""
    found = [{each.sha256: each for each in one.findings} for one in certificate.machines]
    return [
        (finding, [known.get(sha256) for known in found])
        for sha256, finding in certificate.recordings.items()
    ]
