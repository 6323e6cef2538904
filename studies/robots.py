"""Friction of real robots from published logs: write a result per robot into docs/robots, and a page with tables.

    STRIBECK_REAL_LOGS=DATA_FOLDER python -m studies.robots --save studies/robots.json

Each result is that of `stribeck identify` with all logs and the robot file of examples/real_robots. The committed file
omits the estimates of bodies, the decisions on terms and the sources of errors, and has numbers of six digits.
"""

import json
from dataclasses import replace
from pathlib import Path

from stribeck import identify, read_result
from stribeck.core.result import JointResult, Result
from stribeck.core.result.tables import friction_text, main_parameters
from studies.command import ROOT, Row, command, of_estimates, read, real_robot
from studies.markdown import markdown_table

PAGE, RESULTS = ROOT / "examples" / "real_robots" / "friction.md", ROOT / "docs" / "robots"
BSD, COMMANDS, CURRENTS = "BSD-3-Clause", "commands", "motor currents"
SOURCES = {
    "go2": ("iit-DLSLab/sim2real-robot-identification", "06739ea", BSD, COMMANDS),
    "go2-ten-logs": ("RX-00/sim2real-robot-identification", "1a22bd0", BSD, COMMANDS),
    "aliengo": ("iit-DLSLab/simple-robot-identification-isaaclab", "5b3aa99", BSD, COMMANDS),
    "z1": ("iit-DLSLab/simple-robot-identification-isaaclab", "5b3aa99", BSD, COMMANDS),
    "tx40": ("thanhndv212/figaroh-examples", "c0b5c7f", "Apache-2.0", CURRENTS),
    "kinova-gen3": ("roahmlab/RAPTOR", "6da2d77", "GPL-3.0", "sensors behind the gears"),
    "kinova-gen3-drive": ("roahmlab/RAPTOR", "04daa66", "GPL-3.0", CURRENTS),
    "kuka-lwr4": ("kjyv/FloBaRoID", "an earlier commit", "LGPL-3.0", "sensors behind the gears"),
    "airbot-play": ("liuyurong129/figaroh_kinova", "9ac8ad7", "no license stated", CURRENTS),
    "double-pendulum": ("dfki-ric-underactuated-lab/double_pendulum", "1e8544e", BSD, CURRENTS),
    "dfki-pendulum": ("dfki-ric-underactuated-lab/torque_limited_simple_pendulum", "ed17ea2", BSD, CURRENTS),
}
"""Repository, commit and license of the logs, and source of the torques, by robot."""
HEAD = "|joint|Coulomb [N m]|viscous [N m s/rad]|rotor [kg m²]|middle [N m, at rad/s]|verdict|"
TITLE = f"{HEAD}\n|---|---:|---:|---:|---:|---|"


def shortened(result: Result) -> str:
    """Format a result as JSON, one line per joint, without details that most users do not need."""
    text = replace(result, corrections=None, robot_file=None).to_json()
    for path in result.log.paths:
        text = text.replace(path, Path(path).name)
    plain = json.loads(text, parse_float=lambda number: float(f"{float(number):.6g}"))
    kinds = [plain.pop(kind) for kind in ("joints", "couplings") if kind in plain]
    parts = [f'"{key}": {json.dumps(value)}' for key, value in plain.items()]
    for kind, joints in zip(("joints", "couplings"), kinds, strict=False):
        for joint in joints.values():
            joint["terms"] = None
            for parameter in joint["parameters"].values():
                parameter.pop("variance_shares", None)
        rows = ",\n".join(f' "{name}": {json.dumps(joint)}' for name, joint in joints.items())
        parts.append(f'"{kind}": {{\n{rows}\n}}')
    return "{\n" + ",\n".join(parts) + "\n}\n"


def page() -> str:
    """Format the page from the committed results."""
    date = read(ROOT / "studies" / "robots.json")["date"]
    sections = [f"Printed by `python -m studies.robots`, {date}: [Friction of real robots](../../docs/library.md).\n"]
    for robot, (repository, commit, terms, torque) in SOURCES.items():
        result = read_result(RESULTS / f"{robot}.json")
        origin = f"[{repository.partition('/')[2]}](https://github.com/{repository})"
        logs = f"{len(result.log.paths)} logs, together " * (len(result.log.paths) > 1)
        logs = f"{logs}{result.log.duration:.0f} s at {result.log.rate:.0f} Hz"
        rows = [f"|{name}|{'|'.join(_cells(joint))}|" for name, joint in result.all_friction.items()]
        lead = f"[Result](../../docs/robots/{robot}.json) of {logs} ({torque}) from {origin}, {commit} ({terms})."
        sections.append("\n".join([f"\n## {result.robot}\n\n{lead}\n\n{TITLE}", *rows, ""]))
    return "".join(sections)


def _cells(joint: JointResult) -> list[str]:
    values = (text for text, _ in main_parameters(joint))
    middle = friction_text(joint).replace(" N m", "").replace(" rad/s", "")
    return [*values, middle, joint.verdict]


def run(robot: str) -> Row:
    """Identify a robot, and write its result."""
    folder = real_robot(robot)
    result = identify(sorted(folder.glob("log*.npz")), folder / "robot.toml")
    (RESULTS / f"{robot}.json").write_text(shortened(result), encoding="utf-8")
    verdicts = [joint.verdict for joint in result.all_friction.values()]
    return {"joints": len(verdicts), "identified": verdicts.count("identified")}


def tables(rows: list[Row]) -> list[str]:
    """Format the number of identified joints."""
    return [markdown_table(HEADS, [[row[key] for key in HEADS] for row in rows])]


HEADS = ("robot", "joints", "identified")

if __name__ == "__main__":
    command(__doc__, [{"robot": robot} for robot in SOURCES], run, tables, of_estimates)
