"""What the log has shown: its motion, and how noisy its torques are, from friction_torque.parquet beside the result."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from stribeck.equations.constants import WINDOW_LENGTH
from stribeck.errors import SettingsError
from stribeck.identification.judgement.speed import top_speed
from stribeck.planning.assumed import AssumedFriction
from stribeck.planning.information import averaged
from stribeck.typing import Array

FINE = WINDOW_LENGTH / 8
"""Longest time between samples that friction is worked out at [s]: a window averages it."""

SHRINKING = ("noise", "overdispersion", "heterogeneity over folds", "group mean")
"""Parts of a variance that fall as a log gets longer: the torques' noise, what differs from part to part, and what is
not known yet of all joints together."""

LEAST_ERROR = 1e-9
"""Standard error of a friction curve [N m]: smaller ones are rounding."""

ROUNDS = 20
"""Of a fixed-point iteration [1]."""


@dataclass(frozen=True, eq=False)
class PresentMotion:
    """How one joint moved in the samples that a fit may use.

    Attributes
    ----------
    velocity
        [rad/s], shape (N,), of all samples in the order of time.
    friction_torque
        [N m], shape (N,).
    usable
        Shape (N,).
    period
        Time that a sample stands for [s].
    """

    velocity: Array
    friction_torque: Array
    usable: NDArray[np.bool_]
    period: float

    @property
    def duration(self) -> float:
        """Of what a fit may use [s]."""
        return float(np.count_nonzero(self.usable)) * self.period

    @property
    def top_speed(self) -> float:
        """As the verdicts have it [rad/s]."""
        return top_speed(self.velocity[self.usable])


def read_present(path: Path, joints: Iterable[str], rate: float) -> dict[str, PresentMotion]:
    """Return the motion of joints from the table of friction torques that `identify` wrote.

    Raises
    ------
    SettingsError
        If there is no such table, or it is that of another result.
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
    keys = (f"velocity.{name}", f"friction_torque.{name}", f"usable.{name}")
    stride = max(1, int(FINE * rate))
    velocity, torque, usable = (
        np.asarray(column.to_numpy())[::stride] for column in table.read(columns=list(keys)).columns
    )
    usable = usable.astype(bool) & np.isfinite(velocity) & np.isfinite(torque)
    return PresentMotion(
        velocity=np.nan_to_num(velocity.astype(float)),
        friction_torque=np.nan_to_num(torque.astype(float)),
        usable=usable,
        period=stride / rate,
    )


def unit_information(motion: PresentMotion, assumed: AssumedFriction, speed: float = 1.0) -> Array:
    """Return what the motion, faster by a factor, says of friction coordinates for noise of density 1, shape (k, k)."""
    velocity = speed * motion.velocity
    zero = np.zeros(len(velocity))
    columns = averaged(assumed.columns(velocity, zero, None, None), motion.period)
    counted = motion.usable & assumed.moves(velocity)
    return np.asarray(columns[counted].T @ columns[counted] * motion.period)


def read_noise(motion: PresentMotion, assumed: AssumedFriction) -> float:
    """Return the spectral density of a joint's torque [N^2 m^2 s] that explains the errors of its friction curve.

    The geometric mean over the curve's points of the variance found, over that of noise of density 1.
    """
    joint = assumed.joint
    information = unit_information(motion, assumed)
    _, _, slopes = assumed.curve(joint.curve[-1].velocity)
    errors = np.array([point.standard_error for point in joint.curve])
    found = np.maximum(errors, LEAST_ERROR) ** 2 * shrinking_share(assumed)
    noise = float(np.mean(found))
    for _ in range(ROUNDS):  # as the prior's part does not grow with the noise
        covariance = np.linalg.inv(information / noise + np.diag(assumed.precision))
        noise *= float(np.exp(np.mean(np.log(found / np.einsum("sk,kl,sl->s", slopes, covariance, slopes)))))
    return noise


def shrinking_share(assumed: AssumedFriction) -> float:
    """Return which share of the curve's variance falls with the length of a log [1]: mean over the parameters.

    Each counts as it does in the curve's variance.
    """
    joint = assumed.joint
    _, _, slopes = assumed.curve(joint.curve[-1].velocity)
    found = [joint.parameters[name] for name in assumed.names]
    weight = np.mean(slopes**2, axis=0) * np.array([own.standard_error for own in found]) ** 2 / assumed.units**2
    shares = [
        1.0 if own.variance_shares is None else sum(own.variance_shares.get(k, 0.0) for k in SHRINKING) for own in found
    ]
    return float(np.average(shares, weights=weight)) if weight.sum() > 0 else 1.0


def fixed_part(assumed: AssumedFriction) -> str:
    """Return the name of the largest part of the parameters' variances that no length takes away."""
    shares = [own.variance_shares for own in assumed.joint.parameters.values() if own.variance_shares]
    names = {name for own in shares for name in own if name not in SHRINKING}
    return max(sorted(names), key=lambda name: sum(own.get(name, 0.0) for own in shares), default="")


def rough_noise(motion: PresentMotion, assumed: AssumedFriction | None) -> float:
    """Return the spectral density of a joint's torque [N^2 m^2 s] from what its friction does not explain.

    Means over one window after another are compared, so that what changes slowly is left out (von Neumann 1941).
    """
    error = motion.friction_torque.copy()
    if assumed is not None:
        error -= assumed.joint.friction(motion.velocity)
    length = max(1, round(WINDOW_LENGTH / motion.period))
    count = len(error) // length
    means = error[: count * length].reshape(count, length).mean(axis=1)
    whole = np.asarray(motion.usable[: count * length].reshape(count, length).all(axis=1))
    both = np.logical_and(whole[1:], whole[:-1])
    if not both.any():
        return float("nan")
    return float(np.mean(np.diff(means)[both] ** 2) / 2 * length * motion.period)
