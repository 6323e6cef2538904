"""Motion of the log, and how noisy its torques were, from friction_torque.parquet next to the result."""

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from stribeck.equations.constants import WINDOW_LENGTH
from stribeck.errors import SettingsError
from stribeck.planning.joint import PlannedJoint, PresentMotion


def read_present(path: Path, joints: Iterable[str], rate: float) -> dict[str, PresentMotion]:
    """Read the motion of joints from the table of friction torques that `identify` wrote.

    Raises
    ------
    SettingsError
        If there is no such table, or it belongs to another result.
    """
    needed = "expected the friction_torque.parquet that 'stribeck identify' wrote beside this result.json"
    if not path.is_file():
        raise SettingsError(f"{path}: no such file; {needed}")
    try:
        table = pq.ParquetFile(path)
        missing = [name for name in joints if f"velocity.{name}" not in table.schema_arrow.names]
        if missing:
            raise SettingsError(f"{path}: has no joint '{missing[0]}'; {needed}")
        return {name: _read(table, name, rate) for name in joints}
    except (pa.ArrowException, OSError) as error:
        raise SettingsError(f"{path}: cannot be read as Parquet ({error}); {needed}") from error


def _read(table: pq.ParquetFile, name: str, rate: float) -> PresentMotion:
    keys = [f"{kind}.{name}" for kind in ("velocity", "friction_torque", "usable")]
    stride = max(1, int(WINDOW_LENGTH / 8 * rate))  # a window averages it
    velocity, torque, usable = (np.asarray(each.to_numpy())[::stride] for each in table.read(columns=keys).columns)
    return PresentMotion(
        velocity=np.nan_to_num(velocity.astype(float)),
        friction_torque=np.nan_to_num(torque.astype(float)),
        usable=usable.astype(bool) & np.isfinite(velocity) & np.isfinite(torque),
        period=stride / rate,
    )


def noise_of(joints: Mapping[str, PlannedJoint], motions: Mapping[str, PresentMotion]) -> dict[str, float]:
    """Estimate the spectral density of each joint's torque [N^2 m^2 s].

    It follows from the intervals of the result. A joint without an interval gets the rough estimate of its torque,
    times the median ratio of both estimates over the other joints.
    """
    shown = {name for name, joint in joints.items() if not joint.guessed and joint.found.verdict != "no friction"}
    rough = {name: rough_noise(motion, joints[name] if name in shown else None) for name, motion in motions.items()}
    found = {name: read_noise(motions[name], joints[name]) for name in motions if name in shown}
    ratios = [found[name] / rough[name] for name in found if rough[name] > 0]
    factor = float(np.median(ratios)) if ratios else 1.0
    noise = {name: found.get(name, factor * rough[name]) for name in motions}
    known = [value for value in noise.values() if value > 0]  # NaN for joints without a usable sample
    if not known:
        raise SettingsError("plan: no joint of the result has a torque whose noise is known; expected a longer log")
    return {name: value if value > 0 else float(np.median(known)) for name, value in noise.items()}


def read_noise(motion: PresentMotion, joint: PlannedJoint) -> float:
    """Compute the spectral density of a joint's torque [N^2 m^2 s] that explains the errors of its friction curve.

    Geometric mean over the points of the curve of the variance found, divided by that of noise of density 1.
    """
    information = joint.information(motion)
    slopes = joint.curve(joint.found.curve[-1].velocity)[2]
    errors = np.array([point.standard_error for point in joint.found.curve])
    found = np.maximum(errors, 1e-9) ** 2 * joint.shrinking_share  # smaller errors [N m] are rounding
    noise = float(np.mean(found))
    for _ in range(20):  # a fixed point, because the prior's part does not grow with the noise
        covariance = np.linalg.inv(information / noise + np.diag(joint.precision))
        noise *= float(np.exp(np.mean(np.log(found / np.einsum("sk,kl,sl->s", slopes, covariance, slopes)))))
    return noise


def rough_noise(motion: PresentMotion, joint: PlannedJoint | None) -> float:
    """Estimate the spectral density of a joint's torque [N^2 m^2 s] from the torque that its friction leaves.

    Means over consecutive windows are compared, which cancels slow changes (von Neumann 1941).
    """
    error = motion.friction_torque - (joint.found.friction(motion.velocity) if joint else 0.0)
    length = max(1, round(WINDOW_LENGTH / motion.period))
    count = len(error) // length
    means = error[: count * length].reshape(count, length).mean(axis=1)
    whole = np.asarray(motion.usable[: count * length].reshape(count, length).all(axis=1))
    both = np.logical_and(whole[1:], whole[:-1])
    if not both.any():
        return float("nan")
    return float(np.mean(np.diff(means)[both] ** 2) / 2 * length * motion.period)
