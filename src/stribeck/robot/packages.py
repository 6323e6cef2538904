"""Models that other packages bring: `package:NAME` in place of a model file's path."""

import difflib
import sys
from contextlib import redirect_stdout
from importlib import import_module, metadata
from pathlib import Path

from stribeck.errors import RobotFileError

PREFIX = "package:"
EXAMPLES = "example-robot-data"
"""Distribution of models alone: its files are found by what it says of itself when it is installed."""
INSTALL = "pip install 'stribeck[descriptions]' or pip install example-robot-data"


def model_path(name: str, folder: Path) -> Path:
    """Return the model file that a robot file names: one relative to `folder`, or the one of a package.

    Parameters
    ----------
    name
        A path, or `package:NAME`. NAME is a module of robot_descriptions (`go2_description`), which downloads the model
        when it is first used, or a model file of example-robot-data without its suffix (`talos_reduced`), with its
        folder where two have the name (`anymal_c_simple_description/anymal`).

    Raises
    ------
    RobotFileError
        If no package that is installed has it, or it cannot be downloaded.
    """
    if not name.startswith(PREFIX):
        return folder / name
    wanted = name.removeprefix(PREFIX)
    described, examples = _descriptions(), _examples()
    if wanted in described:
        return _described(wanted, described)
    if len(found := examples.get(wanted, [])) == 1:
        return found[0]
    if found:
        longer = sorted(key for key, paths in examples.items() if "/" in key and paths[0] in found)
        raise RobotFileError(f"{name}: {EXAMPLES} has {len(found)} of this name; expected {_listed(longer)}")
    missing = [] if described else ["robot_descriptions"]
    missing += [] if examples else [EXAMPLES]
    if len(missing) == 2:
        raise RobotFileError(f"{name}: models of packages need robot_descriptions or {EXAMPLES}: {INSTALL}")
    names = [*described, *examples]
    near = difflib.get_close_matches(wanted, names, n=4, cutoff=0.4) or [key for key in names if wanted in key][:4]
    hint = f"the nearest are {_listed([PREFIX + key for key in near])}" if near else f"'{PREFIX}talos_reduced' is one"
    rest = f", and {missing[0]} is not installed, which may have it: {INSTALL}" if missing else ""
    raise RobotFileError(f"{name}: no installed package has a model of this name; {hint}{rest}")


def _descriptions() -> list[str]:
    """Return the modules of robot_descriptions, none of them imported: that would download it."""
    try:
        return sorted(import_module("robot_descriptions").DESCRIPTIONS)
    except ImportError:
        return []


def _described(name: str, names: list[str]) -> Path:
    """Return the model file of a module of robot_descriptions, which downloads it unless it has done so before."""
    try:
        with redirect_stdout(sys.stderr):  # it says there what it downloads
            module = import_module(f"robot_descriptions.{name}")
    except Exception as error:  # of git, of the network, of the disk: whatever stops it
        print(file=sys.stderr)  # its progress bar ends without
        lines = str(getattr(error, "stderr", "") or error).removeprefix("\n  stderr:").strip(" '\n").splitlines()
        raise RobotFileError(
            f"{PREFIX}{name}: robot_descriptions cannot download it ({(lines or [type(error).__name__])[-1][:160]}); "
            "expected git and a connection, or a model file"
        ) from error
    path = getattr(module, "URDF_PATH", None) or getattr(module, "MJCF_PATH", None)
    if path is None:
        other = name.replace("_description", "_mj_description")
        raise RobotFileError(
            f"{PREFIX}{name}: robot_descriptions has it as xacro alone; expected "
            + (f"'{PREFIX}{other}', or " if other in names else "")
            + "a URDF that xacro makes of it"
        )
    return Path(path)


def _examples() -> dict[str, list[Path]]:
    """Return the model files of example-robot-data by name, and by folder and name; none if it is not installed."""
    try:
        files = metadata.files(EXAMPLES) or []
    except metadata.PackageNotFoundError:
        return {}
    found: dict[str, list[Path]] = {}
    for file in sorted(files, key=str):
        parts = file.parts
        if file.suffix == ".urdf" and "robots" in parts:
            path = Path(str(file.locate()))
            for name in (file.stem, f"{parts[parts.index('robots') + 1]}/{file.stem}"):
                found.setdefault(name, []).append(path)
    return found


def _listed(names: list[str]) -> str:
    return ", ".join(f"'{name}'" for name in names)
