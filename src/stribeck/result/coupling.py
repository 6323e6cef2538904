"""What was found of one coupling."""

from dataclasses import dataclass

from stribeck.result.joint import JointResult


@dataclass(frozen=True, kw_only=True)
class CouplingResult(JointResult):
    """What the log says about friction R that acts on a sum of joint speeds.

    `joints` has the coefficients: with v_c = sum_j b_j v_j, it acts on joint j as b_j R(v_c).
    """

    joints: dict[str, float]
