"""The certificate as a self-contained page: the matrix first, then what differs, then machines."""

from collections.abc import Iterator
from string import ascii_uppercase
from xml.etree.ElementTree import Element

from firmware_runtime.certification.certificate import Certificate, in_columns
from firmware_runtime.certification.finding import Finding, Place
from firmware_runtime.devs.time import format_time
from firmware_runtime.recording.chance import UNKEPT
from firmware_runtime.statistics.page.markup import element, table
from firmware_runtime.statistics.page.page import page_of, section

TITLE = "The same bits on every machine"
_SHORT = 16
"""Digits of a hash that are shown in a column."""


def certificate_page(certificate: Certificate) -> str:
    """The page's text."""
    return page_of(TITLE, _sections(certificate))


def said(finding: Finding | None) -> str:
    """A cell of the matrix."""
    if finding is None:
        return "not run"
    if finding.fault is not None:
        return finding.fault
    if finding.first is not None and not finding.differences:
        return f"0 of {finding.events:,} output events, but {finding.first.what} differs"
    return f"{finding.differences:,} of {finding.events:,}"


def place_said(place: Place) -> str:
    """Where and how two values part, in a line."""
    units = place.units_apart
    apart = (
        ""
        if units is None
        else f", {units:,} {'unit' if units == 1 else 'units'} in the last place"
    )
    where = f"{place.what} {place.name} at {format_time(place.t_ns)}"
    return f"{where}: recorded {place.recorded}, replayed {place.replayed}{apart}"


def _sections(certificate: Certificate) -> Iterator[Element]:
    yield _opening(certificate)
    yield section("Differing output events", _matrix(certificate))
    if differing := [*_differences(certificate)]:
        head = ("recording", "machine", "first difference", "first differing output")
        yield section("First differences", table("Where they part", head, differing, "words"))
    yield section("Machines", _machines(certificate))
    yield section("Recordings", _recordings(certificate))


def _opening(certificate: Certificate) -> Element:
    machines, recordings = len(certificate.machines), len(certificate.recordings)
    is_identical = certificate.is_identical
    verdict, css = ("identical", "good") if is_identical else ("not identical", "bad")
    sentence = f"{recordings} recordings to be replayed on {machines} machines."
    return element(
        "header",
        element("h1", TITLE),
        element("p", element("strong", verdict, class_=f"verdict {css}"), sentence),
        *(element("p", said) for said in certificate.lacking()),
        element(
            "p",
            "What a recording holds was run again in virtual time, by the code named below. What "
            "entered, every output event and every recorded field of the models' state were "
            "compared, floats to the bit.",
        ),
    )


def _matrix(certificate: Certificate) -> Element:
    letters = [_letter(number) for number in range(len(certificate.machines))]
    rows = [
        (finding.recording, f"{finding.fields:,}", *map(said, found))
        for finding, found in in_columns(certificate)
    ]
    head = ("recording", "fields of state compared", *letters)
    return table("Output events that are not those of the recording", head, rows)


def _differences(certificate: Certificate) -> Iterator[tuple[str, str, str, str]]:
    for number, each in enumerate(certificate.machines):
        for finding in each.findings:
            if finding.first is not None:
                output = finding.first_output
                effect = "none" if output is None else place_said(output)
                where = finding.recording, _letter(number)
                why = f"; {UNKEPT}" if finding.has_drawn else ""
                yield (*where, place_said(finding.first) + why, effect)


def _machines(certificate: Certificate) -> Element:
    head = ("", "machine", "compiler", "kernel", "packages", "its C library's functions")
    rows = (
        (
            _letter(number),
            ", ".join(filter(None, (each.machine.name, each.machine.tunables))),
            each.machine.compiler,
            each.machine.kernel,
            _versions(each.machine.packages),
            each.machine.library_sha256[:_SHORT],
        )
        for number, each in enumerate(certificate.machines)
    )
    return table("Machines with another last column have another sine", head, rows, "words")


def _recordings(certificate: Certificate) -> Element:
    codes = certificate.codes
    rows = (
        (
            each.recording,
            each.board,
            f"{each.duration_s:g} s",
            _versions(each.made_with),
            sha256[:_SHORT],
            ", ".join(sorted(code[:_SHORT] for code in codes[sha256])) or "not said",
            ", ".join(each.code_changed) or "none",
        )
        for sha256, each in certificate.recordings.items()
    )
    head = ("recording", "board", "length", "made with", "SHA-256", "replayed by code", "changed")
    return table("What was replayed", head, rows, "words")


def _letter(number: int) -> str:
    """What a machine is called in a narrow column: A, B, ... Z, A1, B1 ..."""
    return ascii_uppercase[number % 26] + str(number // 26 or "")


def _versions(versions: dict[str, str | None]) -> str:
    return ", ".join(f"{name} {version}" for name, version in versions.items() if version)
