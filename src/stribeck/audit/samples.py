"""Samples that are lost, and a robot that falls."""

from stribeck.audit.evidence import Evidence
from stribeck.finding import Finding
from stribeck.log.sampling import SHORT

MUCH_LOST = 0.2
"""Share of the samples [1] that are cut out or between gaps, from which that is a finding."""


def check_samples(evidence: Evidence) -> list[Finding]:
    """Return findings on the parts of a log that cannot be used."""
    sampling, time = evidence.prepared.sampling, evidence.prepared.log.time
    found = []
    if sampling.lost > MUCH_LOST:
        found.append(
            Finding(
                check="samples-lost",
                text=f"{100 * sampling.lost:.0f} % of the samples are not used, as they lack values or lie in parts "
                f"shorter than {SHORT:g} s ({len(sampling.gaps)} gaps)",
                cure="[log] max_gap would bridge longer ones" if sampling.gaps else "make longer logs",
            )
        )
    phases = evidence.prepared.support.phases
    if evidence.robot.base == "floating" and phases and sampling.segments[-1].stop > phases[-1].stop:
        end = float(time[phases[-1].stop - 1])
        found.append(
            Finding(
                check="base-falls",
                text=f"the robot falls after {end:.2f} s, and {time[-1] - end:.2f} s are left out",
                cure="end the log before that; if it does not fall, see [log.base_orientation] and [robot] base_frame",
            )
        )
    return found
