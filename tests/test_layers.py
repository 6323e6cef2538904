"""The house: which room may import which, and how large each may be."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
from tests.arm import arm_log, save_npz, write_arm

import stribeck
from stribeck.simulation.demo import SCENARIO

SOURCE = Path(__file__).parents[1] / "src" / "stribeck"
ROOMS: dict[str, tuple[set[str], int]] = {
    "core": (set(), 12_574),
    "io": ({"core"}, 2_534),
    "check": ({"core", "io"}, 3_254),
    "paper": ({"core"}, 1_950),
    "simulation": ({"core", "io"}, 3_230),
    "design": ({"core", "check", "simulation"}, 1_748),
    "service": ({"core", "io"}, 1_650),
    "app": ({"core", "io", "check", "simulation", "design", "service"}, 3_498),
}
"""Rooms that a room may import, and its largest number of code lines, which only falls."""
FLOORS = (
    {"base"},
    {"filters", "friction", "robot"},
    {"log"},
    {"dynamics", "result"},
    {"equations", "judgement"},
    {"estimator"},
    {"identify"},
)
"""Rooms of the core from the ground up: each imports only rooms on lower floors."""


def modules() -> dict[str, Path]:
    found = {}
    for path in sorted(SOURCE.rglob("*.py")):
        parts = ("stribeck", *path.relative_to(SOURCE).with_suffix("").parts)
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


MODULES = modules()


@cache
def imports(module: str) -> set[str]:
    """List the modules of this package that a module names in any import, also for types and by `import_module`."""
    return {name for name in _named(ast.parse(MODULES[module].read_text())) if name.startswith("stribeck.")}


def _named(tree: ast.AST) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        if isinstance(node, ast.ImportFrom) and node.module:
            inner = [f"{node.module}.{alias.name}" for alias in node.names]
            yield from (name if name in MODULES else node.module for name in inner)
        if isinstance(node, ast.Call) and ast.unparse(node.func).endswith("import_module"):
            yield from (str(part.value) for part in ast.walk(node.args[0]) if isinstance(part, ast.Constant))


def room_of(module: str) -> str:
    return module.split(".")[1] if "." in module else ""


def floor_of(module: str) -> str:
    """Name the room of a module of the core; its own files belong to the ground."""
    parts = module.split(".")
    return parts[2] if len(parts) > 2 and parts[2] not in ("errors", "settings") else "base"


def code_lines(path: Path) -> int:
    """Count the lines with code: without comments, docstrings and empty lines."""
    text, prose = path.read_text(), set[int]()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            prose |= set(range(node.lineno, node.value.end_lineno + 1))  # type: ignore[operator]
    lines = enumerate(map(str.strip, text.splitlines()), 1)
    return sum(k not in prose and bool(line) and not line.startswith("#") for k, line in lines)


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_keeps_to_its_doors_and_its_size(room: str) -> None:
    """It imports modules of the core, and other rooms through their `__init__`; its README says what it owns."""
    allowed, most = ROOMS[room]
    own = [module for module in MODULES if room_of(module) == room]
    others = {name for module in own for name in imports(module) if room_of(name) != room}
    assert {room_of(name) for name in others} <= allowed
    assert {name for name in others if room_of(name) != "core"} <= {f"stribeck.{name}" for name in allowed}
    assert sum(code_lines(MODULES[module]) for module in own) <= most
    readme = (SOURCE / room / "README.md").read_text()
    assert len(readme.splitlines()) <= 15
    assert all(f"`{name}`" in readme for name in allowed)


def test_every_room_has_its_place() -> None:
    assert {room_of(module) for module in MODULES} - {"", "__main__", "moved", "plot", "prediction"} == set(ROOMS)
    assert {floor_of(module) for module in MODULES if room_of(module) == "core"} == set().union(*FLOORS)


def test_the_core_has_few_floors_and_arrows() -> None:
    below, arrows = set[str](), 0
    for floor in FLOORS:
        for room in floor:
            own = [module for module in MODULES if room_of(module) == "core" and floor_of(module) == room]
            used = {floor_of(name) for module in own for name in imports(module)} - {room}
            assert used <= below, room
            arrows += len(used)
        below |= floor
    assert arrows <= 39


def test_files_do_not_import_each_other_in_a_circle() -> None:
    below = {module: imports(module) & set(MODULES) - {module} for module in MODULES}
    while ready := [name for name, needed in below.items() if not needed]:
        below = {name: needed - set(ready) for name, needed in below.items() if name not in ready}
    assert not below


def test_the_name_of_a_class_means_one_thing() -> None:
    paths = [path for module, path in MODULES.items() if room_of(module) != "simulation"]
    names = [n.name for path in paths for n in ast.parse(path.read_text()).body if isinstance(n, ast.ClassDef)]
    assert len(names) > 100
    assert len(names) == len(set(names))


def test_the_ground_truth_does_not_know_the_estimator() -> None:
    reached = {name for module in MODULES if room_of(module) == "simulation" for name in imports(module)}
    assert not {floor_of(name) for name in reached if room_of(name) == "core"} & {"equations", "judgement", "estimator"}


@pytest.mark.parametrize("program", ["import stribeck", "import stribeck.__main__ as program; program.main()"])
def test_what_is_slow_to_import_waits_until_it_is_needed(program: str) -> None:
    slow = {"numpy", "pydantic", "pinocchio", "scipy", "h5py", "pyarrow", "matplotlib", "mujoco", "daqp"}
    listing = "import atexit, sys; atexit.register(lambda: print(*sys.modules))"
    command = [sys.executable, "-c", f"{listing}; {program}", "--help"]
    loaded = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    assert "stribeck" in loaded
    assert not slow & set(loaded)


WITHOUT = (
    "import sys; sys.modules.update(mujoco=None, daqp=None, matplotlib=None); import stribeck.app.cli as s; s.main()"
)


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
