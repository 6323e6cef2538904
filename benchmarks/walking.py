"""Compare the contact simulator's speed on one core with real time and with MuJoCo's share of the time.

    python -m benchmarks.walking

TORO walks with friction in all leg joints, `realistic` sensors and an estimated state, with physics steps of 0.25 ms.
The lower bound is the time in MuJoCo's steps, measured in the same run.
"""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco

from benchmarks.report import arguments, report
from stribeck.base.threads import one_blas_thread
from stribeck_simulation.run import run_scenario
from stribeck_simulation.scenario import read_scenario

SCENARIO = Path(__file__).parents[1] / "examples/scenarios/straight-and-sideways-realistic.toml"


class Stopwatch:
    """Wrapper of a function that adds up the time of its calls [s]."""

    def __init__(self, function: Callable[..., Any]):
        self.function, self.spent = function, 0.0

    def __call__(self, *values: Any) -> Any:
        """Call the function."""
        begin = time.perf_counter()
        found = self.function(*values)
        self.spent += time.perf_counter() - begin
        return found


def main() -> None:
    """Print the figures."""
    options = arguments(__doc__ or "", samples=20_000)
    scenario = read_scenario(SCENARIO)
    straight = scenario.walk[0]
    steps = max(2, round(options.samples * 1e-3 / (straight.single_support + straight.double_support)))
    short = scenario.model_copy(update={"walk": [straight.model_copy(update={"count": steps})]})
    physics = Stopwatch(mujoco.mj_step)
    mujoco.mj_step = physics
    try:
        with one_blas_thread():
            begin = time.process_time()
            log = run_scenario(short).log
            used = time.process_time() - begin
    finally:
        mujoco.mj_step = physics.function
    duration = float(log.time[-1] - log.time[0])
    report(
        {
            "simulated [s]": duration,
            "processor time [s]": used,
            "times faster than real time [1]": duration / used,
            "floor: MuJoCo's own steps [s]": physics.spent,
            "walk over the floor": used / physics.spent,
        },
        options.save,
        options.compare,
    )


if __name__ == "__main__":
    main()
