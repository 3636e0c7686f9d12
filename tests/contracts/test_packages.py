"""Packages: none of ours is installed by its name; the ROS 2 workspace is whole."""

import ast
import importlib.util
import re
import subprocess
import sys
import tomllib
from configparser import ConfigParser
from pathlib import Path
from types import ModuleType
from xml.etree import ElementTree as ET

import pytest

from firmware_runtime.system.packages import install_command

ROOT = Path(__file__).parents[2]
BY_NAME = re.compile(
    r"""pip3?\s+(?:install|download)\b[^\n#&|,`]*?\s['"]?firmware[-_]runtime(?![\w./-])"""
    r"""|^(?:dependencies|requires)\b[^\n]*['"]firmware[-_]runtime\b""",
    re.MULTILINE,
)


def test_the_pattern_finds_an_installation_by_name_and_no_other() -> None:
    for text in (
        "pip install firmware-runtime",
        "python -m pip install --upgrade 'firmware-runtime[top]' pytest",
        'dependencies = ["firmware-runtime"]',
        'dependencies = ["numpy", "firmware_runtime>=0.1"]',
    ):
        assert BY_NAME.search(text), text
    for text in (
        "pip install /srv/firmware-runtime",
        "pip install wheels/firmware_runtime-*.whl pytest .",
        "pip install pytest  # beside firmware-runtime",
        "pip install .",
    ):
        assert not BY_NAME.search(text), text


def test_no_page_program_workflow_or_generated_file_installs_it_by_its_name() -> None:
    listed = subprocess.run(
        ["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    endings = {".md", ".py", ".toml", ".yml", ".yaml", ".sh", ".txt", ".cfg", ".service"}
    found = [
        name
        for name in listed.stdout.splitlines()
        if Path(name).suffix in endings
        and Path(name) != Path(__file__).relative_to(ROOT)
        and (ROOT / name).is_file()
        and BY_NAME.search((ROOT / name).read_text(encoding="utf-8"))
    ]
    assert found == []


def test_what_tests_and_benches_take_is_no_extra_of_an_installed_robot() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert set(project["project"]["optional-dependencies"]) == {
        "metrics",
        "gpio",
        "top",
        "view",
        "foxglove",
        "completion",
        "deploy",
        "plot",
        "tuning",
        "sweep",
        "mcap",
        "parquet",
        "pandas",
        "ros",
    }
    assert set(project["dependency-groups"]) == {"test", "bench", "fuzz"}
    assert {"include-group": "bench"} in project["dependency-groups"]["test"]


@pytest.mark.parametrize(
    ("extra", "package"),
    [
        ("plot", "matplotlib"),
        ("sweep", "distributed"),
        ("parquet", "pyarrow"),
        ("gpio", "gpiod"),
        ("top", "rich"),
        ("completion", "argcomplete"),
        ("metrics", "prometheus-client"),
    ],
)
def test_an_extra_is_installed_by_what_it_lists(extra: str, package: str) -> None:
    command = install_command(extra)
    assert command.startswith(f"{sys.executable} -m pip install '{package}>=")
    assert "firmware-runtime" not in command.removeprefix(sys.executable)


PACKAGE = ROOT / "ros2/src/firmware_runtime_ros2"
ORDER = ("name", "version", "description", "maintainer", "license", "exec_depend", "export")
"""Of the elements that we use, in which the schema of package format 3 demands them."""


def manifest() -> ET.Element:
    return ET.parse(PACKAGE / "package.xml").getroot()  # noqa: S314 -- a file of our own


def module(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


def test_the_manifest_is_one_of_format_3() -> None:
    root = manifest()
    assert (root.tag, root.get("format")) == ("package", "3")
    tags = [each.tag for each in root]
    assert tags == sorted(tags, key=ORDER.index)
    assert set(tags) == set(ORDER)
    assert re.fullmatch(r"[a-z][a-z0-9_]*", root.findtext("name", ""))
    assert re.fullmatch(r"\d+\.\d+\.\d+", root.findtext("version", ""))
    assert "@" in str(root.find("maintainer").get("email"))  # type: ignore[union-attr] # it is there
    assert root.findtext("export/build_type") == "ament_python"


def test_manifest_setup_and_project_agree() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    call = ast.parse((PACKAGE / "setup.py").read_text())
    version = next(
        each.value.value  # type: ignore[attr-defined] # a keyword with a text
        for each in ast.walk(call)
        if isinstance(each, ast.keyword) and each.arg == "version"
    )
    assert manifest().findtext("version") == version == project["version"]


def test_every_message_package_that_the_node_imports_is_a_dependency() -> None:
    stated = {each.text for each in manifest().findall("exec_depend")}
    sources = (ROOT / "firmware_runtime/links/ros2").rglob("*.py")
    imported = {
        name
        for source in sources
        for name in re.findall(r"^(?:from|import) (\w+)", source.read_text(), re.MULTILINE)
    }
    of_ros = {name for name in imported if name.endswith(("_msgs", "_srvs", "_interfaces"))}
    assert of_ros | {"rclpy"} <= stated


def test_all_that_is_installed_is_there() -> None:
    text = (PACKAGE / "setup.py").read_text()
    for name in ("package.xml", "launch/robot.launch.py"):
        assert name in text
        assert (PACKAGE / name).is_file()
    assert (PACKAGE / "resource/firmware_runtime_ros2").read_text() == ""
    scripts = ConfigParser()
    scripts.read(PACKAGE / "setup.cfg")
    place = "$base/lib/firmware_runtime_ros2"  # where `ros2 run` looks
    assert scripts["develop"]["script_dir"] == scripts["install"]["install_scripts"] == place


def test_the_launch_file_compiles_and_has_its_function() -> None:
    source = (PACKAGE / "launch/robot.launch.py").read_text()
    compile(source, "robot.launch.py", "exec")
    functions = [each.name for each in ast.parse(source).body if isinstance(each, ast.FunctionDef)]
    assert functions == ["generate_launch_description"]
    assert 'executable="robot"' in source


def test_the_entry_point_becomes_the_program(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    robot = module(PACKAGE / "firmware_runtime_ros2/robot.py")
    assert callable(robot.main)
    words = robot.command("/bin/f", ["tachobot", "--autostart", "--ros-args", "-r", "__ns:=/x"])
    assert words[:4] == ["/bin/f", "ros2", "tachobot", "--venv"]
    assert words[5:] == ["--autostart", "--ros-args", "-r", "__ns:=/x"]
    assert robot.command("/bin/f", ["x", "--venv", "/v"]) == ["/bin/f", "ros2", "x", "--venv", "/v"]
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("FIRMWARE_RUNTIME_PROGRAM", raising=False)
    with pytest.raises(SystemExit) as ended:
        robot.main()
    assert "expected it on the path" in str(ended.value)
