"""Alarms with a stated false-alarm rate, for joints, for all joints at once, and for a payload.

The friction of a joint is compared with a reference: its friction in the first minute of motion, limited to what logs
of one robot normally differ from the identified friction. A change that most joints share, such as that of a colder
robot, is fitted first: one factor for all friction and one for viscous friction. The rest is a joint's own change. With
V the variance of normal changes and of the reference, and P of the current estimate, an alarm needs a change above

    sqrt(a^2 V + b^2 P)

where a and b are the normal quantiles for one false alarm in the given time, if normal changes differ from hour to
hour, and estimates from one `APART` to the next.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.special import ndtr, ndtri  # avoids the slow import of scipy.stats

from stribeck.core.base.typing import Array, BoolArray
from stribeck.service.online.baseline import Baseline

APART = 10.0
"""Time between independent estimates [s]."""
SESSION = 3600.0
"""Time between independent normal changes [s]."""
RAISED, CLEARED = 1.0, 5.0
"""Time beyond the limit until an alarm is raised, and within half of the limit until it is cleared [s]."""
LEARNED, PRIOR = 60.0, 2.0
"""Duration of motion that the reference averages, and the weight of the identified friction in it [s]."""
SHARED_LEAST, PAYLOAD_LEAST = 0.1, 0.02
"""Smallest common change of friction [1] and payload relative to the robot's mass [1] that raise an alarm."""
FEWEST = 4
"""Smallest number of joints whose common change is separated from changes of single joints."""

Kind = Literal["joint", "all joints", "payload"]


@dataclass(frozen=True, kw_only=True)
class Alarm:
    """Raised or cleared alarm.

    Attributes
    ----------
    kind, name
        What has changed: a joint by its name, all joints, or a payload.
    raised
        Whether the alarm is raised, or cleared.
    time, since
        Time of the decision, and start of the change [s].
    change
        Change since the reference relative to the friction [1]; for a payload, its mass [kg].
    sureness
        Probability that the change is not normal [1].
    """

    kind: Kind
    name: str
    raised: bool
    time: float
    since: float
    change: float
    sureness: float

    @property
    def line(self) -> str:
        """One line, e.g. "left_knee: friction +31 % since 120.5 s (sure to 99.99 %)"."""
        what = f"payload {self.change:+.1f} kg" if self.kind == "payload" else f"friction {100 * self.change:+.0f} %"
        end = f"since {self.since:.1f} s (sure to {100 * self.sureness:.5g} %)" if self.raised else "is normal again"
        return f"{self.name}: {what} {end}"


class Watchdog:
    """Decides once per second on alarms of n joints, all joints and a payload: K = n + 2 channels in this order.

    Parameters
    ----------
    of
        Identified friction: names of the joints, spread from log to log, and share of viscous friction.
    mass
        Mass of the robot [kg].
    hours
        Mean time between false alarms [h].
    """

    def __init__(self, of: Baseline, mass: float, hours: float) -> None:
        joints = len(of.names)
        self._names, self._spread, self._mass = of.names, of.spread, mass
        self._shapes = np.stack([np.ones(joints), of.viscous_share], axis=1)
        checks = 2 * (joints + 2) * hours * 3600
        self._quantiles = -ndtri(0.5 / (checks / SESSION)), -ndtri(0.5 / (checks / APART))
        self.reference, self.learned = np.zeros((joints, 2)), np.zeros(joints)
        self.payload = np.zeros(2)  # relative mass, and the duration that it averages
        self.active = np.zeros(joints + 2, dtype=bool)
        self.large, self.small, self.normal_until = np.zeros((3, joints + 2))

    def check(
        self, time: float, changes: Array, covariance: Array, moved: BoolArray, payload: tuple[float, float]
    ) -> list[Alarm]:
        """Decide on the alarms after one more second.

        Parameters
        ----------
        time
            Time [s].
        changes, covariance
            Scale minus one and additional viscous friction relative to the friction at middle speed, shape (n, 2), and
            their covariance, shape (n, 2, 2).
        moved
            Joints that were observed in this second, shape (n,); the others keep their alarms.
        payload
            Mass relative to the robot's, and its standard error; infinite if unknown.
        """
        shift, variance = changes - self.reference, self._reference_variance()
        noise = covariance.sum(axis=(1, 2))
        shared, shared_error = self._fit_shared(shift, covariance, variance, moved)
        total = shift.sum(axis=1) - (self._shapes * shared).sum(axis=1)
        strongest = int(np.argmax(np.abs(shared) / shared_error))
        mass, mass_error = payload[0] - self.payload[0], payload[1]
        change = np.concatenate([total, [shared[strongest], mass]])
        normal = np.append(variance, np.square([SHARED_LEAST, PAYLOAD_LEAST]) / self._quantiles[0] ** 2)
        random = np.concatenate([noise, [shared_error[strongest] ** 2, mass_error**2]])
        known = self.learned >= 5.0  # [s] of motion, until a joint's noise is known
        seen = np.concatenate([moved & known, [moved.sum() >= FEWEST, np.isfinite(mass_error)]])
        alarms = self._decide(time, change, normal, random, seen)
        self._learn(changes, moved, payload)
        return alarms

    def _reference_variance(self) -> Array:
        """Compute the variance of normal changes since the reference, shape (n,)."""
        normal = 0.04  # standard deviation of normal changes of a joint's friction relative to the other joints [1]
        return np.asarray(normal**2 + self._spread**2 * PRIOR / (PRIOR + self.learned))

    def _learn(self, changes: Array, moved: BoolArray, payload: tuple[float, float]) -> None:
        """Average the first minute of motion of joints without an alarm."""
        share = np.where(moved & (self.learned < LEARNED), 1 / (PRIOR + self.learned + 1), 0.0)
        limit = 1.96 * self._spread[:, None]
        self.reference += share[:, None] * (np.clip(changes, -limit, limit) - self.reference)
        self.learned += share > 0
        if np.isfinite(payload[1]) and self.payload[1] < LEARNED and not self.active[-1]:
            mean, seconds = self.payload
            self.payload[:] = mean + (payload[0] - mean) / (PRIOR + seconds + 1), seconds + 1

    def _fit_shared(self, shift: Array, covariance: Array, normal: Array, moved: BoolArray) -> tuple[Array, Array]:
        """Fit factors of all friction and of viscous friction to the changes, shape (2,), with standard errors.

        Robust generalized least squares; zero for few joints.
        """
        if moved.sum() < FEWEST:
            return np.zeros(2), np.full(2, np.inf)
        inverse = np.linalg.inv(covariance[moved] + normal[moved, None, None] / 2 * np.eye(2))
        shapes, changes = self._shapes[moved], shift[moved]
        information = shapes[:, :, None] * inverse * shapes[:, None, :]
        right = shapes * (inverse @ changes[:, :, None])[:, :, 0]
        weight: Array = np.ones(len(changes))
        huber = 2.0  # deviation of a joint beyond which it loses weight [standard deviations]
        factors, matrix = np.zeros(2), np.eye(2)
        for _ in range(4):
            matrix = np.asarray(np.tensordot(weight, information, 1) + np.eye(2))  # a change by 100 % is unlikely
            factors = np.asarray(np.linalg.solve(matrix, weight @ right))
            residual = changes - shapes * factors
            square = (residual[:, None] @ inverse @ residual[:, :, None])[:, 0, 0]
            weight = np.minimum(1.0, huber / np.sqrt(np.maximum(square, 1e-18)))
        return factors, np.sqrt(np.diag(np.linalg.inv(matrix)))

    def _decide(self, time: float, change: Array, normal: Array, random: Array, seen: BoolArray) -> list[Alarm]:
        """Raise and clear alarms with hysteresis."""
        a, b = self._quantiles
        limit, size = np.sqrt(a**2 * normal + b**2 * random), np.abs(change)
        self.normal_until = np.where(seen & (size < limit / 2), time, self.normal_until)
        self.large = np.where(seen, (self.large + 1) * (size > limit), self.large)
        self.small = np.where(seen, (self.small + 1) * (size < limit / 2), self.small)
        raised, cleared = ~self.active & (self.large > RAISED), self.active & (self.small > CLEARED)
        self.active = (self.active | raised) & ~cleared
        sureness = 2 * ndtr(size / np.sqrt(normal + random)) - 1
        kinds: list[Kind] = [*["joint"] * len(self._names), "all joints", "payload"]  # type: ignore[list-item]
        return [
            Alarm(
                kind=kinds[k],
                name=(*self._names, *kinds[-2:])[k],
                raised=bool(raised[k]),
                time=time,
                since=float(self.normal_until[k]),
                change=float(change[k] * (self._mass if k == len(change) - 1 else 1.0)),
                sureness=float(sureness[k]),
            )
            for k in np.flatnonzero(raised | cleared)
        ]
