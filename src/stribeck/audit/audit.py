"""The audit: what is checked of a log before friction is fitted, from what needs no model to what needs all of it."""

from collections.abc import Sequence

from stribeck.audit.base import check_base
from stribeck.audit.channels import check_channels
from stribeck.audit.delay import check_delay, delays
from stribeck.audit.evidence import Evidence, gather
from stribeck.audit.external import check_external
from stribeck.audit.motion import check_motion
from stribeck.audit.positions import check_positions
from stribeck.audit.samples import check_samples
from stribeck.audit.torque import check_torques, check_unexplained, check_unsigned
from stribeck.errors import LogError, errors_about, findings_kept
from stribeck.finding import Finding, merged
from stribeck.preparation import PreparedLog, log_names
from stribeck.robot import Robot
from stribeck.settings import Settings


def audit(prepared: PreparedLog, robot: Robot, settings: Settings) -> list[Finding]:
    """Return what is wrong with a log, by its own channels and against the model; those that stop come first.

    Raises
    ------
    LogError, SettingsError
        If the log lacks a channel that the settings ask for, or the settings do not suit it.
    """
    evidence = gather(prepared, robot, settings)
    return findings(evidence, delays(evidence))


def audit_or_stop(prepared: Sequence[PreparedLog], robot: Robot, settings: Settings, force: bool) -> list[Finding]:
    """Return what is wrong with logs, each once, with its logs where there are several.

    Raises
    ------
    LogError
        If something makes every number wrong, unless forced; all else that was found are its notes.
    """
    found = []
    for where, part in zip(log_names(prepared), prepared, strict=True):
        with errors_about(where):
            each = audit(part, robot, settings)
        stops = next((finding for finding in each if finding.stops), None)
        if stops and not force:
            with findings_kept([str(finding) for finding in each if finding is not stops]):
                raise LogError(f"{where}: {stops}; every number would be wrong, --force goes on ({stops.place})")
        found.append((where, each))
    return merged(found)


def model_findings(robot: Robot) -> list[Finding]:
    """Return what is odd about the robot's model, whatever the log."""
    return [Finding(check="robot-model", text=text) for text in robot.warnings]


def findings(evidence: Evidence, late: dict[str, float]) -> list[Finding]:
    """Return what is wrong with a log, given the delay of each joint's torque [s].

    A cause that the model's torque depends on is spoken of alone: with frozen positions, exchanged feet or gravity
    upside down the model's torques say nothing of signs and gains.
    """
    samples, channels, positions = check_samples(evidence), check_channels(evidence), check_positions(evidence)
    spoken_of = {name for finding in channels for name in finding.joints if finding.channel == "torque"}
    unsigned = check_unsigned(evidence, spoken_of)
    spoken_of |= {name for finding in unsigned for name in finding.joints}
    lost = any(f.check == "channel-frozen" and f.channel == "position" for f in channels)
    lost = lost or any(f.check in ("position-degrees", "position-jump", "position-limits") for f in positions)
    base = [] if lost else check_base(evidence)
    found = [*channels, *positions, *base, *samples, *unsigned]
    if not lost and not any(f.stops for f in found):
        by_motion = check_motion(evidence)
        external = [] if by_motion else check_external(evidence, spoken_of)
        spoken_of |= {name for finding in external for name in finding.joints}
        torques = [] if by_motion else check_torques(evidence, spoken_of)
        delay = [] if by_motion or any(f.stops for f in torques) else check_delay(evidence, late)
        causes = [*by_motion, *external, *torques, *delay]
        found += causes or check_unexplained(evidence, spoken_of)
    return sorted(found, key=lambda finding: not finding.stops)
