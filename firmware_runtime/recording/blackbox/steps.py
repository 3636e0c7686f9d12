"""The beginning and the end of a step that is recorded.

Between two steps little of what these take is in the processor's caches. So each is one function,
straight on: all that it uses is its own from before the run, and it calls another of Python's only
where something is seldom.
"""

from collections.abc import Callable
from typing import Protocol
from zlib import crc32

from firmware_runtime.executive.account import Step
from firmware_runtime.recording.blackbox.keyframe_schedule import KeyframeSchedule
from firmware_runtime.recording.blackbox.layout import CHUNK, SECTION
from firmware_runtime.recording.blackbox.ring import AHEAD, Ring
from firmware_runtime.recording.blackbox.section import Kind, encode_into
from firmware_runtime.recording.blackbox.writer import AT, EXTRA, NO_STEP, Pending, Writer


class BeginOfStep(Protocol):
    """As `executive.tap.Tap.begin`."""

    def __call__(self, at: int) -> None:
        """A step for instant `at` begins."""


class EndOfStep(Protocol):
    """As `executive.tap.Tap.end`."""

    def __call__(self, at: int, next_at: int) -> None:
        """The step for instant `at` is over and counted; the next one is for `next_at`."""


def begin_of_step(pending: Pending, flush: Callable[[], None]) -> BeginOfStep:
    """What notes the instant of a step; first `flush` writes what is pending from before it."""
    fields, transfers, enabled, times = (
        pending.fields,
        pending.transfers,
        pending.enabled,
        pending.times,
    )

    def begin(at: int) -> None:
        if transfers or enabled or times or fields[AT] != NO_STEP:
            flush()
        fields[AT] = at

    return begin


def end_of_step(  # noqa: C901, PLR0913, PLR0917 -- parts of a recorder, straight on
    step: Step,
    pending: Pending,
    ring: Ring,
    writer: Writer,
    schedule: KeyframeSchedule,
    take_keyframe: Callable[[int], None],
    fill_ahead: Callable[[int], None],
) -> EndOfStep:
    """What encodes what is pending, clears it, and copies the section into the ring.

    `writer` gets what is not as usual. A keyframe is taken when one is due, and the ring is filled
    some way ahead.
    """
    encode, check = encode_into, crc32
    pack_section, pack_chunk, section_size = SECTION.pack_into, CHUNK.pack_into, SECTION.size
    fields, memory, buffer = pending.fields, ring.memory, bytearray()
    readings, sent, transfers = pending.readings, pending.sent, pending.transfers
    times, enabled, world, entered = pending.times, pending.enabled, pending.world, pending.entered
    unlike, note = pending.classes.unlike, pending.classes.note
    noted, has_readings = step.laps.noted, not step.stands_still

    def end(at: int, next_at: int) -> None:  # noqa: C901, PLR0912 -- straight on
        content: bytes | bytearray = buffer
        if has_readings:
            epoch = step.epoch
            readings.append(step.started)
            for reading in noted[2::4]:
                readings.append(reading - epoch)
            readings.append(step.ended)
        elif step.started != at:  # virtual time that was stalled
            readings.append(step.started)
        if unlike:
            fields[EXTRA] = note()
        try:
            encode(fields, buffer)
        except Exception:  # noqa: BLE001 -- the run goes on, whatever entered it
            content = writer.in_words(fields)
        fields[AT] = NO_STEP
        fields[EXTRA] = None
        readings.clear()
        sent.clear()
        transfers.clear()
        if times:  # seldom: asking takes less time than clearing
            times.clear()
        if enabled:
            enabled.clear()
        if world:
            world.clear()
        if entered:
            entered.clear()
        place = ring.place
        first = place + section_size
        last = first + len(content)
        if last <= ring.end:  # as `Ring.write` would
            pack_section(memory, place, len(content), check(content))
            memory[first:last] = content
            pack_chunk(memory, ring.begin, ring.chunk, last - ring.begin)
            ring.place = last
        else:
            writer.put(bytes(content), Kind.STEP, at)
        if at >= schedule.due_at:
            take_keyframe(next_at)
        if ring.filled < ring.place + AHEAD:
            fill_ahead(next_at)

    return end
