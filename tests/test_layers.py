"""Imports between rooms: data flows one way, and estimation is independent of simulation."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
from tests.arm import arm_log, save_npz, write_arm

import stribeck
from stribeck_simulation.demo import SCENARIO

SOURCE = Path(__file__).parents[1] / "src"
FLOORS = (
    *("errors", "base", "settings", "friction", "robot", "differentiation", "log", "dynamics", "contact"),
    *("friction_torque", "result", "judgement", "whole_log", "audit", "drives", "methods"),
    *("plan", "exporters", "init", "inspection", "report", "replay", "compose", "pipeline", "fleet", "online", "cli"),
)
"""Rooms from the ground up: each imports only rooms before it."""
NARROW = {
    "friction": {"errors", "base"},
    "robot": {"errors", "base", "settings"},
    "log": {"errors", "base", "settings", "robot"},
    "judgement": {"base", "settings", "friction", "result", "friction_torque"},
    "exporters": {"errors", "base", "friction", "robot", "result"},
    "report": {"errors", "base", "friction", "friction_torque", "result"},
}
"""Rooms that may import only these."""
ENTRANCE = {"stribeck.cli.simulation", "stribeck.__main__"}


def modules(package: str = "stribeck") -> dict[str, Path]:
    found = {}
    for path in sorted((SOURCE / package).rglob("*.py")):
        parts = path.relative_to(SOURCE).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


MODULES = modules()


@cache
def imports(path: Path) -> set[str]:
    """List the modules of this package that a file imports at run time."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            node.body = []
    return {name for name in _named(tree) if name.split(".")[0] in {"stribeck", "stribeck_simulation"}}


def hidden(path: Path) -> set[str]:
    """List the modules of this package that a file names in any import, also for types and by `import_module`."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    calls = (
        node for node in ast.walk(tree) if isinstance(node, ast.Call) and ast.unparse(node.func) == "import_module"
    )
    by_name = {str(each.args[0].value) for each in calls if isinstance(each.args[0], ast.Constant)}
    return {name for name in (*_named(tree), *by_name) if name.startswith("stribeck.")}


def _named(tree: ast.AST) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        if isinstance(node, ast.ImportFrom) and node.module:
            inner = [f"{node.module}.{alias.name}" for alias in node.names]
            yield from (name if name in MODULES else node.module for name in inner)


def room_of(module: str) -> str:
    return module.split(".")[1] if "." in module else ""


def rooms_below(room: str) -> set[str]:
    own = [path for module, path in MODULES.items() if room_of(module) == room]
    return {room_of(name) for path in own for name in imports(path) if name.startswith("stribeck.")} - {room}


def test_every_room_has_its_floor() -> None:
    assert {room_of(module) for module in MODULES} - {"", "__main__"} == set(FLOORS)


@pytest.mark.parametrize("room", FLOORS)
def test_a_room_imports_only_rooms_below(room: str) -> None:
    assert rooms_below(room) <= NARROW.get(room, set(FLOORS[: FLOORS.index(room)]))


def test_files_do_not_import_each_other_in_a_circle() -> None:
    """Imports for types and by `import_module` count, but for the table of names that users import."""
    below = {module: hidden(path) & set(MODULES) - {module} for module, path in MODULES.items()}
    for of_frames in ("stribeck.log.readers", "stribeck.log.writers"):  # of RobotLog.from_frame and to_frame
        below["stribeck.log.robot_log"].remove(of_frames)
    while ready := [name for name, needed in below.items() if not needed]:
        below = {name: needed - set(ready) for name, needed in below.items() if name not in ready}
    assert not below


def test_the_name_of_a_class_means_one_thing() -> None:
    names = [
        node.name
        for path in MODULES.values()
        for node in ast.parse(path.read_text()).body
        if isinstance(node, ast.ClassDef)
    ]
    assert len(names) > 100
    assert len(names) == len(set(names))


def test_the_whole_log_fit_does_not_know_robot_and_log() -> None:
    """Only its equations depend on the robot."""
    own = [path for module, path in MODULES.items() if module.startswith("stribeck.whole_log.")]
    inner = [path for path in own if "equations" not in path.parts]
    reached = {name for path in inner for name in imports(path)}
    assert not {name for name in reached if room_of(name) in {"robot", "log"}} - {"stribeck.robot.inertial_parameters"}


def test_estimation_never_imports_simulation() -> None:
    knows = {module for module, path in MODULES.items() if any("stribeck_simulation" in name for name in imports(path))}
    assert len(MODULES) > 100
    assert knows <= ENTRANCE


def test_simulation_does_not_know_the_estimator() -> None:
    """The ground truth must be independent of the tested code."""
    reached = {name for path in modules("stribeck_simulation").values() for name in imports(path)}
    rooms = {room_of(name) for name in reached if name.startswith("stribeck.")}
    assert not rooms & {"whole_log", "judgement", "methods", "pipeline", "friction_torque", "cli"}


def test_only_the_registry_knows_the_methods() -> None:
    knows = {module for module, path in MODULES.items() if any(_is_method(name) for name in imports(path))}
    assert {room_of(module) for module in knows} == {"methods"}


def _is_method(name: str) -> bool:
    return name.startswith("stribeck.methods.") and name != "stribeck.methods.contract"


@pytest.mark.parametrize("program", ["import stribeck", "import stribeck.__main__ as program; program.main()"])
def test_what_is_slow_to_import_waits_until_it_is_needed(program: str) -> None:
    slow = {"numpy", "pydantic", "pinocchio", "scipy", "h5py", "pyarrow", "matplotlib", "mujoco", "daqp"}
    listing = "import atexit, sys; atexit.register(lambda: print(*sys.modules))"
    command = [sys.executable, "-c", f"{listing}; {program}", "--help"]
    loaded = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    assert "stribeck" in loaded
    assert not slow & set(loaded)


WITHOUT = "import sys; sys.modules.update(mujoco=None, daqp=None, matplotlib=None); import stribeck.cli as s; s.main()"


def light(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Run the command line where neither MuJoCo, a QP solver nor Matplotlib is installed."""
    command = [sys.executable, "-c", WITHOUT, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_a_urdf_needs_no_simulation(tmp_path: Path) -> None:
    robot = write_arm(tmp_path)
    log = save_npz(arm_log(stribeck.Robot.from_file(robot), duration=6, rate=250), tmp_path / "log.npz")
    done = light("identify", log, "-r", robot, "-o", tmp_path / "out", "--method", "curve-fit")
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "out/report.html").is_file()


@pytest.mark.parametrize("command", [["demo"], ["simulate", SCENARIO]])
def test_simulation_needs_its_extra(command: list[object], tmp_path: Path) -> None:
    done = light(*command, "-o", tmp_path / "log.npz")
    assert done.returncode == 2
    assert done.stderr == "stribeck: simulation needs mujoco and daqp: pip install 'stribeck[simulation]'\n"
    assert not list(tmp_path.iterdir())
