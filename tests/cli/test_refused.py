"""Lines that are refused: status 2, a sentence, nothing printed, and nothing written.

A row is a line, and parts of what is said; a part behind `!` is not said. The words in braces stand
for what is longer, and `letter`, `open.key`, `folder` and `some.ev` for what is there.
"""

import shlex
from pathlib import Path

import pytest
from firmware_boards.detective.detective import MODEL_FILE

from firmware_runtime.board.installed import shipped_file
from firmware_runtime.links.key_file import write_key
from tests.support.command import Command

WORDS = {
    "virtual": "run tachobot --doubles --clock virtual --for 1",
    "events": "run detective --events some.ev",
    "ma": str(MODEL_FILE),
    "peer": "run tachobot --stage remote --peer",
    "free": "run tachobot --stage network --for 9",
    "link": "--role robot --link",
    "long": "a" * 300,
    "detective": str(shipped_file("detective")),
    "plant": "inertia_kg_m2=0.15,damping_nms=0.02,delay_s=0.03",
}
TABLE = """
# boards and files
run submarine | submarine: 1 fault | detective
check submarine | submarine: 1 fault | detective | !did you mean
show submarine | submarine: 1 fault | detective
doctor no-such-board | unknown board
check '' | '': 1 fault
check tachbot.toml | no such file | !unknown board
check ./tachobot | no such file | !unknown board
check boards/none/board.toml | no such file | !unknown board
check folder | no board.toml in this folder
stats tachobot | no statistics of tachobot
stats --statistics letter | letter
report nosuch -o page.html | no statistics of nosuch
export nosuch -o trace.json | no run of a board of this name has left
export nosuch -o trace.json --when-late 2000 | no statistics of nosuch
export -o trace.json | no statistics of any board
export -o trace.json --wait 3 | --wait belongs to --when-late
blame nothing | no statistics of nothing
bench devstone --save letter/results | letter/results: Not a directory
new robot numpy | numpy
service install hoverbot | hoverbot | tachobot
service uninstall hoverbot | hoverbot | tachobot
service logs hoverbot | hoverbot | tachobot
service status hoverbot | hoverbot | tachobot
service install tachobot --root root --program /home/pi/run | lies below /home, which is hidden
service install tachobot --root root --program '/opt/my robot/run' | cannot stand in a unit
service install tachobot --root root --program run | cannot stand in a unit

# what was probably meant
chek tachobot | did you mean check? Expected
check tachobt | did you mean tachobot? Expected
check tachobot --set controler.yaw.kp=1 | did you mean controller? Expected
check tachobot --set controller.yaw.kpp=1 | did you mean kp? Expected
service statis | did you mean status? Expected
service logs detectiv | did you mean detective? Expected
run tachobot --doubles --clock virtul | did you mean virtual? Expected
bench timng | did you mean timing? Expected
recordings kep detective | 'kep': did you mean keep? Expected one of list, keep

# numbers
deploy host tachobot --port ssh | --port: 'ssh': expected a whole number
gate a b c --seed x | --seed: 'x': expected a whole number
run m:s --samples 1.5 | --samples: '1.5': expected a whole number
experiment loop-delay tachobot --every x | 'x': expected a positive
doubles fault --socket x | no kind
doubles fault clear imu --socket x | it ends all faults
doubles fault --socket x --as-test test_it.py --list | --list with --as-test
doubles fault --socket x --as-test test_it.py nack | --as-test with nack
doubles fault stuck --socket x --for -1 | expected 0 or more seconds
doubles fault stuck --socket x --list | --list with stuck
doubles fault stuck | --socket
doubles fault melt --socket x | expected one of

# runs
run tachobot --clock virtual | doubles
run tachobot --doubles --clock scaled | expected a speed
run tachobot --doubles --speed 2 | with clock scaled only
run tachobot --doubles --clock scaled --speed 0 | --speed
run tachobot --doubles --clock scaled --speed 1e308 | --speed
run tachobot --doubles --for 1e300 | --for
run tachobot --doubles --for -1 | --for
run tachobot --doubles --for nan | --for
run tachobot --doubles --clock sundial | --clock
run tachobot --doubles --clock virtual --trace /nowhere/trace | --trace /nowhere/trace
run tachobot --doubles --statistics /proc/no/such | /proc/no/such
{virtual} --statistics . | expected the path of a file
{virtual} --statistics '' | expected the path of a file
{virtual} --statistics folder | expected the path of a file
{virtual} --statistics x.guard | x.guard: expected another ending
{virtual} --statistics x.settings | x.settings: expected another ending
{virtual} --statistics x.recording | x.recording: expected another ending
{virtual} --statistics x.socket | x.socket: expected another ending
run tachobot --doubles nosuch.sock --clock virtual | doubles
run tachobot --doubles nosuch.sock --clock scaled --speed 2 | doubles
{virtual} --record absent/flight.recording | --record absent/flight.recording
{virtual} --plot run.svg | no picture of this run; expected doubles whose rig draws one
run tachobot --events some.ev | --events
{events} --doubles | --doubles
run detective --events /nowhere/file.ev | /nowhere/file.ev
{events} --outputs /nowhere/file.out | /nowhere/file.out
{events} --record absent/flight.recording | --record
run /nowhere/file.ma --events some.ev | /nowhere/file.ma
run detective --doubles --outputs letter | --outputs
{events} --plot letter | --plot
{events} --arm | --arm
{events} --supervised | --supervised
{events} --stage network | --stage
{events} --samples 5 | --samples
run detective --doubles --clock virtual --plot folder/none/run.svg | can be written
run detective --doubles --clock virtual --plot folder.svg | can be written

# stages
run tachobot --stage simulation --clock scaled --speed 4 | run: 2 fault
run tachobot --stage simulation --arm | run: 1 fault
run tachobot --stage simulation --doubles somewhere | run: 1 fault
run tachobot --stage simulation --link udp:127.0.0.1:7302 | run: 1 fault
run tachobot --stage network --link udp:127.0.0.1:7302 | run: 1 fault
run tachobot --stage network --link unix:here | run: 1 fault
run tachobot --stage remote --link ros2 | run: 1 fault
run tachobot --stage embedded --impair loss=1% | run: 1 fault
run tachobot --stage embedded --role robot | run: 1 fault
run tachobot --stage network --plot x.svg --statistics x.stats --supervised | run: 3 fault
run tachobot --stage network --peer localhost:7302 --key x | run: 2 fault
run tachobot --stage network --events x.ev | run: 1 fault
run tachobot --stage remote --key x | run: 1 fault
run tachobot --stage remote --peer localhost:7302 | run: 1 fault
{peer} localhost:7302 --key x --impair loss=1% | run: 1 fault
run tachobot --stage remote --impair delay=1,loss=2 | run: 2 fault
run tachobot --stage simulatoin | simulation
{free} --input 3:yaw_referense=1 | yaw_referense: no such input port
{free} --input 3:yaw_reference=east | yaw_reference: not a float
{free} --input 30:yaw_reference=1 | expected an earlier second
run tachobot --stage simulation --for 2 --input=2.5:yaw_reference=1 | expected an earlier second
run tachobot --stage simulation --input 1:yaw=1 --input 1:yaw_reference=true | 2 faults
run tachobot --stage simulation --input 1:yaw_reference=two | yaw_reference: not a float
run tachobot --doubles --peer x | --peer belongs to --stage remote
run tachobot --doubles --key x | --key belongs to --stage remote
run tachobot --doubles --impair x | --impair belongs to --stage remote
run tachobot --doubles --loop | --loop belongs to --role
run tachobot --fault 2:freeze:imu | doubles of this run's own; expected doubles that are made
run tachobot --doubles x --fault 2:freeze:imu | doubles fault --socket x
run tachobot --doubles --clock virtual --fault 2:freeze:imv --fault 1:silent | 2 faults | mean imu?
run tachobot --doubles --clock virtual --for 1 --fault 2:freeze:imu | the run ends at 1 s
run tachobot --doubles --fault 2:freze:imu | did you mean freeze?
run tachobot --doubles --fault 2:push=hard | expected SECONDS:KIND
run tachobot --doubles --fault 2:brown-out:imu:1 | it is over at once
run tachobot --doubles --fault 2:nack=3:imu | it has no amount
run tachobot --stage network --fault 2:freeze:imu | leave --fault out
run detective --events some.ev --fault 2:freeze | leave --fault out
run tachobot --doubles --input=yaw=1 | --input
run tachobot --doubles --input=-1:yaw=1 | --input
run tachobot --doubles --input=nan:yaw=1 | --input
run tachobot --doubles --input=1:yaw | --input
run tachobot --doubles --input=1:=1 | --input
run tachobot --doubles --input=1e10:yaw=1 | --input
{peer} nohost --key missing | --key: | No such file
{peer} 127.0.0.1:99999 --key missing | --key: | No such file
{peer} 127.0.0.1:7302 --key missing | --key: | No such file
continuity tachobot -o x.json --impair loss=lots | loss: 'lots': expected a share
continuity tachobot -o x.json --link ros2 --stages remote | which --stages leaves out
continuity tachobot -o x.json --impair loss=2% --stages network | which --stages leaves out
continuity tachobot -o certificate | certificate
continuity tachobot -o certificate.txt | certificate.txt
continuity tachobot -o absent/certificate.json | absent/certificate.json

# roles, links and addresses
run tachobot --role pilot --link unix:link | pilot: this board has no such role
run tachobot --role robot | --role and --link belong together
run tachobot --link unix:link | --role and --link belong together
run tachobot {link} tcp:1.2.3.4:5 | expected unix:PATH
run tachobot {link} unix: | expected unix:PATH
run tachobot {link} unix:{long} | 90 bytes at most
run tachobot {link} udp:10.1.2.3:7400 | can be reached from elsewhere
run tachobot {link} udp:127.0.0.1:7400,listen=0.0.0.0:1 | reached from elsewhere
run tachobot {link} udp:127.0.0.1:7400,kye=x | 'kye'
run tachobot {link} udp:127.0.0.1:7400,key=none | No such file
run tachobot {link} udp:127.0.0.1:7400,key=open.key | opens it to others
run tachobot {link} udp:127.0.0.1 | expected ADDRESS:PORT
run tachobot --role controller --link unix:link --doubles | --doubles: role controller
run tachobot --role controller --link unix:link --arm | --arm: role controller
run tachobot {link} unix:link --doubles --clock virtual | real time
dover tachobot | expected --send or --take
dover tachobot --send imu.sample | expected NAME=PORT
dover tachobot --take yaw_reference=70000 | expected NAME=PORT
dover tachobot --take a=1 --take a=2 | a: stated twice
dover tachobot --take a=1 --send b=1 | the robot would receive its own
send tachobot 0.5 | expected PORT=VALUE
send tachobot a=1 --key /nowhere | takes no key
send 127.0.0.1:9 a=1 --key /nowhere | /nowhere: No such file
show tachobot --key /nowhere | --key: has no effect here
send 192.0.2.1:9 a=1 | expected a key file
send 127.0.0.1:99999 a=1 | expected ADDRESS:PORT
send tachobo a=1 | tachobot
watch tachobot a --every 0 | expected a whole number from 1
set tachobot kp a=1 | kp
set tachobot =1 | =1
set nowhere | nowhere
stats --serve 0.0.0.0:9798 | expected unix:PATH, or a loopback address
stats --serve 10.1.2.3:1 | expected unix:PATH, or a loopback address
stats --serve 9798 | expected unix:PATH, or a loopback address
stats --serve 127.0.0.1:http | expected unix:PATH, or a loopback address
stats --serve 127.0.0.1:70000 | expected unix:PATH, or a loopback address
stats --serve 127.0.0.1:² | expected unix:PATH, or a loopback address
stats --serve unix:/{long} | too long
stats --serve 127.0.0.1:0 --every 1 | --every belongs to --prometheus
stats --serve unix:letter | Address already in use
stats --json --histogram | --histogram
stats --diff a b --merge c | --merge
stats --json --prometheus | --prometheus
deploy | 2 faults | HOST: missing | BOARD: missing
deploy robot | BOARD: missing; expected
deploy robot tachobot --sign no.key | no.key: no file; expected an ssh key
deploy robot --to 0.1.0 --sign {detective} | --sign: has no effect with --to
deploy robot --to 0.1.0 --settings {detective} | --settings: has no effect with --to
deploy robot tachobot --all fleet.toml | 2 faults | HOST: has no effect with --all | BOARD: has
deploy --all nowhere.toml --port 22 | --port: has no effect with --all
deploy --all nowhere.toml | nowhere.toml: cannot be read
deploy -- -oProxyCommand=true tachobot | '-oProxyCommand=true': no host
deploy -- 'a b' tachobot | 'a b': no host
deploy -- pi@host:22 tachobot | 'pi@host:22': no host
deploy -- '' tachobot | '': no host
deploy -- 'host;true' tachobot | 'host;true': no host
deploy robot tachobot --settings tachobot | tachobot: no file; expected a board.toml
deploy robot tachobot --settings folder | folder: no file; expected a board.toml
deploy robot tachobot --settings nowhere.toml | nowhere.toml: no file; expected a board.toml
deploy robot tachobot --root '' | '': expected a folder's whole path
deploy robot tachobot --root / | '/': expected a folder's whole path
deploy robot tachobot --root here | 'here': expected a folder's whole path
deploy robot tachobot --root '/srv/a robot' | '/srv/a robot': expected a folder's whole path
deploy robot tachobit --wheel no.whl --settings {detective} | 2 faults | not of tachobit

# models, sweeps and plants
export tachobot | its model takes no event files
export detective -o x.txt | expected a name that ends in .ma
export no_such_module:Top | ModuleNotFoundError
export builtins:dict | no signature found
export firmware_boards.detective.detective:Nobody | has no Nobody
export firmware_runtime:Atomic | an atomic model
export {ma} --set model.hop_s=1 | --set: has no effect
run {ma} --stage simulation | leave --stage out
export detective -o x.py | becomes no Python source
export {ma} --last 3 | --last: has no effect
export | no model; expected a board
show --state a --whole | --state: has no effect here
export no/such.ma | cannot be read
export {ma} -o 2nd.py | expected a name that Python can import
export {ma} -o /no/such/folder/x.py | expected a file that can be
show detective -o picture.gif | picture.gif
show detective -o /nowhere/picture.svg | /nowhere/picture.svg
show detective --state nosuch -o picture.svg | nosuch
show submarine -o picture.svg | submarine
sweep tachobot | no file for the table
sweep tachobot -o t.csv | nothing is varied
sweep tachobot -o t.csv --vary x | expected KEY=DISTRIBUTION
sweep tachobot t.csv --vary a=range(2) | expected options only
sweep nix -o t.csv --vary a=range(2) | nix: unknown board
sweep show | no FILE
sweep show none.csv | No such file
sweep show none.csv -o none.csv | a name that ends in .html
sweep rerun none.csv | no ROW
campaign rerun none.csv | a folder of findings
campaign rerun none 3 | a file named .parquet or .csv
sweep rerun none.csv 1 --set a=1 | belong to a sweep of a board
sweep tachobot -o t.csv --scheduler x --workers 2 | expected one
identify detective --from letter | names no plant
identify balancing --from letter | names no plant
identify pan_tilt --from letter | names no plant
identify tachobot --from missing | missing
identify tachobot --from missing -o plant.txt | a name that ends in .json or .html
identify tachobot --from missing --since -1 | expected a second of the run
tune detective --plant {plant} | names no plant
tune balancing --plant {plant} | names no plant
tune pan_tilt --plant {plant} | names no plant
tune tachobot | --plant
tune tachobot --plant x=1 | x
tune tachobot --plant {plant} --from x | --from
tune tachobot --from nowhere | nowhere

# chips
doubles serve --usbip --chip pca9685 --chip maxbotix | ports.maxbotix
doubles serve --socket doubles | neither given
doubles serve tachobot --chip mpu9250 --socket doubles | both given
doubles serve --chip mpu9250 --set a=1 --socket doubles | --set
doubles serve --chip mpu9520 --socket doubles | did you mean mpu9250?
doubles serve --chip pca9685 --chip h_bridge --socket doubles | 0x40
doubles serve --usbip --socket doubles | neither given
doubles serve --usbip tachobot --chip mpu9250 --socket doubles | both given
doubles serve --usbip --chip mpu9250 --set a=1 --socket doubles | --set
doubles serve --usbip --chip mpu9520 --socket doubles | did you mean mpu9250?
doubles serve --usbip --chip pca9685 --chip h_bridge --socket doubles | 0x40
doubles replay nowhere --socket doubles | no run of a board of this name has left
doubles replay letter --socket doubles | not a recording of a run
doubles replay letter --from -1 --socket doubles | expected a second of the run
try | CHIP
try toaster | toaster
try pca9685 --duty 0.5 | --channel
try pca9685 --channel 16 --duty 0.5 | 16
try pca9685 --channel 1 --duty nan | nan
try pca9685 --channel 1 --duty 0.5 --for 61 | 61
try pca9685 --channel 1 --duty 0.5 --address 0x70 | 0x70
try md25 --left 2 --doubles | 2
try md25 --doubles | --left
try srf08 --doubles --bus 99 | --bus
try maxbotix --doubles --port /dev/ttyS0 | --port
try cmps12 --address north | north
try cmps12 --yes | --yes
try maxbotix --family toaster | toaster

# recordings
recordings collect tachobot | --into: expected a folder
recordings collect tachobot --into /proc/none | cannot be made
recordings collect tachobot --into x --runs 0 | expected a whole number from 1 on
recordings collect tachobot --into x --budget 0 | expected a positive number
recordings collect tachobot --into x --late-us -1 | expected a positive number
recordings keep | required: RUN
recordings recover detective | required: -o
recordings recover none -o x | no file
recordings list --in nowhere | no folder
replay letter | letter
replay absent | absent
replay '' | no file
replay .. | no file
export '' -o x.csv | no file
recordings keep '' | no file
replay letter --as-test . | expected the name of a module
replay letter --as-test '' | expected the name of a module
replay {long} | no file
"""
ROWS = [row for row in TABLE.splitlines() if row and not row.startswith("#")]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where the command is called, with what the rows name."""
    place = tmp_path / "here"
    (place / "folder").mkdir(parents=True)
    (place / "folder.svg").mkdir()
    (place / "letter").write_text("Dear Sir,")
    (place / "some.ev").write_text("00:00:02:00 In1 1\n")
    write_key(place / "open.key")
    (place / "open.key").chmod(0o644)
    monkeypatch.chdir(place)
    monkeypatch.delenv("STATE_DIRECTORY", raising=False)
    return place


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.partition(" | ")[0])
def test_it_is_refused(command: Command, folder: Path, row: str) -> None:
    line, *parts = row.split(" | ")
    before = {path: path.stat().st_mtime_ns for path in folder.rglob("*")}
    said = command.refused(*shlex.split(line.format(**WORDS)))
    for part in parts:
        assert (part.removeprefix("!") in said) is not part.startswith("!"), said
    first, *rest = said.splitlines()
    assert rest == [] or " fault" in first or first.startswith("usage: ")
    assert {path: path.stat().st_mtime_ns for path in folder.rglob("*")} == before
