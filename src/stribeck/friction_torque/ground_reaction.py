"""The ground reaction that the model predicts against the foot sensors'."""

import numpy as np

from stribeck.finding import Finding
from stribeck.friction_torque.stream import Chunk
from stribeck.log import RobotLog
from stribeck.robot import Robot


class GroundReaction:
    """Compares the two sample by sample.

    Friction does not enter them, so a difference speaks of the inertias, of the tilt, or of the sensor.
    """

    def __init__(self) -> None:
        self.samples = 0
        self._squares = np.zeros(6)
        self._sum = np.zeros(6)

    def compare(self, log: RobotLog, chunk: Chunk) -> None:
        """Take the samples of a chunk on one standing foot whose wrench the log has."""
        if log.foot_wrench is None:
            return
        for k, name in enumerate(chunk.samples.support_names):
            rows = np.flatnonzero(chunk.samples.support == k)
            if len(rows) and name in log.foot_names:
                difference = log.foot_wrench[chunk.rows[rows], log.foot_names.index(name)] - chunk.wrench[rows]
                difference = difference[np.all(np.isfinite(difference), axis=1)]
                self.samples += len(difference)
                self._sum += difference.sum(axis=0)
                self._squares += (difference**2).sum(axis=0)

    def said(self, robot: Robot) -> tuple[list[str], list[Finding]]:
        """Return a note, and a finding where model and foot sensor are far apart."""
        if not self.samples:
            return [], []
        weight = robot.mass * float(np.linalg.norm(robot.gravity))
        rms, mean = np.sqrt(self._squares / self.samples), float(self._sum[2] / self.samples)
        vertical = float(rms[2])
        text = (
            f"ground reaction, foot sensor against model, RMS over {self.samples} samples: vertical {vertical:.1f} N "
            f"({100 * vertical / weight:.1f} % of the weight, mean {mean:+.1f} N), horizontal "
            f"{float(np.hypot(*rms[:2])):.1f} N, moments {float(np.linalg.norm(rms[3:])):.2f} N m"
        )
        far = vertical > 0.1 * weight
        return [text], [Finding.of("foot-sensors", evidence=text)] if far else []
