"""Alarms with a stated false-alarm rate, for joints, for all joints at once, and for a payload.

The friction of a joint is compared with two references: its friction in the first minute of motion, limited to what
logs of one robot normally differ from the identified friction, and its friction about two minutes ago. A change that
most joints share, such as that of a colder robot, is fitted first: one factor for all friction and one for viscous
friction. The rest is a joint's own change. With V the variance of normal changes and of the reference, and P of the
current estimate, an alarm needs a change above

    sqrt(a^2 V + b^2 P)

where a and b are the normal quantiles for one false alarm in the given time, if normal changes differ from hour to
hour, and estimates from one `APART` to the next. Within minutes, normal changes are small: V grows with the time
since the reference as for a first-order process with the time constant of an hour.

Two more alarms are about the stream: a joint was not observed in half a minute of motion, or its torque differs from
the model far more than it did in the identified log. They count samples, because the stamps may be wrong.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.special import ndtr, ndtri  # avoids the slow import of scipy.stats

from stribeck.core.base.typing import Array, BoolArray
from stribeck.service.online.baseline import Baseline

APART, SESSION, NORMAL = 10.0, 3600.0, 0.04
"""Time between independent estimates and between independent normal changes [s], and standard deviation of normal
changes of a joint's friction relative to the other joints [1]."""
RAISED, CLEARED = 1.0, 5.0
"""Time beyond the limit until an alarm is raised, and within half of the limit until it is cleared [s]."""
LEARNED, PRIOR = 60.0, 2.0
"""Duration of motion that the reference averages, and the weight of the identified friction in it [s]."""
SHARED_LEAST, PAYLOAD_LEAST, UNSEEN, STRANGE = 0.1, 0.02, 30.0, 6.0
"""Smallest common change of friction [1], payload relative to the robot's mass [1], duration of motion without
observations [s], and unexplained torque relative to the identified log's [1] that raise an alarm."""
FEWEST = 4
"""Smallest number of joints whose common change is separated from changes of single joints."""

Pair = tuple[float, float]
Kind = Literal["joint", "all joints", "payload", "unseen", "strange"]
TEXTS: dict[Kind, tuple[str, str]] = {
    "joint": ("friction {:+.0%}", ""),
    "all joints": ("friction {:+.0%}", ""),
    "payload": ("payload {:+.1f} kg", ""),
    "unseen": ("no observations for {:.0f} s", "; check its sensors and the stamps"),
    "strange": ("unexplained torque {:.1f} times that of the identified log", "; check order, signs and units"),
}
"""Change and remedy of each kind, in the order of the channels."""


@dataclass(frozen=True, kw_only=True)
class Alarm:
    """Raised or cleared alarm.

    Attributes
    ----------
    kind, name
        What has changed: the friction of a joint by its name, all joints, or a payload; or which joint is not observed
        ("unseen"), or has torques that do not fit the model ("strange").
    raised
        Whether the alarm is raised, or cleared.
    time, since
        Time of the decision, and start of the change [s].
    change
        Change since the reference relative to the friction [1]; for a payload, its mass [kg]; for an unseen joint,
        the duration of its motion [s]; for a strange one, its unexplained torque relative to the identified log's [1].
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
    def key(self) -> str:
        """Name among the raised alarms."""
        return f"{self.name} {self.kind}" if TEXTS[self.kind][1] else self.name

    @property
    def line(self) -> str:
        """One line, e.g. "left_knee: friction +31 % since 120.5 s (sure to 99.99 %)"."""
        what, remedy = TEXTS[self.kind]
        end = f"since {self.since:.1f} s{remedy or f' (sure to {100 * self.sureness:.5g} %)'}"
        change = what.format(self.change).replace("%", " %")
        return f"{self.name}: {change} {end if self.raised else 'is normal again'}"


class Watchdog:
    """Decides once per second on alarms of n joints, all joints, a payload, and n unseen and n strange joints.

    These are K = 3 n + 2 channels in this order.

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
        self._spread, self._mass = of.spread, mass
        own = dict.fromkeys(("joint", "unseen", "strange"), of.names)
        self._channels = [(kind, name) for kind in TEXTS for name in own.get(kind, (kind,))]
        self._shapes = np.stack([np.ones(joints), of.viscous_share], axis=1)
        checks = 4 * (joints + 2) * hours * 3600  # of two references and two directions
        self._quantiles = -ndtri(0.5 / (checks / SESSION)), -ndtri(0.5 / (checks / APART))
        self.reference, self.learned = np.zeros((joints, 2)), np.zeros(joints)
        self.recent, self.observed = np.zeros((2, joints, 3)), np.zeros(joints)  # mean changes and time, averaged again
        self.payload = np.zeros(2)  # relative mass, and the duration that it averages
        self.active = np.zeros(len(self._channels), dtype=bool)
        self.large, self.small, self.normal_until = np.zeros((3, len(self._channels)))

    def check(
        self, time: float, changes: Array, covariance: Array, moved: BoolArray, payload: Pair, stream: Array
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
        stream
            Duration of motion without observations [s], and unexplained torque relative to the identified log's [1],
            shape (2, n).
        """
        recent, drift = self.recent[1], -np.expm1(-np.abs(time - self.recent[1, :, 2]) / SESSION)
        normal = NORMAL**2 + self._spread**2 * PRIOR / (PRIOR + self.learned)
        first, shared = self._own_change(changes - self.reference, covariance, normal, moved)
        # half of the covariance is the filter's own walk, and the recent reference has some noise
        later, _ = self._own_change(changes - recent[:, :2], covariance * 2 / 3, 2 * NORMAL**2 * drift, moved)
        larger = (self.observed >= LEARNED) & (self._relative(later) > self._relative(first))
        mass = np.array([payload[0] - self.payload[0], (PAYLOAD_LEAST / self._quantiles[0]) ** 2, payload[1] ** 2])
        tests = np.column_stack([np.where(larger, later, first), shared, mass])
        size = np.concatenate([self._relative(tests), stream[0] / UNSEEN, stream[1] / STRANGE])
        sureness = np.append(2 * ndtr(np.abs(tests[0]) / np.sqrt(tests[1] + tests[2])) - 1, np.ones(stream.size))
        tests[0, -1] *= self._mass
        known = self.learned >= 5.0  # [s] of motion, until a joint's noise is known
        seen = np.concatenate([moved & known, np.isfinite(tests[2, -2:]), np.ones_like(moved), moved & known])
        alarms = self._decide(time, np.append(tests[0], stream), size, sureness, seen)
        self._learn(time, changes, moved, payload)
        if any(alarm.kind == "payload" for alarm in alarms):
            self.observed[:] = 0.0  # the model's errors differ under another load: the recent reference starts anew
        return alarms

    def _own_change(self, shift: Array, covariance: Array, normal: Array, moved: BoolArray) -> tuple[Array, Array]:
        """Separate changes of single joints, shape (3, n), from the shared one, shape (3,).

        The rows are the change, and the variances of normal changes and of the estimate.
        """
        shared, error = self._fit_shared(shift, covariance, normal, moved)
        k = int(np.argmax(np.abs(shared) / error))
        rows = np.stack([shift.sum(axis=1) - self._shapes @ shared, normal, covariance.sum(axis=(1, 2))])
        return rows, np.array([shared[k], (SHARED_LEAST / self._quantiles[0]) ** 2, error[k] ** 2])

    def _relative(self, tests: Array) -> Array:
        """Divide the size of changes by their limits."""
        change, normal, random = tests
        a, b = self._quantiles
        return np.asarray(np.abs(change) / np.sqrt(a**2 * normal + b**2 * random))

    def _learn(self, time: float, changes: Array, moved: BoolArray, payload: Pair) -> None:
        """Average the first minute of motion, and recent minutes, of joints without an alarm."""
        joints = len(moved)
        share = np.where(moved & (self.learned < LEARNED), 1 / (PRIOR + self.learned + 1), 0.0)
        limit = 1.96 * self._spread[:, None]
        self.reference += share[:, None] * (np.clip(changes, -limit, limit) - self.reference)
        self.learned += share > 0
        if np.isfinite(payload[1]) and self.payload[1] < LEARNED and not self.active[joints + 1]:
            mean, seconds = self.payload
            self.payload[:] = mean + (payload[0] - mean) / (PRIOR + seconds + 1), seconds + 1
        share = (moved & ~self.active[:joints]) / np.minimum(self.observed + 1, LEARNED)
        self.recent[0] += share[:, None] * (np.column_stack([changes, np.full(joints, time)]) - self.recent[0])
        self.recent[1] += share[:, None] * (self.recent[0] - self.recent[1])
        self.observed += share > 0

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

    def _decide(self, time: float, change: Array, size: Array, sureness: Array, seen: BoolArray) -> list[Alarm]:
        """Raise and clear alarms with hysteresis; `size` is relative to the limit."""
        self.normal_until = np.where(seen & (size < 0.5), time, self.normal_until)
        self.large = np.where(seen, (self.large + 1) * (size > 1), self.large)
        self.small = np.where(seen, (self.small + 1) * (size < 0.5), self.small)
        raised, cleared = ~self.active & (self.large > RAISED), self.active & (self.small > CLEARED)
        self.active = (self.active | raised) & ~cleared
        rows = zip(self._channels, raised.tolist(), self.normal_until, change, sureness, strict=True)
        return [
            Alarm(kind=kind, name=name, raised=up, time=time, since=float(a), change=float(b), sureness=float(c))
            for k, ((kind, name), up, a, b, c) in enumerate(rows)
            if raised[k] or cleared[k]
        ]
