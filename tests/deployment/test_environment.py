"""The content of an environment, as it is laid out for a target."""

import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib.util import MAGIC_NUMBER
from pathlib import Path
from zipfile import ZipFile

import pytest

from firmware_runtime.errors import DeploymentError
from firmware_runtime.host.deployment import environment
from firmware_runtime.host.deployment.needed_wheels import needed
from firmware_runtime.host.deployment.target import Target

HERE = Target.read(
    f"machine x86_64\npython 3.{sys.version_info.minor}.0\nbase {sys.executable}\n"
    f"magic {MAGIC_NUMBER.hex()}\n"
)


def make_wheel(folder: Path, name: str, *needs: str, version: str = "1.0") -> Path:
    """A wheel with a module of its name that prints it, and a program that runs that."""
    metadata = f"{name}-{version}.dist-info"
    required = "".join(f"Requires-Dist: {each}\n" for each in needs)
    texts = {
        f"{name}.py": f"def main():\n    print({name!r}, __file__)\n",
        f"{name}-{version}.data/data/share/{name}.txt": name,
        f"{metadata}/METADATA": f"Name: {name}\nVersion: {version}\n{required}",
        f"{metadata}/WHEEL": "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
        f"{metadata}/entry_points.txt": f"[console_scripts]\n{name} = {name}:main\n",
    }
    record = f"{metadata}/RECORD"
    wheel = folder / f"{name}-{version}-py3-none-any.whl"
    with ZipFile(wheel, "w") as archive:
        for place, text in texts.items():
            archive.writestr(place, text)
        archive.writestr(record, "".join(f"{place},,\n" for place in [*texts, record]))
    return wheel


def test_what_was_laid_out_runs_where_it_is_put(tmp_path: Path) -> None:
    wheels, content, place = tmp_path / "wheels", tmp_path / "content", tmp_path / "venv.aaaaaa"
    wheels.mkdir()
    heron = make_wheel(wheels, "heron")
    environment.lay_out(wheels, [heron], HERE, content, str(place))
    assert environment.compile_bytecode(content, HERE, "/srv/venv")
    listed = environment.seal(content)
    (content / "bin/python").symlink_to(sys.executable)
    content.rename(place)
    words = [str(place / "bin/heron")]
    done = subprocess.run(words, capture_output=True, text=True, check=True, env={})
    site = f"{place}/lib/python{HERE.minor_version}/site-packages"
    assert done.stdout == f"heron {site}/heron.py\n"
    assert (place / "share/heron.txt").read_text() == "heron"
    names = [line[66:] for line in listed.splitlines()]
    assert f"./lib/python{HERE.minor_version}/site-packages/heron.py" in names
    assert [name for name in names if name.endswith(".pyc")]
    (place / "bin/python").unlink()
    assert environment.seal(place) == listed, "the bytecode of here was taken"


def test_the_same_content_has_the_same_times_wherever_it_lies(tmp_path: Path) -> None:
    wheels = tmp_path / "wheels"
    wheels.mkdir()
    heron = make_wheel(wheels, "heron")
    seen: list[dict[str, tuple[int, bytes]]] = []
    for name in ("a", "b"):
        content = tmp_path / name
        environment.lay_out(wheels, [heron], HERE, content, f"/srv/venv.{name * 6}")
        environment.compile_bytecode(content, HERE, "/srv/venv")
        environment.seal(content)
        files = [path for path in (content / "lib").rglob("heron*") if path.is_file()]
        seen.append({each.name: (each.stat().st_mtime_ns, each.read_bytes()) for each in files})
    assert seen[0] == seen[1]
    assert any(name.endswith(".pyc") for name in seen[0])


def test_without_a_python_of_that_version_the_target_makes_the_bytecode(tmp_path: Path) -> None:
    assert not environment.compile_bytecode(tmp_path, replace(HERE, magic="00000000"), "/srv/venv")


@pytest.mark.parametrize(
    ("needs", "system", "chosen"),
    [
        ({"rover": ["a>=2"], "a": ["b"], "b": []}, "", ["a", "b", "rover"]),
        ({"rover": ["a>=2"], "a": ["b"], "b": []}, "A==2.1", ["rover"]),
        ({"rover": ["a>=2"], "a": ["b"], "b": []}, "a==1.9 b==1", ["a", "rover"]),
        ({"rover": ["a>=2", "b"], "a": [], "b": ["a<2.1"]}, "a==2.1", ["a", "b", "rover"]),
        ({"rover": ["a>=1"], "a": []}, "a==2010-unknown rover==9", ["a", "rover"]),
        ({"rover": ["a>=1"], "a": []}, "a==2010-unknown", ["a", "rover"]),
        ({"rover": ['a; python_version < "3"'], "a": []}, "", ["rover"]),
        ({"rover": ['a; sys_platform == "linux"'], "a": []}, "", ["a", "rover"]),
        ({"rover": ['a; extra == "top"', 'b; extra == "no"'], "a": []}, "", ["a", "rover"]),
        ({"rover": ["a[x]"], "a": ['b; extra == "x"'], "b": []}, "", ["a", "b", "rover"]),
        ({"rover": ["a"], "a": ["rover"]}, "", ["a", "rover"]),
    ],
)
def test_what_the_system_has_and_what_suffices_is_left_to_it(
    tmp_path: Path, needs: Mapping[str, Sequence[str]], system: str, chosen: Sequence[str]
) -> None:
    wheels = {name: make_wheel(tmp_path, name, *each) for name, each in needs.items()}
    target = replace(HERE, packages=system)
    found = needed(wheels.values(), [wheels["rover"]], ["top"], target)
    assert [wheel.name.partition("-")[0] for wheel in found] == chosen


def test_a_wheel_that_is_missing_is_found_out_here(tmp_path: Path) -> None:
    rover = make_wheel(tmp_path, "rover", "heron; python_version >= '3'", "heron_chip")
    with pytest.raises(DeploymentError, match="no wheel of heron, heron-chip; expected one for cp"):
        needed([rover], [rover], [], HERE)


def test_a_wheel_without_a_record_is_refused(tmp_path: Path) -> None:
    (tmp_path / "wheels").mkdir()
    wheel = make_wheel(tmp_path, "rover")
    broken = tmp_path / "wheels" / wheel.name
    with ZipFile(wheel) as whole, ZipFile(broken, "w") as archive:
        for name in whole.namelist():
            if not name.endswith("RECORD"):
                archive.writestr(name, whole.read(name))
    with pytest.raises(DeploymentError) as failed:
        environment.lay_out(tmp_path / "wheels", [broken], HERE, tmp_path / "content", "/srv/venv")
    assert failed.value.where == wheel.name
