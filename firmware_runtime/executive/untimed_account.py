"""The account of a model without a period where functions take no time: in virtual time.

The clock stands still while a step is worked off, so every own time is zero, nothing is late, and
no deadline passes before it is kept. This account counts what the other counts and leaves undone
what would come to nothing. It stands in no model's place: the simulator calls the model itself, and
says which models had a transition in a step. One whose event was due then has run, since its
internal transition comes first; one whose event was not has reacted.

It counts in itself alone. Only this process can read a statistics file of which nothing is kept, so
the model's block is written when it is to be read (`copy_into`).
"""

from msgspec import structs

from firmware_runtime.devs.functions import Functions, Wrapped
from firmware_runtime.devs.time import NEVER
from firmware_runtime.executive.account import RETURNED, ModelAccount
from firmware_runtime.executive.event_account import EventAccount
from firmware_runtime.statistics.histogram import Cells
from firmware_runtime.statistics.layout import Layout
from firmware_runtime.statistics.rows import ModelRow


class UntimedEventAccount(EventAccount):
    """An `EventAccount` on a clock that stands still during a step."""

    __slots__ = ()

    def count_in(self, cells: Cells, layout: Layout) -> None:
        """Go on counting in itself."""

    def end(self, now: int) -> None:
        """Count what is due at `now` as skipped: the run is over."""
        if self.due <= now:
            self.miss(1)
        self.due = NEVER

    def copy_into(self, cells: Cells, layout: Layout) -> None:
        """Write the model's block of the file."""
        copy_block(self, cells, layout, self.run + self.reactions)


def copy_block(account: ModelAccount, cells: Cells, layout: Layout, own_times: int) -> None:
    """Write a model's block of the file; each lateness and own time is in the bucket of zero."""
    number = account.number
    row = ModelRow(
        scheduled=account.run + account.skipped + account.coalesced,
        run=account.run,
        skipped=account.skipped,
        coalesced=account.coalesced,
        overruns=account.overruns,
        episodes=account.episodes,
        last_late_ns=0,
        due_ns=account.due,
        is_in_period=account.is_in_period,
        irregular=account.irregular,
        returned_ns=account.cells[RETURNED],
        reactions=account.reactions,
    )
    for cell, value in enumerate(structs.astuple(row), layout.model(number)):
        cells[cell] = value
    cells[layout.lateness(number).start] = account.run
    cells[layout.step(number).start] = own_times


def answering(functions: Functions, account: UntimedEventAccount) -> Functions:
    """Functions of a model that calls its account's `answers` when it has read input."""
    take, both = functions.external, functions.confluent

    def external(elapsed: int) -> None:
        take(elapsed)
        for answer in account.answers:
            answer()

    def confluent() -> None:
        both()  # type: ignore[misc]  # only called where there is one
        for answer in account.answers:
            answer()

    own = None if both is None else confluent
    return Wrapped(account.atomic, functions.output, functions.internal, external, own)
