"""Inspection of a log before identification: channels, sampling, contact modes, ranges, delays and signs."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np

from stribeck.check.audit import AuditData, delays, findings, gather
from stribeck.check.audit.delay import Lag
from stribeck.check.drives import find_torques
from stribeck.core.base.finding import Finding
from stribeck.core.base.text_table import TextTable, span
from stribeck.core.base.threads import one_blas_thread
from stribeck.core.base.typing import Array, TorqueSource
from stribeck.core.equations.friction_torque.inverse_dynamics import support_name
from stribeck.core.equations.friction_torque.preparation import PreparedLog, log_path, prepare
from stribeck.core.equations.friction_torque.stage import with_filter
from stribeck.core.errors import errors_about, findings_kept
from stribeck.core.filters import make_filter
from stribeck.core.identify.audited import model_findings
from stribeck.core.log import LogLike
from stribeck.core.robot import Robot
from stribeck.core.settings import Settings

UNITS = ("rad", "rad/s", "N m")
"""Units of position, velocity and torque of revolute joints, which headings of tables show."""


@dataclass(frozen=True, kw_only=True)
class JointInspection:
    """Ranges of one joint, and a comparison of its torque with the model's.

    Attributes
    ----------
    position_range, velocity_range, torque_range
        Smallest and largest value in `units`.
    correlation
        Correlation of measured torque and inverse dynamics; None if the model's torque is unknown or constant.
    delay
        Delay of the torque relative to the motion [s]; None if the model explains too little of the torque.
    sign
        "opposite" if the audit reports it, "agrees" if the torque correlates with the model.
    torque_unit
        Unit of the torque if a torque constant or kp is unknown, "A", "rad" or "m"; None for N m and N.
    prismatic
        Whether the joint is prismatic.
    """

    position_range: tuple[float, float]
    velocity_range: tuple[float, float]
    torque_range: tuple[float, float]
    correlation: float | None
    delay: float | None
    sign: Literal["agrees", "opposite", "unclear"]
    torque_unit: str | None = None
    prismatic: bool = False

    @property
    def units(self) -> tuple[str, str, str]:
        """Units of position, velocity and torque."""
        units = ("m", "m/s", "N") if self.prismatic else UNITS
        return units[0], units[1], self.torque_unit or units[2]

    @property
    def spans(self) -> list[tuple[tuple[float, float], str]]:
        """Ranges of position, velocity and torque, each with its unit where it differs from `UNITS`."""
        ranges = self.position_range, self.velocity_range, self.torque_range
        triples = zip(ranges, self.units, UNITS, strict=True)
        return [(ends, "" if unit == usual else unit) for ends, unit, usual in triples]


@dataclass(frozen=True, kw_only=True, repr=False)
class Inspection:
    """Result of `stribeck inspect`.

    Attributes
    ----------
    channels
        Name and shape of each channel of the log.
    phases
        Start [s], end [s], contact mode, and whether the phase is used.
    gaps
        Last stamp before and first stamp after each gap [s].
    findings
        Problems that a user should act on, one sentence each; fatal errors come first.
    audit
        Structured findings: check, evidence, remedy, joints.
    torque_source
        Source of the torques.
    evidence
        Measured torque and the model's, which the page draws; not part of the JSON text.
    """

    robot: str
    path: str
    samples: int
    duration: float
    rate: float
    jitter: float
    duplicates: int
    gaps: list[tuple[float, float]]
    missing: dict[str, int]
    channels: dict[str, list[int]]
    support_source: str
    phases: list[tuple[float, float, str, bool]]
    filter: str
    joints: dict[str, JointInspection]
    findings: list[str]
    notes: list[str]
    audit: list[Finding] = field(default_factory=list)
    torque_source: TorqueSource = "link_side_sensor"
    evidence: AuditData | None = field(default=None, compare=False)

    def __repr__(self) -> str:
        size = f"{self.samples} samples in {self.duration:.4g} s, {len(self.joints)} joints"
        count = f"{len(self.findings)} finding{'s' * (len(self.findings) != 1)}"
        return f"Inspection({self.robot!r}, {self.path or 'log'}: {size}, {count})"

    def table(self) -> TextTable:
        """Build a table with one row per joint, and one sentence per finding and note."""
        delayed = any(finding.check == "torque-delay" for finding in self.audit)
        rows = [
            [
                name,
                *(f"{span(ends)} {unit}".rstrip() for ends, unit in joint.spans),
                "" if joint.correlation is None else f"{joint.correlation:.2f}",
                *["" if joint.delay is None else f"{1e3 * joint.delay:+.2f}"] * delayed,
                "unclear: the model's torque is too small" if joint.sign == "unclear" else joint.sign,
            ]
            for name, joint in self.joints.items()
        ]
        return TextTable(
            title=f"Joints of {self.robot}",
            left=["joint"],
            right=[*map("{} [{}]".format, ("position", "velocity", "torque"), UNITS), "correlation with model"]
            + ["torque delay [ms]"] * delayed,
            last=["sign"],
            rows=rows,
            notes=[f"finding: {finding.line}" for finding in self.audit] + [f"note: {text}" for text in self.notes],
        )

    def _repr_html_(self) -> str:
        """Format the table for notebooks."""
        return self.table().html()

    def to_json(self) -> str:
        """Return the inspection as JSON text."""
        plain = asdict(replace(self, evidence=None))
        del plain["evidence"]
        return json.dumps(plain, indent=2, allow_nan=False) + "\n"


def inspect_log(log: LogLike, robot: Robot | str | Path, settings: Settings | None = None) -> Inspection:
    """Inspect a log: channels, sampling, support phases, ranges, delays and signs of the torques.

    Parameters
    ----------
    log
        Log of T samples, its path, or a frame (see `RobotLog.from_frame`).
    robot
        Robot, or the path of its robot file.
    settings
        Settings; default: the robot file's `[identify]`.

    Raises
    ------
    LogError, SettingsError
        If the log cannot be used at all.
    RobotFileError
        If a robot file is given and cannot be used.

    Examples
    --------
    >>> found = inspect_log("log.npz", "robot.toml")
    >>> found.rate, found.joints["elbow"].sign
    (1000.0, 'agrees')
    """
    robot = robot if isinstance(robot, Robot) else Robot.from_file(robot)
    with one_blas_thread(), findings_kept(robot.warnings), errors_about(log_path(log)):
        settings = settings or robot.settings
        (prepared,), of_currents, _, robot = find_torques([prepare(log, robot, settings)], robot, settings)
        return _inspect(prepared, robot, settings, of_currents)


def _inspect(prepared: PreparedLog, robot: Robot, settings: Settings, of_currents: list[Finding]) -> Inspection:
    log, sampling = prepared.log, prepared.sampling
    with_its_filter, choices = with_filter(prepared, robot, settings)
    evidence = gather(prepared, robot, settings)
    lags = delays(evidence)
    problems = [*findings(evidence, lags, settings), *of_currents, *model_findings(robot)]
    opposite = {joint for finding in problems if finding.check == "torque-sign" for joint in finding.joints}
    joints = {
        name: _inspect_joint(evidence, k, lags.get(name), name in opposite) for k, name in enumerate(evidence.joints)
    }
    return Inspection(
        robot=robot.name,
        path=log.path,
        samples=len(log.time),
        duration=float(log.time[-1] - log.time[0]),
        rate=float(sampling.rate),
        jitter=round(float(sampling.jitter), 9),  # below 1 ns is rounding
        duplicates=int(sampling.duplicates),
        gaps=[(float(a), float(b)) for a, b in sampling.gaps],
        missing=dict(sampling.missing),
        channels={name: list(array.shape) for name, array in log.channels().items()},
        support_source=prepared.support.source,
        phases=[
            (float(log.time[p.start]), float(log.time[p.stop - 1]), support_name(p), p.last > p.first)
            for p in prepared.support.phases
        ],
        filter=make_filter(with_its_filter.filter, sampling.period).name,
        joints=joints,
        findings=[str(finding) for finding in problems],
        notes=[*prepared.notes, *choices],
        audit=problems,
        torque_source=log.torque_source,
        evidence=evidence,
    )


def _inspect_joint(evidence: AuditData, k: int, lag: Lag | None, opposite: bool) -> JointInspection:
    log, column = evidence.prepared.log, evidence.robot.torque_controlled[k]
    gain = log.unscaled.get(evidence.joints[k])
    known = np.isfinite(evidence.model[:, k])
    torque, model = evidence.torque[known, k], evidence.model[known, k]
    correlation = None
    if len(torque) > 1 and torque.std() > 0 and model.std() > 0:
        correlation = float(np.corrcoef(torque, model)[0, 1])
    return JointInspection(
        position_range=_span(log.position[:, column]),
        velocity_range=_span(np.stack(evidence.velocity_range)[:, k]),
        torque_range=_span(log.torque[:, column] / (gain or 1.0)),
        correlation=correlation,
        delay=lag.delay if lag else None,
        torque_unit=log.channel_unit(evidence.robot.prismatic[column]) if gain else None,
        prismatic=evidence.robot.prismatic[column],
        sign="opposite" if opposite else "agrees" if correlation is not None and correlation > 0.3 else "unclear",
    )


def _span(values: Array) -> tuple[float, float]:
    return float(values.min()), float(values.max())
