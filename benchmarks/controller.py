"""Time the exported C header's friction of one joint, relative to one tanh and one exp of the C library.

python -m benchmarks.controller
"""

import json
import subprocess
import tempfile
from pathlib import Path

from benchmarks.report import arguments, report
from stribeck.exporters.joints import WrittenJoint
from stribeck.exporters.targets import Request
from stribeck.exporters.text_files import file_text
from stribeck.result import JointResult, LogSummary, ParameterEstimate, Result
from stribeck.robot import Robot
from stribeck_simulation.robots import MODELS

TERMS = {
    "viscous": 0.3,
    "coulomb": 1.2,
    "stribeck_gain": 0.4,
    "stribeck_velocity": 0.2,
    "offset": 0.1,
    "slope": 35.0,
    "load": 0.07,
    "coulomb_per_kelvin": -0.01,
}
PROGRAM = """
#include "friction.h"
#include <stdio.h>
#include <time.h>

static double seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec + 1e-9 * now.tv_nsec;
}

int main(void)
{
    const int count = COUNT;
    double begin, sums[3] = {0, 0, 0}, times[3];
    friction_settings settings = {0.8, 0.05, 0.02, 0.01, 0.02, 20.0};
    friction_state state = {0, 0};
    int k;
    begin = seconds();
    for (k = 0; k < count; ++k) sums[0] += tanh(1e-6 * k) * exp(-1e-6 * k);
    times[0] = seconds() - begin;
    begin = seconds();
    for (k = 0; k < count; ++k) sums[1] += friction_torque(0, 1e-6 * k - 1, 3.0, 1.0);
    times[1] = seconds() - begin;
    begin = seconds();
    for (k = 0; k < count; ++k)
        sums[2] += friction_compensation(0, 1e-6 * k - 1, 1e-6 * k - 0.9, 3.0, 1.0, 1e-3, &settings, &state);
    times[2] = seconds() - begin;
    fprintf(stderr, "%g\\n", sums[0] + sums[1] + sums[2]);
    printf("[%g, %g, %g]\\n", 1e9 * times[0] / count, 1e9 * times[1] / count, 1e9 * times[2] / count);
    return 0;
}
"""


def main() -> None:
    """Print the figures."""
    options = arguments(__doc__ or "", samples=5_000_000)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder)
        (path / "friction.h").write_text(file_text("c.h", _request()))
        (path / "main.c").write_text(PROGRAM.replace("COUNT", str(options.samples)))
        subprocess.run(["cc", "-std=gnu99", "-O2", "main.c", "-o", "main", "-lm"], cwd=path, check=True)
        said = subprocess.run([path / "main"], capture_output=True, check=True, text=True).stdout
    floor, friction, compensation = json.loads(said)
    figures = {
        "floor: one tanh and one exp [ns]": floor,
        "friction_torque [ns]": friction,
        "friction_torque over the floor": friction / floor,
        "friction_compensation [ns]": compensation,
    }
    report(figures, options.save, options.compare)


def _request() -> Request:
    parameters = {
        name: ParameterEstimate(
            value=value, standard_error=0.01, interval_95=(value, value), unit="1", verdict="identified"
        )
        for name, value in TERMS.items()
    }
    joint = JointResult(
        parameters=parameters, verdict="identified", reason="", samples=9, velocity_range=(-1.0, 1.0), reversals=9
    )
    result = Result(
        robot="arm",
        log=LogSummary(path="log.npz", sha256="", duration=1.0, rate=1e3, samples_used=9),
        law="auto",
        method="whole-log",
        joints={"elbow": joint},
        stribeck="0",
    )
    robot = Robot.from_file(MODELS / "arm.toml")
    own = {"elbow": WrittenJoint(stated={})}
    return Request(result=result, robot=robot, joints=own, forms={"elbow": "all"}, links={}, lines=[], folder=Path())


if __name__ == "__main__":
    main()
