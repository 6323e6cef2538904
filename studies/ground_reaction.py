"""Compare friction from measured foot wrenches with the curve fit and the whole log.

    python -m studies.ground_reaction --save studies/ground_reaction.json

The TORO-like humanoid of the accuracy study walks straight on, to the left and to the right, 138 s in all, in MuJoCo;
the wrenches of its feet are logged. White noise is added. In the last case the wrench sensors also have random zeros
(standard deviation 10 N and 1 N m) and gains (3 %). All six parameters of the law are free. The table lists mean and
worst relative error of Coulomb friction, and mean errors of viscous friction and offset, over the 12 leg joints.
"""

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from stribeck import Settings, identify
from stribeck.log import RobotLog
from stribeck_simulation.sensors.measure import with_noise
from studies.accuracy import walks_of
from studies.accuracy_cases import LAW
from studies.command import Row, command, rounded
from studies.markdown import markdown_table


@dataclass(frozen=True)
class Case:
    """Standard deviations of sensor errors.

    White noise of encoders [rad], torques [N m], foot forces [N] and foot moments [N m]; zeros [N], [N m] and gains [1]
    of the wrench sensors.
    """

    encoder: float = 0.0
    torque: float = 0.0
    force: float = 0.0
    moment: float = 0.0
    zeros: tuple[float, float] = (0.0, 0.0)
    gain: float = 0.0


CASES = {
    "clean": Case(),
    "A": Case(2e-5, 0.1, 1.0, 0.1),
    "B": Case(1e-4, 0.3, 3.0, 0.3),
    "A, wrench sensors wrong": Case(2e-5, 0.1, 1.0, 0.1, (10.0, 1.0), 0.03),
}
METHODS = ("curve-fit", "ground-reaction", "whole-log")
HEAD = ("case", "method", "joints", "Coulomb %, mean / worst", "viscous", "offset")


def measured(log: RobotLog, case: Case, number: int) -> RobotLog:
    """Add the errors of a case to a walk; the zeros and gains of the feet are the same in all walks."""
    assert log.foot_wrench is not None
    if case == Case():
        return log
    noise, constant = np.random.default_rng([number, 1]), np.random.default_rng(0)
    feet = log.foot_wrench.shape[1]
    zeros = np.repeat(case.zeros, 3) * constant.standard_normal((feet, 6))
    gains = 1 + case.gain * constant.standard_normal((feet, 1))
    sizes = np.repeat([case.force, case.moment], 3)
    wrench = gains * log.foot_wrench + zeros + sizes * noise.standard_normal(log.foot_wrench.shape)
    return replace(with_noise(log, position=case.encoder, torque=case.torque, seed=number), foot_wrench=wrench)


def run(case: str, method: str) -> Row:
    """Compute the errors of a method on a case."""
    walks = walks_of("TORO-like", False)
    logs = [measured(walk.log, CASES[case], number) for number, walk in enumerate(walks)]
    result, truth = identify(logs, walks[0].robot, Settings(law=LAW, method=method)), walks[0].truth.parameters
    found = {joint: result.joints[joint].parameters for joint in truth if result.joints[joint].parameters}
    coulomb, viscous, offset = (
        np.array([abs(one[name].value - truth[joint][name]) for joint, one in found.items()])
        for name in ("coulomb", "viscous", "offset")
    )
    coulomb /= [truth[joint]["coulomb"] for joint in found]
    numbers = {"coulomb": coulomb.mean(), "coulomb_worst": coulomb.max(), "viscous": viscous.mean()}
    numbers["offset"] = offset.mean()
    return {"joints": len(found), **{name: rounded(value) for name, value in numbers.items()}}


def tables(rows: list[Row]) -> list[str]:
    """Format the table of docs/other-methods.md."""
    cells = [
        (
            *(row[key] for key in ("case", "method", "joints")),
            f"{100 * row['coulomb']:.2f} / {100 * row['coulomb_worst']:.1f}",
            *(f"{row['viscous']:.3f}", f"{row['offset']:.4f}"),
        )
        for row in rows
    ]
    return [markdown_table(HEAD, cells, 2)]


if __name__ == "__main__":
    command(__doc__, [{"case": case, "method": method} for case, method in product(CASES, METHODS)], run, tables)
