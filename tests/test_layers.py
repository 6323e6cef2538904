"""Who may import whom: data flows one way, and estimation cannot know whether a robot is simulated."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[1] / "src"
GROUND = {"errors", "typing", "settings", "samples", "weak_equations", "inertial_parameters", "outputs", "version"}
GROUND |= {"threads", "finding", "files"}
"""Carriers and small tools; of a room below, a carrier alone may be named with a dot."""

ABOVE: dict[str, set[str]] = {
    "log": GROUND | {"log", "robot", "motion"},
    "friction": GROUND | {"friction"},
    "motion": GROUND | {"motion"},
    "robot": GROUND | {"robot"},
    "result": GROUND | {"result", "friction"},
    "dynamics": GROUND | {"dynamics", "robot", "log.robot_log", "log.storage"},
    "contact": GROUND | {"contact", "dynamics", "log", "robot"},
    "preparation": GROUND | {"contact", "dynamics", "log", "motion", "robot"},
    "friction_torque": GROUND
    | {"friction_torque", "preparation", "contact", "dynamics", "log", "motion", "result", "robot"},
    "audit": GROUND | {"audit", "friction_torque", "preparation", "contact", "dynamics", "log", "motion", "robot"},
    "equations": GROUND | {"equations", "contact", "dynamics", "log", "motion", "robot"},
    "identification": GROUND | {"identification", "friction", "result"},
    "replay": GROUND
    | {
        "replay",
        "audit",
        "identification",
        "friction_torque",
        "preparation",
        "contact",
        "dynamics",
        "log",
        "motion",
        "robot",
    },
    "planning": GROUND
    | {"planning", "preparation", "equations", "identification", "dynamics", "friction", "result", "robot"},
    "export": GROUND | {"export", "friction", "result", "robot"},
    "report": GROUND | {"report", "friction", "result"},
}
"""Room -> what it may import. Methods, the spine and the command line stand above all of them."""

UPPER = {"methods", "pipeline", "compose", "inspection", "cli", "draft"}
ENTRANCE = {"stribeck.cli.app", "stribeck.__main__"}


def modules(package: str = "stribeck") -> dict[str, Path]:
    found = {}
    for path in sorted((SOURCE / package).rglob("*.py")):
        parts = path.relative_to(SOURCE).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


MODULES = modules()


@cache
def imports(path: Path) -> set[str]:
    """Return the modules of this package that a file imports at run time."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            node.body = []
    return {name for name in _named(tree) if name.split(".")[0] in {"stribeck", "stribeck_simulation"}}


def _named(tree: ast.AST) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        if isinstance(node, ast.ImportFrom) and node.module:
            inner = [f"{node.module}.{alias.name}" for alias in node.names]
            yield from (name if name in MODULES else node.module for name in inner)


def room_of(module: str) -> str:
    return module.split(".")[1] if "." in module else ""


@pytest.mark.parametrize("room", ABOVE)
def test_a_room_imports_only_what_it_stands_on(room: str) -> None:
    own = [path for module, path in MODULES.items() if room_of(module) == room]
    assert own
    reached = {name.removeprefix("stribeck.") for path in own for name in imports(path)}
    strangers = {name for name in reached if name not in ABOVE[room] and name.split(".")[0] not in ABOVE[room]}
    assert not strangers


def test_every_room_has_its_rule() -> None:
    rooms = {room_of(module) for module in MODULES} - {"", "__main__"}
    assert rooms == set(ABOVE) | UPPER | GROUND


def _circle(below: dict[str, set[str]]) -> dict[str, set[str]]:
    """Return what is left of a graph once all that stands on nothing is taken away, again and again."""
    while ready := [name for name, needed in below.items() if not needed]:
        below = {name: needed - set(ready) for name, needed in below.items() if name not in ready}
    return below


def test_neither_files_nor_rooms_import_each_other_in_a_circle() -> None:
    below = {module: imports(path) & set(MODULES) - {module} for module, path in MODULES.items()}
    rooms: dict[str, set[str]] = {room_of(module): set() for module in MODULES}
    for module, needed in below.items():
        rooms[room_of(module)] |= {room_of(name) for name in needed} - {room_of(module)}
    assert not _circle(below)
    assert not _circle(rooms)


def test_a_file_that_is_imported_once_lies_beside_its_importer() -> None:
    """Files of the root alone: rooms are small enough to be seen at a glance."""
    importers: dict[str, set[str]] = {module: set() for module in MODULES}
    for module, path in MODULES.items():
        for name in imports(path) & set(MODULES):
            importers[name].add(room_of(module))
    root = [module for module in MODULES if module.count(".") == 1 and MODULES[module].name != "__init__.py"]
    entered = {"stribeck.pipeline", "stribeck.inspection", "stribeck.__main__"}
    lonely = [module for module in root if module not in entered and len(importers[module] - {""}) < 2]
    assert [module for module in lonely if importers[module] - {"pipeline", "preparation", "compose"}] == []


def test_estimation_never_imports_simulation() -> None:
    knows = {module for module, path in MODULES.items() if any("stribeck_simulation" in name for name in imports(path))}
    assert len(MODULES) > 100
    assert knows <= ENTRANCE


def test_simulation_does_not_know_the_estimator() -> None:
    """So that the truth of a log does not rest on what is tested with it."""
    reached = {name for path in modules("stribeck_simulation").values() for name in imports(path)}
    rooms = {room_of(name) for name in reached if name.startswith("stribeck.")}
    assert not rooms & {"identification", "equations", "methods", "pipeline", "friction_torque", "cli"}


def test_readers_do_not_know_the_rest() -> None:
    own = [path for module, path in MODULES.items() if module.startswith("stribeck.log.readers")]
    reached = {room_of(name) for path in own for name in imports(path)}
    assert reached <= GROUND | {"log", "robot"}


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
