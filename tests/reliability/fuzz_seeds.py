"""Inputs that each target takes, to begin from; those that reached new code are kept in `corpus`.

A corpus is a file of JSON: inputs in base64, the shortest first.
"""

from base64 import b64decode, b64encode
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Final

import msgspec

from firmware_runtime import open_board
from firmware_runtime.board import registry
from firmware_runtime.hal.served.packets import Asked, Look, Question, Read, Transfer, encode
from firmware_runtime.hal.strike import Strike
from firmware_runtime.lab.campaign.findings import as_in_rows
from firmware_runtime.lab.campaign.kept_findings import keep_findings
from firmware_runtime.lab.sweeps.sweep_table import read_table
from firmware_runtime.recording.blackbox.reader import read_recording
from firmware_runtime.recording.values import pack
from tests.ecdpp.test_model_file import TWO_RELAYS
from tests.reliability.results import ROOT
from tests.support.hostile.bridge import BAD, GOOD
from tests.support.hostile.link import LinkTarget

CORPUS: Final = Path(__file__).parent / "corpus"
REGISTERS: Final = "firmware_runtime/host/scaffold/example_registers.toml"
LONGEST: Final = 600
"""Bytes of the longest input that is kept."""
MOST: Final = 40
_TABLE = "row,board,seed,experiment,set,outcome,error,a.b\n0,tachobot,1,,[],ended,,1.5\n"
_CAMPAIGN = (
    "row,board,seed,set,mission_s,within_s,without,kind,device,at_s,for_s,amount,others,outcome,"
    "what,model,known_at_s,said,said_after_s,struck,ended,reached,digest,version\n"
    '0,pan_tilt,,[],0.1,,[],freeze,eyes,0.05,1.0,,[],silent,"turns",eyes,0.5,,,true,,[],1,0.1\n'
)
_DEEP = "[" * 3000
"""Deeper than a parser that calls itself can go."""
_TEXTS: Final = {
    "assignments": ["world.seed=3", f"a={_DEEP}"],
    "overrides": ["world.seed=3", "imu.mounting='x y z'", "controller.yaw.kp=0.5", "a.b=[1, 2]"],
    "mountings": ["x y z", "+x -y -z", "y,-x,z"],
    "fault scripts": ["2.0:freeze:imu:1.0", "1:push=0.4", "0:nack:i2c1@0x68"],
    "distributions": ["uniform(2, 4)", "normal(0, 1)", "range(0, 1, 0.1)", f"choice({_DEEP})"],
    "expressions": ["x + 2 * sin(u)", "-(x - 1) ** 2 / y", "max(x, 0.5)"],
    "CD++ models": [TWO_RELAYS],
    "CD++ events": ["00:00:01:000 In 0.5", "00:00:02:000 count 3 00:00:03:000 x 1"],
    "fleet.toml": ['[a]\nhost = "a.local"\nboard = "tachobot"\nport = 22\n'],
    "trajectories": ["t_s,x_m,y_m,yaw_rad\n0,0,0,0\n1,1,0,0\n2,2,1,0.5\n"],
    "tables": [_TABLE, _TABLE.replace("[]", _DEEP), _TABLE.replace("1.5", _DEEP)],
    "campaign tables": [
        *(_CAMPAIGN, _CAMPAIGN.replace("freeze", "melt"), _CAMPAIGN.replace("[]", _DEEP)),
        _CAMPAIGN.replace("0.05", "nan"),
    ],
    "pages": [
        '{"title":"a","parts":[{"kind":"text","text":"b"}]}',
        '{"title":"a","parts":[' + '{"kind":"section","title":"a","parts":[' * 3000,
    ],
    "takeovers": ['{"at":1,"reason":"hang","process":[1,2],"off_after_ns":3}\n'],
    "messages to a run": [
        '{"watch": ["imu.sample"], "every": 10}',
        '{"list": true}',
        '{"request": "arm", "lease_s": 0.4}',
        *(each.decode() for each in GOOD),
        *(each.decode("utf-8", "surrogateescape") for each in BAD),
    ],
    "MaxBotix frames": ["R123\rR0456\r", "R12", "R1234\r"],
}


def seeds(name: str, folder: Path) -> list[bytes]:
    """Return inputs of a target; a folder is for files that a run makes."""
    texts = [each.encode("utf-8", "surrogateescape") for each in _TEXTS.get(name, ())]
    made = _MADE[name](folder) if name in _MADE else []
    return [*texts, *made, *corpus(name)]


def corpus(name: str) -> list[bytes]:
    """Return what is kept of a target."""
    path = _path(name)
    return list(map(b64decode, msgspec.json.decode(path.read_bytes()))) if path.exists() else []


def keep_corpus(name: str, inputs: Iterable[bytes]) -> None:
    """Keep the shortest of these."""
    short = sorted({each for each in inputs if len(each) <= LONGEST}, key=lambda e: (len(e), e))
    step = max(1, -(-len(short) // MOST))
    CORPUS.mkdir(exist_ok=True)
    content = msgspec.json.encode([b64encode(each).decode() for each in short[::step]])
    _path(name).write_bytes(msgspec.json.format(content) + b"\n")


def _path(name: str) -> Path:
    return CORPUS / f"{''.join(each if each.isalnum() else '_' for each in name)}.json"


def _boards(_folder: Path) -> list[bytes]:
    return [registry.load(each).source.read_bytes() for each in ("tachobot", "detective")]


def _series(_folder: Path) -> list[bytes]:
    lines = [f"{0.01 * n:.2f},{n % 7},{n % 5}" for n in range(250)]
    return ["\n".join(["time_s,input,output", *lines]).encode()]


def _findings(folder: Path) -> list[bytes]:
    table = folder / "seed.csv"
    table.write_text(_CAMPAIGN)
    keep_findings(folder, "pan_tilt", as_in_rows(read_table(table).rows))
    return [(folder / "findings.json").read_bytes()]


def _frames(_folder: Path) -> list[bytes]:
    return [each.datagram[:-32] for each in LinkTarget(1).attempts(60)]


def _envelopes(_folder: Path) -> list[bytes]:
    head = b"fr1 ask 5555555555555555 bbbbbbbbbbbbbbbb 7 1000000000"
    return [head + b"\n" + each for each in GOOD]


def _questions(_folder: Path) -> list[bytes]:
    asked: tuple[Asked, ...] = (
        Transfer("i2c1", 0x68, (b"\x75", 1)),
        Look(),
        Read("x"),
        Strike("nack", "imu"),
    )
    return [encode(Question(number, each)) for number, each in enumerate(asked)]


def _recordings(folder: Path, *, with_lengths: bool) -> list[bytes]:
    """A few sections of a short run: as a file, or each after its length."""
    path = folder / "seed.recording"
    with open_board("tachobot", doubles=True, clock="virtual", record=path) as robot:
        robot.run(0.1)
    if not with_lengths:
        return [path.read_bytes()[:20_000]]
    contents = [each for chunk in read_recording(path).chunks for each in chunk.contents]
    short = islice((each for each in contents if len(each) < 4000), 12)
    return [b"".join(len(each).to_bytes(2, "big") + each for each in (contents[0], *short))]


_MADE: Final[Mapping[str, Callable[[Path], list[bytes]]]] = {
    "board.toml": _boards,
    "kept settings": lambda _: [msgspec.json.encode(registry.load("tachobot").table)],
    "register tables": lambda _: [(ROOT / REGISTERS).read_bytes()],
    "series": _series,
    "findings of campaigns": _findings,
    "keys": lambda _: [bytes(range(32))],
    "statistics": lambda _: [bytes(11), bytes([0, 0, 24, *b"{]}[{]}["]), bytes([1, *[255] * 10])],
    "recordings": partial(_recordings, with_lengths=True),
    "recordings saved": partial(_recordings, with_lengths=False),
    "recorded values": lambda _: [pack([1, 2.5, "x", b"y", None, {"a": [1]}, (1, 2)])],
    "frames of a link": _frames,
    "a link": _frames,
    "a bridge": _envelopes,
    "served doubles": _questions,
    "Sabertooth packets": lambda _: [bytes([128, 0, 64, 64]), bytes([128, 14, 50, 64])],
    "USB/IP": lambda _: [bytes.fromhex("0111800500000000"), bytes.fromhex("0111800300000000")],
}
