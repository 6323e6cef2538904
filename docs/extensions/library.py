"""Write the table of docs/library.md from the results in docs/robots: `python docs/extensions/library.py`."""

import json
import sys
from pathlib import Path
from statistics import median
from typing import Any

DOCS = Path(__file__).parents[1]
sys.path.append(str(DOCS.parent))

from studies.robots import SOURCES  # noqa: E402, because it is next to docs

HEAD = """# Friction of real robots

Use these values of published logs as starting values, or compare your robot with them. Friction differs between robots
of one type, and with temperature and load.

- Joints are listed from the base to the tool. Legs have the median of the four legs.
- `?`: weak or not identified ([verdicts](verdicts.md)). `–`: no friction, or no value.
- **Torques** show [where friction was measured](torque.md): sensors behind the gears measure
  only bearings and seals.
- **Rotor** inertias are reflected to the joint.

"""
TAIL = """
Each name links to the result, which [export](export.md) and [compare](compare.md) read
(`python -m studies.robots`, 2026-11-30). All joints, intervals and sources:

[Tables of eleven data sets](../examples/real_robots/friction.md)
"""
COLUMNS = {"coulomb": "Coulomb [N m]", "viscous": "viscous [N m s/rad]", "armature": "rotor [kg m²]"}


def page() -> str:
    """Format the whole page."""
    rows = [("robot", "torques", *COLUMNS.values(), "identified"), ("---", "---", *["---"] * len(COLUMNS), "---:")]
    rows += [_row(name, torques) for name, (*_, torques) in SOURCES.items()]
    return HEAD + "\n".join(f"| {' | '.join(row)} |" for row in rows) + "\n" + TAIL


def _row(name: str, torques: str) -> tuple[str, ...]:
    result = json.loads((DOCS / "robots" / f"{name}.json").read_text(encoding="utf-8"))
    joints = result["joints"]
    kinds: dict[str, list[Any]] = {}
    for joint in joints:
        legged = joint.count("_") == 2  # FL_hip_joint
        kinds.setdefault(joint.split("_")[1] if legged else joint, []).append(joints[joint])
    legs = len(kinds) < len(joints)
    cells = (_listed(kinds, parameter, named=legs) for parameter in COLUMNS)
    known = sum(joint["verdict"] == "identified" for joint in joints.values())
    return f"[{result['robot']}](robots/{name}.json)", torques, *cells, f"{known} of {len(joints)}"


def _listed(kinds: dict[str, list[Any]], parameter: str, *, named: bool) -> str:
    """List a parameter of each kind of joint."""
    texts = []
    for kind, joints in kinds.items():
        found = [joint["parameters"][parameter] for joint in joints if parameter in joint["parameters"]]
        text = f"{median(each['value'] for each in found):.2g}" if found else "–"
        weak = 2 * sum(each["verdict"] != "identified" for each in found) >= len(found) > 0
        texts.append(f"{kind} " * named + text + "?" * weak)
    return ", ".join(texts)


if __name__ == "__main__":
    (DOCS / "library.md").write_text(page(), encoding="utf-8")
