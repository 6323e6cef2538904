"""Rollouts fitted by CMA-ES, as PACE fits them: armature, damping, friction, encoder offsets and one delay.

    python benchmarks/contest/contestants/with_cma_es.py CASE OUT

Requires cma and mujoco[sysid]. A rollout of the log's first seconds follows its position commands with the drive gains
in the robot file. The sum of squared position errors is minimized.
"""

import time
from importlib.metadata import version
from pathlib import Path
from typing import Any

import cma
import mujoco
import numpy as np
from mujoco import rollout

from benchmarks.contest.contestants.command import main, names_of, read_case
from benchmarks.contest.contestants.with_mujoco_sysid import load_spec

SECONDS = 10.0
"""Duration of the used part of the log [s]."""
STEP = 0.0025
"""Time step of the rollouts [s]."""
FINE = 10
"""Number of parts per step, over which the commands of a drive are averaged."""
BOUNDS = {"armature": (0.0, 0.1), "damping": (0.0, 2.0), "frictionloss": (0.0, 1.0), "bias": (-0.1, 0.1)}
"""Bounds per joint [kg m²], [N m s/rad], [N m], [rad]."""
BEGIN = 0.1, 0.25, 0.1, 0.5
"""Start of the search, relative to the bounds [1]."""
DELAY = 0.1
"""Largest delay [s]; the search starts at a tenth."""
SPREAD = 0.2
"""Initial standard deviation, relative to the bounds [1]."""
BUDGET = 120.0
"""Processor time after which the best candidate is taken [s]."""


class Rollouts:
    """Position errors of a model that follows the commands of a log."""

    def __init__(self, model: Any, log: Any) -> None:
        """Select the part of the log."""
        self.model, self.data = model, mujoco.MjData(model)
        self.period = float(np.median(np.diff(log["time"])))
        rows = round(SECONDS / self.period)
        self.position, self.command = log["position"][:rows], log["desired_position"][:rows]
        # the base is fixed, so velocities and positions have the same columns
        self.columns = [model.joint(str(name)).dofadr[0] for name in log["joint_names"]]
        self.low, self.high = np.repeat(np.array(list(BOUNDS.values())), len(self.columns), axis=0).T

    def values(self, place: Any) -> tuple[Any, float]:
        """Scale a point of the unit cube to parameters, shape (4, n), and the delay [s]."""
        return (self.low + place[:-1] * (self.high - self.low)).reshape(len(BOUNDS), -1), float(place[-1] * DELAY)

    def error(self, place: Any) -> float:
        """Compute the mean squared position error [rad²]."""
        (armature, damping, friction, bias), delay = self.values(place)
        self.model.dof_armature[self.columns], self.model.dof_frictionloss[self.columns] = armature, friction
        self.model.dof_damping[self.columns] = damping.reshape(self.model.dof_damping[self.columns].shape)
        start = np.zeros(mujoco.mj_stateSize(self.model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
        start[1 + np.array(self.columns)] = self.position[0] - bias  # the state starts with the time; velocities are 0
        steps = round((len(self.command) - 1) * self.period / STEP)
        row = np.floor((np.arange(steps * FINE) / FINE * STEP - delay) / self.period + 1e-6).astype(int)
        control = self.command[np.clip(row, 0, None)].reshape(steps, FINE, -1).mean(axis=1)
        states, _ = rollout.rollout(self.model, [self.data], start[None], control[None])
        states = np.vstack([start, states[0]])[:: round(self.period / STEP)]
        return float(np.mean((states[:, 1 + np.array(self.columns)] + bias - self.position) ** 2))


def answer(folder: Path, _: Path) -> dict[str, Any]:
    said: dict[str, Any] = {"method": "CMA-ES", "version": version("cma"), "needs": ["fixed base"]}
    case, robot_file, (log, *_) = read_case(folder)
    table, joints = robot_file["robot"], names_of(log)
    if "kp" not in table:
        return said | {"blank": "its rollouts follow position commands, and the log has none"}
    spec = load_spec(folder, table, joints, case["rate"])
    spec.option.timestep = STEP
    rollouts = Rollouts(spec.compile(), log)
    begin = np.append(np.repeat(BEGIN, len(joints)), 0.1)
    search = cma.CMAEvolutionStrategy(begin, SPREAD, {"bounds": [0, 1], "seed": 1, "verbose": -9})
    while not search.stop() and time.process_time() < BUDGET:
        places = search.ask()
        search.tell(places, [rollouts.error(place) for place in places])
    (_, damping, friction, _), delay = rollouts.values(search.result.xbest)
    print(f"{search.result.evaluations} rollouts, {search.stop() or 'out of time'}, delay {delay:.4f} s")
    said["joints"] = {
        joint: {"coulomb": {"value": float(friction[k])}, "viscous": {"value": float(damping[k])}}
        for k, joint in enumerate(joints)
    }
    return said


if __name__ == "__main__":
    main(answer)
