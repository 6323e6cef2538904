"""External torques against what measured torques and the model leave for them: signs and sizes."""

from collections.abc import Collection

from stribeck.audit.cures import listed, scale_line
from stribeck.audit.evidence import Evidence
from stribeck.audit.regression import Fit, fit
from stribeck.audit.torque import MOST, NEAR, SURE, judged
from stribeck.finding import Finding


def check_external(evidence: Evidence, left_out: Collection[str] = ()) -> list[Finding]:
    """Return what is wrong with external torques; joints that are left out have been spoken of.

    What friction and inverse dynamics leave of the measured torque is the external one's opposite, while friction
    resists: otherwise the measured torque is at fault.
    """
    off: dict[str, Fit] = {}
    for k, name in enumerate(evidence.joints):
        external = evidence.external[:, k]
        if name in left_out or not external.any():
            continue
        dynamics = evidence.model[:, k] + external
        found = fit(evidence, k, model=-external, torque=evidence.torque[:, k] - dynamics)
        if found is None or not judged(found, found.swing) or found.dissipation < 0:
            continue
        if not 1 / NEAR < found.gain < NEAR and abs(found.gain - 1) > SURE * found.error:
            off[name] = found
    if not off:
        return []
    gains = listed([f"{name} {found.gain:.3g} +- {2 * found.error:.1g}" for name, found in off.items()])
    return [
        Finding(
            check="external-torque",
            channel="external_torque",
            text=f"the external torque is not what the measured torque and the model ask for, its sign or unit is "
            f"another: gain {gains}",
            cure=scale_line(evidence.robot, {name: found.gain for name, found in off.items()}, "external_torque"),
            joints=tuple(off),
            stops=len(off) >= MOST * len(evidence.joints),
        )
    ]
