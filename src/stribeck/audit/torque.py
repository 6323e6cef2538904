"""Torques against the model's: joints swapped, magnitudes without a sign, signs, scales and their bounds."""

from collections.abc import Collection

import numpy as np
from scipy.optimize import linear_sum_assignment

from stribeck.audit.bounds import over_limits, weight_carried
from stribeck.audit.cures import listed, scale_line
from stribeck.audit.evidence import Evidence
from stribeck.audit.regression import FEWEST, Fit, fit, friction_shapes, unexplained
from stribeck.finding import Finding
from stribeck.typing import Array

EXPLAINED = 0.8
"""Share of what friction leaves of a torque that the model must explain before anything is said of the joint."""
UNEXPLAINED, CLEARLY = 0.4, 0.2
"""Share of a torque's variance that model and friction of its sign may leave, and of what the other sign leaves."""
LEAST_BINS = 24
BINS_FOR_GAIN = 75
"""In less a motion may be one that the model's errors have a large part in."""
SMALLEST = 2e-3
"""Variation of a joint's model torque over that of the joint with most, from which anything is said of it."""
SURE = 4.0
"""Standard errors by which a gain is not what it should be."""
NEAR = 1.6
"""Gains within this factor of one are what wrong inertias make of a right torque."""
FAR = 5.0
"""A gain beyond this factor, of most joints, makes every number wrong; limits and weights err less."""
MOST = 0.6
"""Share of the joints that something can be said of, from which a cause is one of all joints."""
BETTER = 30.0
"""Product of the factors by which two swapped columns leave less variance of each other's models."""
ALIEN, CARRYING = 0.5, 0.5
"""Share of a torque's variance that model and friction may leave of most joints that carry a load, and the model's
standard deviation over the torque's from which a joint does."""
ONE_SIDED = 0.02
"""Share of its largest size that a torque without a sign may reach on the other side."""
UNITS = {1000.0: "N mm or mN m", 1e-3: "kN m", 1 / 9.81: "kgf m", 8.85: "in lbf", 0.7376: "ft lbf"}
LEVEL = (0.125, 100.0)
"""RMS of torques over the model's that friction cannot explain: it adds, and to ten times the load where gears are
large."""


def judged(found: Fit, largest: float) -> bool:
    """Return whether the model's variation is large against friction and noise, and not tiny against other joints'."""
    if found.share < EXPLAINED or found.leverage < 0.2 or found.swing < SMALLEST * largest:
        return False
    return abs(found.gain) * found.swing > found.friction_and_error


def check_torques(evidence: Evidence, left_out: Collection[str] = ()) -> list[Finding]:
    """Return what is wrong with torques; joints that are left out have been spoken of."""
    if len(evidence.rows) < LEAST_BINS:
        return []
    joints = [k for k, name in enumerate(evidence.joints) if name not in left_out]
    swapped = _swapped(evidence, joints)
    names = {name for finding in swapped for name in finding.joints}
    joints = [k for k in joints if evidence.joints[k] not in names]
    every = {k: found for k in joints if (found := fit(evidence, k)) is not None}
    largest = max((found.swing for found in every.values()), default=0.0)
    fits = {k: found for k, found in every.items() if judged(found, largest)}
    scaled = _scales(evidence, {k: found for k, found in fits.items() if found.gain > 0 or _opposite(found)}, joints)
    return [*swapped, *_signs(evidence, fits, joints), *scaled]


def check_unexplained(evidence: Evidence, left_out: Collection[str] = ()) -> list[Finding]:
    """Return a finding if the model does not explain the torques that it should, as of joints exchanged whole."""
    joints = [k for k, name in enumerate(evidence.joints) if name not in left_out]
    seen = {k: np.isfinite(evidence.model[:, k]) for k in joints}
    carrying = {
        k: unexplained(evidence, k, 1.0)
        for k, rows in seen.items()
        if rows.sum() >= BINS_FOR_GAIN and evidence.model[rows, k].std() > CARRYING * evidence.torque[rows, k].std() > 0
    }
    alien = {k: left for k, left in carrying.items() if left > ALIEN}
    if len(alien) < max(2, MOST * len(carrying)):
        return []
    return [
        Finding(
            check="torque-unexplained",
            channel="torque",
            text=f"the torques are not those that the model asks for: of {len(carrying)} joints that carry a load, "
            f"model and friction leave {_percent(float(np.median(list(alien.values()))))} % (median) of the variance "
            f"of {listed([evidence.joints[k] for k in alien])}",
            cure="check names and order of the joints, zeros, units and contacts",
            joints=tuple(evidence.joints[k] for k in alien),
            stops=True,
        )
    ]


def _opposite(found: Fit) -> bool:
    """Return whether both the model and friction speak of a torque of the other sign, or the model overwhelmingly."""
    return found.gain < -SURE * found.error and (
        found.dissipation < -0.5
        or found.friction < found.residual
        or abs(found.gain) * found.swing > 3 * found.friction
    )


def _signs(evidence: Evidence, fits: dict[int, Fit], joints: list[int]) -> list[Finding]:
    """Return a finding on torques that model and friction explain far better with the other sign."""
    left = {k: (unexplained(evidence, k, 1.0), unexplained(evidence, k, -1.0)) for k in joints}
    agreeing = {k for k, (same, other) in left.items() if same < min(UNEXPLAINED, CLEARLY * other)}
    opposite = {k for k, (same, other) in left.items() if other < min(UNEXPLAINED, CLEARLY * same)}
    if len(evidence.rows) < BINS_FOR_GAIN:
        opposite = {k for k in opposite if k in fits}  # friction alone may look like its opposite for a short time
    opposite |= {k for k, found in fits.items() if _opposite(found)} - agreeing
    if not opposite:
        return []
    names = [evidence.joints[k] for k in sorted(opposite)]
    most = len(opposite) >= max(2, MOST * len(opposite | agreeing | set(fits)))
    everyone = most and not agreeing
    same, other = (_percent(float(np.median([left[k][side] for k in opposite]))) for side in (0, 1))
    return [
        Finding(
            check="torque-sign",
            channel="torque",
            text=f"the torque runs against the model, its sign or the position's is inverted: {listed(names)}; model "
            f"and friction leave {same} % of its variance unexplained as it is, {other} % inverted",
            cure=scale_line(evidence.robot, dict.fromkeys(evidence.joints if everyone else names, -1.0)),
            joints=tuple(names),
            stops=most,
        )
    ]


def _percent(share: float) -> str:
    return f"{100 * share:.2g}" if share < 1 else f"{100 * share:.0f}"


def _scales(evidence: Evidence, fits: dict[int, Fit], joints: list[int]) -> list[Finding]:
    """Return findings on torques whose size cannot be: gains that are not one, bounds that are exceeded, levels."""
    off = {
        k: found
        for k, found in fits.items()
        if not 1 / NEAR < abs(found.gain) < NEAR and abs(abs(found.gain) - 1) > SURE * found.error and _surely(found)
    }
    if len(off) >= max(_few(evidence), MOST * len(fits)):
        return [_scale_of_all(evidence, {k: abs(found.gain) for k, found in off.items()})]
    bounded = _out_of_bounds(evidence, [k for k in joints if k not in off])
    if any(finding.stops for finding in bounded):
        return bounded
    levels = _levels(evidence, joints)
    if len(fits) < 2 and len(levels) >= 2 and not any(LEVEL[0] < level < LEVEL[1] for level in levels.values()):
        return [_scale_of_all(evidence, levels)]
    off = {k: found for k, found in off.items() if evidence.moves(k)}  # the gear of a joint at rest holds any torque
    if not off or len(evidence.rows) < BINS_FOR_GAIN:
        return bounded
    gains = ", ".join(f"{evidence.joints[k]} {found.gain:.3g} +- {2 * found.error:.1g}" for k, found in off.items())
    gear = all(not 1 / 12 < abs(found.gain) < 12 for found in off.values())
    return [
        Finding(
            check="torque-gain",
            channel="torque",
            text=f"the torque is not the model's in size{', as if a gear ratio were left out' if gear else ''}: "
            f"gain {gains}; the other joints agree with the model",
            cure=scale_line(evidence.robot, {evidence.joints[k]: 1 / abs(found.gain) for k, found in off.items()}),
            joints=tuple(evidence.joints[k] for k in off),
        ),
        *bounded,
    ]


def _surely(found: Fit) -> bool:
    """Return whether the gain is off as well if all of the error is the model's (regression the other way round)."""
    other = abs(found.gain) / found.share
    return not 1 / NEAR < other < NEAR and (other > 1) == (abs(found.gain) > 1)


def _levels(evidence: Evidence, joints: list[int]) -> dict[int, float]:
    """Return RMS of the torque over the model's, of the joints that carry most and whose torque is not zero."""
    model = np.array([_rms(evidence.model[:, k]) for k in joints])
    if len(model) == 0 or not model.max() > 0:
        return {}
    carrying = [(k, size) for k, size in zip(joints, model.tolist(), strict=True) if size > 0.2 * model.max()]
    levels = {k: _rms(evidence.torque[np.isfinite(evidence.model[:, k]), k]) / size for k, size in carrying}
    return {k: level for k, level in levels.items() if level > 0}


def _rms(values: Array) -> float:
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if len(finite) else 0.0


def _scale_of_all(evidence: Evidence, gains: dict[int, float]) -> Finding:
    middle = float(np.median(list(gains.values())))
    common = all(abs(np.log(gain / middle)) < 0.3 for gain in gains.values())
    unit = _unit(middle) if common else None
    if unit:
        guess = f"as if they were in {UNITS[unit]}"
        factors = dict.fromkeys(evidence.joints, 1 / unit)
    elif common:
        guess = "by one factor"
        factors = dict.fromkeys(evidence.joints, 1 / middle)
    else:
        guess = "each by a factor of its own, as amperes or torques before the gear are"
        factors = {evidence.joints[k]: 1 / gain for k, gain in gains.items()}
    shown = ", ".join(f"{evidence.joints[k]} {gain:.3g}" for k, gain in list(gains.items())[:6])
    return Finding(
        check="torque-scale",
        channel="torque",
        text=f"the torques are a median of {middle:.3g} times the model's, {guess}: {shown}",
        cure=scale_line(evidence.robot, factors),
        joints=tuple(evidence.joints[k] for k in gains),
        stops=not 1 / FAR < middle < FAR,
    )


def _few(evidence: Evidence) -> int:
    """Return how many joints it takes for a cause that all have: two, unless the robot has a single one."""
    return min(2, len(evidence.joints))


def _unit(factor: float) -> float | None:
    """Return the unit, a key of `UNITS`, that makes torques larger by such a factor, None if none does."""
    nearest = min(UNITS, key=lambda ratio: abs(np.log(factor / ratio)))
    return nearest if abs(np.log(factor / nearest)) < 0.15 else None


def _out_of_bounds(evidence: Evidence, joints: list[int]) -> list[Finding]:
    """Return a finding on torques that cannot be by the robot's weight or the model's effort limits.

    They bound the scale where the model's torque is too small a part of a joint's for a gain.
    """
    carried = weight_carried(evidence)
    if carried is not None and not 1 / FAR < carried < FAR:
        unit = _unit(carried)
        return [
            Finding(
                check="torque-scale",
                channel="torque",
                text=f"the torques carry {carried:.3g} times the robot's weight where it stands"
                + (f", as if they were in {UNITS[unit]}" if unit else ""),
                cure=scale_line(evidence.robot, dict.fromkeys(evidence.joints, 1 / (unit or carried))),
                joints=evidence.joints,
                stops=True,
            )
        ]
    reached = {k: times for k, times in over_limits(evidence).items() if k in joints}
    over = {evidence.joints[k]: times for k, times in reached.items() if times > FAR}
    if not over:
        return []
    most = len(over) >= max(_few(evidence), MOST * len(reached))
    line = scale_line(evidence.robot, dict.fromkeys(evidence.joints if most else over, 1e-3))
    return [
        Finding(
            check="torque-scale" if most else "torque-gain",
            channel="torque",
            text="the torques exceed the model's effort limits: "
            + listed([f"{name} {times:.3g} times" for name, times in over.items()]),
            cure=f"check its unit and gear ratio, and the model's limits; if it is in N mm or mN m, {line}",
            joints=tuple(over),
            stops=most,
        )
    ]


def check_unsigned(evidence: Evidence, left_out: Collection[str] = ()) -> list[Finding]:
    """Return a finding on torques that never change their sign although the motion asks for it."""
    joints = [k for k, name in enumerate(evidence.joints) if name not in left_out]
    one_sided = [k for k in joints if _touches_zero(evidence, k)]
    sure = [k for k in one_sided if _folded(evidence, k)]
    active = [k for k in joints if evidence.moves(k)]
    if len(one_sided) >= max(3, 0.8 * len(active)):
        sure = one_sided
    if not sure:
        return []
    most = len(sure) >= max(2, MOST * len(active))
    names = [evidence.joints[k] for k in sure]
    return [
        Finding(
            check="torque-unsigned",
            channel="torque",
            text=f"the torque never changes its sign, although the motion asks for it: {listed(names)}; "
            "it seems to be a magnitude",
            cure="log the torque with its sign; no setting brings it back",
            joints=tuple(names),
            stops=most,
        )
    ]


def _touches_zero(evidence: Evidence, k: int) -> bool:
    """Return whether a moving joint's torque comes close to zero from one side, again and again."""
    if not evidence.moves(k) or not evidence.runs:
        return False
    torque = np.concatenate([run.torque[:, k] for run in evidence.runs])
    size = np.abs(torque)
    most = float(np.percentile(size, 99))
    if most == 0 or (torque.min() < -ONE_SIDED * most and torque.max() > ONE_SIDED * most):
        return False
    near = size < 0.1 * most
    visits = int(np.count_nonzero(near[1:] & ~near[:-1]))
    return visits >= 3


def _folded(evidence: Evidence, k: int) -> bool:
    """Return whether the size of the model's torque explains a torque that its sign does not."""
    model = evidence.model[:, k]
    torque = np.abs(evidence.torque[:, k])
    plain, folded = fit(evidence, k), fit(evidence, k, model=np.abs(model), torque=torque)
    if plain is None or folded is None:
        return False
    return folded.share > 0.6 and 0.5 < folded.gain < 2 and folded.residual < 0.7 * plain.residual


def _swapped(evidence: Evidence, joints: list[int]) -> list[Finding]:
    """Return a finding on torques that other joints' models explain far better than their own."""
    joints = [k for k in joints if np.isfinite(evidence.model[:, k]).sum() >= LEAST_BINS]
    if len(joints) < 2:
        return []
    left, gain, share = _cross_fits(evidence, joints)
    rows, columns = linear_sum_assignment(np.log(left))
    found: list[tuple[int, ...]] = []
    seen: set[int] = set()
    for start in rows.tolist():
        cycle = []
        while start not in seen:
            seen.add(start)
            cycle.append(start)
            start = int(columns[start])
        to = columns[cycle]
        if len(cycle) > 1:
            factors = left[cycle, cycle] / left[cycle, to]
            fits = (gain[cycle, to] > 1 / NEAR) & (gain[cycle, to] < NEAR) & (share[cycle, to] > EXPLAINED)
            if fits.all() and factors.min() > 1.2 and np.prod(factors) > BETTER ** (len(cycle) / 2):
                found.append(tuple(joints[i] for i in cycle))
    if not found:
        return []
    index = {k: i for i, k in enumerate(joints)}
    parts = []
    for group in found:
        own = ", ".join(f"{gain[index[k], index[k]]:.2f}" for k in group)
        parts.append(" and ".join(evidence.joints[k] for k in group) + f" (gains on their own models: {own})")
    return [
        Finding(
            check="joints-swapped",
            channel="torque",
            text=f"the models of each other explain the torques of these joints far better: {listed(parts)}",
            cure="exchange them in [log] joint_names or joint_order",
            joints=tuple(evidence.joints[k] for group in found for k in group),
            stops=len([k for group in found for k in group]) >= MOST * len(evidence.joints),
        )
    ]


def _cross_fits(evidence: Evidence, joints: list[int]) -> tuple[Array, Array, Array]:
    """Return residual variance over variance, gain and share of each torque (row) on each model (column)."""
    left, gain, share = np.ones((3, len(joints), len(joints)))
    for column, k in enumerate(joints):
        rows = np.isfinite(evidence.model[:, k])
        if rows.sum() < FEWEST:
            continue
        shapes = friction_shapes(evidence, k, rows)
        basis = np.linalg.qr(shapes / np.maximum(np.linalg.norm(shapes, axis=0), 1e-12))[0]
        torques = evidence.torque[rows][:, joints]
        spread = np.maximum(np.sum((torques - torques.mean(axis=0)) ** 2, axis=0), 1e-30)
        torques = torques - basis @ (basis.T @ torques)
        model = evidence.model[rows, k]
        model = model - basis @ (basis.T @ model)
        power = float(model @ model)
        before = np.maximum(np.sum(torques**2, axis=0), 1e-30)
        along = model @ torques / max(power, 1e-30)
        after = np.maximum(before - along**2 * power, 1e-9 * before)
        left[:, column], gain[:, column], share[:, column] = after / spread, along, 1 - after / before
    return np.maximum(left, 1e-9), gain, share
