"""Who may import whom: data flows one way, and estimation cannot know whether a robot is simulated."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[1] / "src/stribeck"
GROUND = {"errors", "log", "settings", "samples", "equations", "pseudo_inertia", "version", "storage", "interpolation"}
GROUND |= {"outputs", "threads", "walk"}
ALLOWED = {
    "friction": GROUND | {"friction"},
    "export": GROUND | {"export", "model_file", "result", "robot"},
    "methods": GROUND
    | {"corrected", "friction", "identification", "methods", "preparation", "result", "robot", "survey", "weak_form"},
    "motion": GROUND | {"motion"},
    "preparation": GROUND | {"contact", "motion", "readers", "robot", "sampling"},
    "identification": GROUND | {"friction", "identification", "result"},
    "compare": GROUND | {"mirror", "result"},
    "report": GROUND | {"compare", "friction", "mirror", "report", "result"},
    "result": GROUND | {"friction", "result_tables"},
    "result_tables": GROUND,
    "robot": GROUND | {"kinematics", "model_file", "rooting"},
}
ENTRANCE = {"cli", "__main__"}


def imports(path: Path) -> set[str]:
    """Return the stribeck modules that a file imports at run time, by their first name."""
    tree = ast.parse(path.read_text())
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            node.body = []
    found = set()
    for node in ast.walk(tree):
        names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        if isinstance(node, ast.ImportFrom) and node.module == "stribeck":
            names += [f"stribeck.{alias.name}" for alias in node.names]
        found |= {name.split(".")[1] for name in names if name.startswith("stribeck.")}
    return found


def files_of(room: str) -> list[Path]:
    folder = SOURCE / room
    return sorted(folder.rglob("*.py")) if folder.is_dir() else [SOURCE / f"{room}.py"]


@pytest.mark.parametrize("room", ALLOWED)
def test_a_room_imports_only_what_it_stands_on(room: str) -> None:
    reached = {name for path in files_of(room) for name in imports(path)}
    assert reached <= ALLOWED[room]


def test_estimation_never_imports_simulation() -> None:
    outside = [path for path in SOURCE.rglob("*.py") if "simulation" not in path.parts and path.stem not in ENTRANCE]
    assert len(outside) > 30
    assert [path.name for path in outside if "simulation" in imports(path)] == []


def test_readers_do_not_know_the_rest() -> None:
    reached = {name for path in files_of("readers") for name in imports(path)}
    assert not reached & {
        "pipeline",
        "preparation",
        "survey",
        "dynamics",
        "friction_torque",
        "identification",
        "report",
        "cli",
    }


def test_only_the_registry_knows_the_methods() -> None:
    one_method = re.compile(r"stribeck\.methods\.(?!contract\b)\w+")
    outside = [path for path in SOURCE.rglob("*.py") if path.parent.name != "methods"]
    assert [path.name for path in outside if one_method.search(path.read_text())] == []


@pytest.mark.parametrize("program", ["import stribeck", "import stribeck.__main__ as program; program.main()"])
def test_what_is_slow_to_import_waits_until_it_is_needed(program: str) -> None:
    slow = {"numpy", "pydantic", "pinocchio", "scipy", "h5py", "pyarrow", "matplotlib", "mujoco", "daqp"}
    listing = "import atexit, sys; atexit.register(lambda: print(*sys.modules))"
    command = [sys.executable, "-c", f"{listing}; {program}", "--help"]
    loaded = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    assert "stribeck" in loaded
    assert not slow & set(loaded)
