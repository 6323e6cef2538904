"""The audit of a log before friction is fitted, from checks without a model to checks of the whole model."""

from stribeck.check.audit.base import check_base
from stribeck.check.audit.channels import check_channels
from stribeck.check.audit.delay import Lag, check_delay, delays
from stribeck.check.audit.disturbed import disturbed_spans, explained, rest_of, unexplained_joints
from stribeck.check.audit.evidence import AuditData, gather
from stribeck.check.audit.motion import check_motion
from stribeck.check.audit.positions import check_positions
from stribeck.check.audit.scale import check_external
from stribeck.check.audit.torque import check_torques, check_unexplained, check_unsigned
from stribeck.check.audit.trials import check_by_trial
from stribeck.core.base.finding import Finding, merged
from stribeck.core.base.spans import listed_spans
from stribeck.core.equations.friction_torque.preparation import Logs, PreparedLog, log_names
from stribeck.core.errors import LogError, errors_about, findings_kept
from stribeck.core.log.sampling import SHORT
from stribeck.core.robot import Robot
from stribeck.core.settings import Settings


def audit(prepared: PreparedLog, robot: Robot, settings: Settings) -> list[Finding]:
    """Check a log's channels, also against the model; findings that stop come first.

    Raises
    ------
    LogError, SettingsError
        If the log lacks a channel that the settings require, or the settings do not suit it.
    """
    evidence = gather(prepared, robot, settings)
    return findings(evidence, delays(evidence), settings)


def audit_or_stop(prepared: Logs, robot: Robot, settings: Settings, force: bool) -> list[Finding]:
    """Check several logs; a finding of several logs is reported once, with their paths.

    Raises
    ------
    LogError
        If a finding stops and `force` is not set; the other findings are its notes.
    """
    reports = []
    for where, part in zip(log_names(prepared), prepared, strict=True):
        with errors_about(where):
            report = audit(part, robot, settings)
        stops = next((finding for finding in report if finding.stops), None)
        if stops and not force:
            with findings_kept([str(finding) for finding in report if finding is not stops]):
                message = f"{where}: {stops}. Every number would be wrong ({stops.place})"
                raise LogError(message, option="--force continues anyway")
        reports.append((where, report))
    return merged(reports)


def findings(evidence: AuditData, lags: dict[str, Lag], settings: Settings) -> list[Finding]:
    """Run all checks on a log, given the lag of each joint's torque.

    A cause on which the model's torque depends suppresses the checks after it: with frozen positions, exchanged feet
    or inverted gravity, comparing torques gives no information about signs and gains.
    """
    samples, channels, positions = check_samples(evidence), check_channels(evidence), check_positions(evidence)
    coarse = [finding for finding in channels if finding.check == "channel-coarse"]
    worse = [finding for finding in channels if finding.channel == "torque" and finding not in coarse]
    left_out = {name for finding in worse for name in finding.joints}
    left_out |= evidence.prepared.log.unscaled.keys() | evidence.standing  # their gains are rough or unknown
    if unsigned := check_unsigned(evidence, left_out):
        channels = [finding for finding in channels if finding not in coarse]
    left_out |= {name for finding in (*unsigned, *coarse) for name in finding.joints}
    useless = {"channel-frozen", "position-degrees", "position-jump"}  # positions that cannot be compared
    lost = any(f.check in useless and f.channel == "position" for f in (*channels, *positions))
    by_trial = [] if lost else check_by_trial(evidence, settings)
    base = [] if lost or by_trial else check_base(evidence)
    problems = [*channels, *positions, *by_trial, *base, *samples, *unsigned]
    if not lost and not by_trial and not any(f.stops for f in problems):
        problems += _without_disturbances(evidence, lags, left_out)
    return sorted(problems, key=lambda finding: not finding.stops)


def _without_disturbances(evidence: AuditData, lags: dict[str, Lag], left_out: set[str]) -> list[Finding]:
    """Compare torques with the model; what exists only in spans of the log is reported as a disturbance."""
    problems = _compare(evidence, lags, left_out)
    alien = unexplained_joints(evidence) - left_out
    if not problems and not alien:
        return []
    spans, disturbed = disturbed_spans(evidence)
    rest = rest_of(evidence, disturbed)
    again = _compare(rest, lags, left_out)
    checks = {finding.check for finding in again}
    problems = again if "torque-scale" in checks else problems  # disturbances hide it in the whole log
    only_there = {joint for finding in problems if finding.check not in checks for joint in finding.joints}
    known = explained(evidence, rest)
    if checks - {finding.check for finding in problems} or only_there - known or not (only_there | alien) & known:
        return problems
    return [Finding.of("set-aside.audit", spans=listed_spans(spans), exclude=spans), *again]


def _compare(evidence: AuditData, lags: dict[str, Lag], left_out: set[str]) -> list[Finding]:
    """Compare torques with the model."""
    if causes := check_motion(evidence):
        return causes
    external = check_external(evidence, left_out)
    left_out = left_out | {name for finding in external for name in finding.joints}
    torques = check_torques(evidence, left_out)
    delay = [] if any(f.stops for f in torques) else check_delay(evidence, lags)
    return [*external, *torques, *delay] or check_unexplained(evidence, left_out)


def check_samples(evidence: AuditData) -> list[Finding]:
    """Report unused parts of a log: lost samples, and samples after a fall."""
    sampling, time = evidence.prepared.sampling, evidence.prepared.log.time
    problems = []
    if sampling.lost > 0.2:
        problems.append(Finding.of("samples-lost", lost=100 * sampling.lost, short=SHORT, gaps=len(sampling.gaps)))
    phases = evidence.prepared.support.phases
    if evidence.robot.base == "floating" and phases and sampling.segments[-1].stop > phases[-1].stop:
        end = float(time[phases[-1].stop - 1])
        problems.append(Finding.of("base-falls", end=end, left=time[-1] - end))
    return problems
