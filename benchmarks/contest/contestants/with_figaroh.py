"""FIGAROH: base parameters, friction, rotors and offsets at once, by least squares on the regressor of a fixed robot.

    python benchmarks/contest/contestants/with_figaroh.py CASE OUT

Needs figaroh and the root of the repository in PYTHONPATH. Used as its authors' example of the Staubli TX40 does:
`BaseIdentification` with its own filter, decimation and QR decomposition, `solve(decimate=True)`, intervals from its
standard deviations.
"""

import json
import sys
import tomllib
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from figaroh.identification.base_identification import BaseIdentification
from figaroh.tools.load_robot import load_robot
from figaroh.tools.regressor import build_regressor_basic, build_regressor_reduced

from benchmarks.contest.contestants.command import torque_of

CUTOFF = 20.0
"""Of its lowpass [Hz]; that of the TX40 is the example's."""
EXAMPLE = {"tx40": 100.0}
MEDIAN = 1
"""Of its median filter [samples]; its usual one of five flattens every turning point of a log of 500 Hz."""
ENDS = 0.25
"""Left out at both ends of a log, where filters swing in [s]."""
DECIMATED = 50.0
"""Rate that is left at least [Hz]; its usual factor of 10 suits the 5 kHz of its example."""
FACTOR = 10
NAMES = {"coulomb": "fs", "viscous": "fv", "offset": "off"}


class Identification(BaseIdentification):
    """FIGAROH's base class, given one log after another that are fitted together."""

    def __init__(self, robot: Any, config_file: str, joints: list[str], logs: list[Any]) -> None:
        """Say which joints the logs have, as the example does."""
        super().__init__(robot, config_file)
        self.logs = logs
        numbers = [robot.model.getJointId(joint) for joint in joints]
        moved = [robot.model.joints[number] for number in numbers]
        self.identif_config |= {
            "active_joints": joints,
            "act_Jid": numbers,
            "act_J": moved,
            "act_idxq": [joint.idx_q for joint in moved],
            "act_idxv": [joint.idx_v for joint in moved],
            "idx_act_joints": [number - 1 for number in numbers],
        }

    def load_trajectory_data(self, data_source: str | None = None) -> dict[str, Any]:
        """Return the first log; FIGAROH differentiates."""
        del data_source
        return dict(self.logs[0])

    def process_kinematics_data(self, filter_config: Any = None) -> None:
        """Filter and differentiate log by log, and leave out their ends, as the example does."""
        parts = []
        for log in self.logs:
            self.raw_data = log
            self.filter_kinematics_data(filter_config)
            cut = round(ENDS / self.identif_config["ts"])
            kept = {**self.processed_data, "torques": log["torques"]}
            parts.append({name: values[cut:-cut] for name, values in kept.items()})
        self.processed_data = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}

    def process_torque_data(self, **_: Any) -> Any:
        """Return the torques of the samples that were kept."""
        return self.processed_data["torques"]


def configuration(joints: list[str], rate: float, cutoff: float, median: int, rotors: bool) -> dict[str, Any]:
    """Return FIGAROH's configuration, in its unified format."""
    zeros = [0.0] * len(joints)
    return {
        "robot": {
            "name": "robot",
            "properties": {
                "joints": {"active_joints": joints},
                "mechanics": {
                    "friction_coefficients": {"viscous": zeros, "static": zeros},
                    "actuator_inertias": zeros,
                    "joint_offsets": zeros,
                },
                "coupling": {"has_coupled_wrist": False},
            },
        },
        "tasks": {
            "identification": {
                "enabled": True,
                "problem": {
                    "include_external_forces": False,
                    "use_joint_torques": True,
                    "model_components": {"friction": True, "joint_offset": True, "actuator_inertia": rotors},
                },
                "signal_processing": {
                    "sampling_frequency": rate,
                    "cutoff_frequency": cutoff,
                    "filter_order": 4,
                    "filter_params": {"med_fil": median},
                },
            }
        },
    }


def answer(folder: Path, out: Path) -> dict[str, Any]:
    said: dict[str, Any] = {"method": "FIGAROH", "version": version("figaroh"), "needs": ["fixed base"]}
    case = json.loads((folder / "case.json").read_text(encoding="utf-8"))
    table = tomllib.loads((folder / "robot.toml").read_text(encoding="utf-8"))["robot"]
    if case["base"] == "floating":
        return said | {"blank": "its regressor of joint torques knows no ground reactions: a robot has to be fixed"}
    if not table["model"].endswith(".urdf"):
        return said | {"blank": "it reads URDF alone, and the published model is MJCF"}
    robot = load_robot(str(folder / table["model"]), package_dirs=str(folder))
    joints = [str(name) for name in np.load(folder / case["logs"][0])["joint_names"]]
    rotors = table.get("torque_source", "link_side_sensor") != "link_side_sensor"
    example = case["robot"] in EXAMPLE
    cutoff, median = (EXAMPLE[case["robot"]], 5) if example else (CUTOFF, MEDIAN)
    settings = configuration(joints, case["rate"], cutoff, median, rotors)
    (out / "figaroh.yaml").write_text(yaml.safe_dump(settings), encoding="utf-8")
    order = sorted(range(len(joints)), key=lambda k: int(robot.model.getJointId(joints[k])))
    logs = [np.load(folder / log) for log in case["logs"]]
    own = [
        {
            "timestamps": log["time"],
            "positions": log["position"][:, order],
            "velocities": None,
            "accelerations": None,
            "torques": torque_of(log, table, joints)[:, order],
        }
        for log in logs
    ]
    found = Identification(robot, str(out / "figaroh.yaml"), [joints[k] for k in order], own)
    found.initialize()
    factor = min(FACTOR, max(1, int(case["rate"] / DECIMATED)))
    found.solve(decimate=factor > 1, decimation_factor=factor, plotting=False, save_results=False)
    values = dict(zip(found.params_base, found.phi_base, strict=True))
    errors = dict(zip(found.params_base, np.abs(found.std_relative * found.phi_base) / 100, strict=True))
    print(*(f"{name} {value:.4g}" for name, value in values.items()), sep="\n")
    if case.get("predict"):
        predict(found, np.load(folder / case["predict"]), order, out)
    said["joints"] = {joint: of_joint(joint, values, errors) for joint in case["joints"]}
    return said


def of_joint(joint: str, values: dict[str, float], errors: dict[str, float]) -> dict[str, Any]:
    """Return a joint's parameters; those that FIGAROH finds in a sum with others alone are left out."""
    found = {}
    for name, short in NAMES.items():
        label = f"{short}_{joint}"
        if label in values:
            found[name] = {"value": float(values[label]), "standard_error": float(errors[label])}
    return found


def predict(found: Any, log: Any, order: list[int], out: Path) -> None:
    """Write the torques that the identified base parameters give a motion."""
    motion = [log[name][:, order] for name in ("position", "velocity", "acceleration")]
    regressor = build_regressor_basic(found.robot, *motion, found.identif_config)
    reduced = build_regressor_reduced(regressor, found._idx_eliminated)
    torque = (reduced[:, found._base_indices] @ found.phi_base).reshape(len(order), -1).T
    unsorted = np.empty_like(torque)
    unsorted[:, order] = torque
    np.savez(out / "torque.npz", torque=unsorted)


def main() -> None:
    folder, out = Path(sys.argv[1]), Path(sys.argv[2])
    (out / "answer.json").write_text(json.dumps(answer(folder, out)), encoding="utf-8")


if __name__ == "__main__":
    main()
