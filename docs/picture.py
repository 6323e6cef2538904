"""Draw the README's picture: friction found in the demonstration's log, beside the truth.

python docs/picture.py
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from stribeck import Robot, identify
from stribeck.friction import get_law
from stribeck.simulation.demo import make_demo

JOINTS = ("left_hip_pitch", "left_knee", "left_ankle_pitch", "waist")
TARGET = Path(__file__).parent / "assets" / "demo.png"


def main() -> None:
    """Run the demonstration and write the picture."""
    with tempfile.TemporaryDirectory() as folder:
        example = make_demo(Path(folder))
        result = identify(example.log, Robot.from_file(example.robot_file))
    law = get_law(result.law)
    assert result.evidence is not None
    samples = result.evidence.samples
    figure = Figure(figsize=(11, 3.1), layout="constrained")
    for axes, joint in zip(figure.subplots(1, len(JOINTS)), JOINTS, strict=True):
        column = samples.joint_names.index(joint)
        rows = np.flatnonzero(samples.usable[:, column])[::4]
        velocity = np.linspace(*result.joints[joint].velocity_range, 600)
        found = np.array([parameter.value for parameter in result.joints[joint].parameters.values()])
        truth = np.array([example.parameters[joint][parameter.name] for parameter in law.parameters])
        axes.plot(
            samples.velocity[rows, column],
            samples.friction_torque[rows, column],
            ".",
            ms=1.2,
            color="#9dbfe8",
            zorder=1,
        )
        axes.plot(velocity, law.torque(velocity, truth), color="black", lw=3.0, label="truth")
        axes.plot(velocity, law.torque(velocity, found), color="#f08030", lw=1.4, label="found")
        axes.set_title(joint.replace("_", " "), fontsize=10)
        axes.set_xlabel("velocity [rad/s]", fontsize=9)
        axes.tick_params(labelsize=8)
        axes.grid(alpha=0.25)
    first = figure.axes[0]
    first.set_ylabel("friction torque [N m]", fontsize=9)
    first.legend(fontsize=8, loc="upper left")
    TARGET.parent.mkdir(exist_ok=True)
    figure.savefig(TARGET, dpi=110, metadata={"Software": None})


if __name__ == "__main__":
    main()
