"""Test online estimation on simulated walks: unchanged robot, worn knee, cold robot, payload.

    python -m studies.online --save studies/online.json

A humanoid walks in the contact simulator; its friction is identified from the first walk. The second walk, with other
steps, is repeated with new noise of the sensors; their biases are those of the first walk. More friction is added to
the measured torques of the same motion, which a controller would hold; a payload is simulated. Hours are simulated by
windows (`studies.online_hours`).
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import chain, repeat

import numpy as np
from scipy.spatial.transform import Rotation

from stribeck import Result, RobotLog, identify, read_result
from stribeck.core.base.typing import Array
from stribeck.core.friction import Stribeck
from stribeck.service.online import Alarm, OnlineFriction
from stribeck.service.online.samples import estimator_for, feed, samples_of
from stribeck.simulation.robots import MODELS
from stribeck.simulation.run import POSTURES, Simulated
from stribeck.simulation.scenario import Scenario, read_scenario
from stribeck.simulation.sensors.measure import measure, sensors_for
from stribeck.simulation.sensors.profiles import REALISTIC
from studies.command import ROOT, Row, command, rounded
from studies.kept_walks import kept_walk
from studies.markdown import markdown_table
from studies.online_hours import Windows, record, simulate

SCENARIO = ROOT / "examples/scenarios/straight-and-sideways-realistic.toml"
KNEE = "left_knee"
START = 120.0
"""Time at which friction changes [s]."""
BACKPACK = '<body name="backpack" pos="-0.1 0 0.2"><inertial pos="0 0 0" mass="5" diaginertia="0.05 0.05 0.05"/></body>'
BIASES = ("position_bias", "torque_offset", "torque_drift", "orientation_bias", "gyroscope_bias", "accelerometer_bias")
NOISE = replace(REALISTIC, **dict.fromkeys(BIASES, 0.0))
"""Errors of sensors that are drawn anew in each repetition."""
HOURS = 100.0
"""Mean time between false alarms [h]."""


@dataclass(frozen=True, eq=False)
class Machine:
    """Identified robot: first and second simulated walk, and result of the first."""

    first: Simulated
    second: Simulated
    result: Result


def scenario(name: str = "second") -> Scenario:
    """Describe a walk: straight and sideways, or the held-out walk with other steps."""
    found = read_scenario(SCENARIO).model_copy(update={"sensors": "ideal"})
    if name == "first":
        return found
    walk = read_scenario(MODELS / "demo.toml").walk[:3]
    return found.model_copy(update={"seed": 7, "walk": [w.model_copy(update={"single_support": 0.8}) for w in walk]})


@cache
def machine() -> Machine:
    """Simulate both walks and identify the first one."""
    first, second = kept_walk("online-1", scenario("first")), kept_walk("online-2", scenario())
    path = ROOT / "build" / "online" / "result.json"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        identify(measured(first, 0), first.robot).save(path)
    return Machine(first, second, read_result(path))


@cache
def loaded() -> Simulated:
    """Simulate the second walk with a backpack of 5 kg, which the controller knows and the estimator does not."""
    folder = ROOT / "build" / "online"
    folder.mkdir(parents=True, exist_ok=True)
    place = '<body name="right_shoulder_1_link"'
    text = (MODELS / "toro.xml").read_text(encoding="utf-8").replace(place, BACKPACK + place)
    (folder / "loaded.xml").write_text(text, encoding="utf-8")
    robot = (MODELS / "toro.toml").read_text(encoding="utf-8").replace("toro.xml", "loaded.xml")
    (folder / "loaded.toml").write_text(robot, encoding="utf-8")
    posture = POSTURES["toro"]
    chosen = scenario().model_copy(update={"robot": "loaded.toml", "posture": posture})
    return kept_walk("online-loaded", chosen, folder)


def measured(walk: Simulated, seed: int, added: Array | float = 0.0) -> RobotLog:
    """Measure a walk with new noise and the biases of this robot's sensors; `added` torques shape (T, n) [N m]."""
    log = walk.log
    bias = np.random.default_rng(1)
    joints = len(log.joint_names)
    found = measure(replace(log, torque=log.torque + added), sensors_for(log, NOISE, seed))
    tilt = Rotation.from_rotvec(REALISTIC.orientation_bias * bias.standard_normal(3))
    return replace(
        found,
        position=found.position + REALISTIC.position_bias * bias.standard_normal(joints),
        torque=found.torque + REALISTIC.torque_offset * bias.standard_normal(joints),
        base_orientation=(Rotation.from_quat(np.asarray(found.base_orientation)) * tilt).as_quat(),
    )


Change = Callable[[Simulated, Array], Array]
"""Additional friction torque of a walk [N m], shape (T, n), at times of the stream [s], shape (T,)."""


def _parameter(walk: Simulated, parameter: str) -> Array:
    """List a friction parameter of all joints, shape (n,); zero for joints without friction."""
    return np.array([walk.truth.parameters.get(name, {}).get(parameter, 0.0) for name in walk.log.joint_names])


def knee(share: Callable[[Array], Array]) -> Change:
    """Increase the friction of one knee by a share that depends on time."""

    def added(walk: Simulated, time: Array) -> Array:
        column = np.array([name == KNEE for name in walk.log.joint_names])
        friction = walk.truth.friction_torque - _parameter(walk, "offset")
        return np.asarray(friction * column * share(time)[:, None])

    return added


def cold(walk: Simulated, time: Array) -> Array:
    """Increase all viscous friction by 40 %."""
    velocity = np.gradient(walk.log.position, walk.log.time, axis=0)
    return np.asarray(0.4 * _parameter(walk, "viscous") * velocity * (time >= START)[:, None])


def stream(walks: Iterable[Simulated], change: Change | None = None, seed: int = 0) -> Iterator[tuple[RobotLog, float]]:
    """Repeat walks with new noise, one second apart; yields segments and their rate [Hz]."""
    start = 0.0
    for number, walk in enumerate(walks):
        time = walk.log.time - walk.log.time[0] + start
        log = measured(walk, 10_000 * seed + number, change(walk, time) if change else 0.0)
        log = replace(log, time=log.time - walk.log.time[0] + start, start=start)
        yield from samples_of(log, machine().first.robot, machine().result)
        start = float(time[-1]) + 1.0


def watch(
    stream: Iterator[tuple[RobotLog, float]], until: float, enough: Callable[[list[Alarm]], bool] = lambda _: False
) -> tuple[OnlineFriction, list[Alarm]]:
    """Feed a stream until a time [s] or enough alarms; returns the estimator and all alarms."""
    online, alarms = None, list[Alarm]()
    for part, rate in stream:
        online = online or estimator_for(machine().result, machine().first.robot, rate, HOURS)
        for start in range(0, len(part.time), 1000):
            alarms += feed(online, part.take(slice(start, start + 1000)))
            if online.time >= until or enough(alarms):
                return online, alarms
    assert online is not None
    return online, alarms


def unchanged(seed: int) -> Row:
    """Compare friction after the second walk with the simulated and the identified friction."""
    walk, result = machine().second, machine().result
    online, alarms = watch(stream([walk], seed=seed), np.inf)
    law, inside, near, joints = Stribeck(), 0, 0, 0
    for k, (name, own) in enumerate(online.state().items()):
        if name not in walk.truth.parameters or result.joints[name].verdict != "identified":
            continue
        values = walk.truth.parameters[name] | {"offset": 0.0}
        speed = online.baseline.speed[k : k + 1]
        truth = float(law.torque(speed, np.array([values[each.name] for each in law.parameters]))[0])
        joints += 1
        inside += own.interval_95[0] <= truth <= own.interval_95[1]
        near += own.interval_next_log[0] <= own.friction <= own.interval_next_log[1]
    return {"joints": joints, "inside": inside, "near": near, "alarms": [alarm.name for alarm in alarms]}


@cache
def windows() -> Windows:
    """Record the windows of the second walk, measured six times."""
    fresh, online = (estimator_for(machine().result, machine().first.robot, 1000.0, HOURS) for _ in range(2))
    parts = list(stream(repeat(machine().second, 6)))
    return record(fresh, online, [partial(feed, online, part) for part, _ in parts])


def hours(seed: int) -> Row:
    """Count alarms of twenty robots in an hour each."""
    found = simulate(windows(), 20, 3600.0, np.zeros((20, 1)), seed)
    return {"alarms": [f"{alarm.time:.0f} s {alarm.line}" for own in found for alarm in own if alarm.raised]}


def smallest(seed: int) -> Row:
    """Find the smallest change of each joint that nine of ten robots show within 60 s as its only alarm, if any."""
    sizes, times = [0.05, 0.1, 0.15, 0.2, 0.3], 10
    names = windows().names
    changes = np.kron(np.eye(len(names)), np.repeat(sizes, times)[:, None])
    found = simulate(windows(), len(changes), 180.0, changes, seed)
    right = [{a.name for a in own if a.raised and a.time >= START} == {names[k // 50]} for k, own in enumerate(found)]
    share = np.reshape(right, (len(names), len(sizes), times)).mean(axis=2)
    least = [next((size for size, part in zip(sizes, own, strict=True) if part >= 0.9), None) for own in share]
    return {"smallest": dict(zip(names, least, strict=True)), "share": share.mean(axis=0).tolist()}


def changed(kind: str, seed: int) -> Row:
    """Watch until some time after an alarm; the change at its time is that of the knee's friction."""
    slow, start = kind == "drift", START

    def share(time: Array) -> Array:
        return np.asarray(np.clip((time - START) / 2400, 0.0, 0.5) if slow else 0.15 * (time >= START))

    walks: Iterable[Simulated] = repeat(machine().second)
    change = {"step": knee(share), "drift": knee(share), "cold": cold}.get(kind)
    if kind == "payload":
        length = float(np.ptp(machine().second.log.time)) + 1.0
        count = int(START / length)
        walks, start = chain(repeat(machine().second, count), repeat(loaded())), count * length
    _, alarms = watch(stream(walks, change, seed), START + (1200 if slow else 120), lambda a: slow and bool(a))
    raised = [alarm for alarm in alarms if alarm.raised]
    first = raised[0].time if raised else np.inf
    return {
        "alarms": [alarm.name for alarm in raised],
        "text": raised[0].line if raised else "",
        "delay": rounded(first - start),
        "change": rounded(float(share(np.array([first]))[0])),
    }


def run(case: str, seed: int) -> Row:
    """Run a case."""
    return RUNS[case](seed) if case in RUNS else changed(case, seed)


RUNS: dict[str, Callable[[int], Row]] = {"unchanged": unchanged, "20 hours": hours, "smallest": smallest}
SEEDS = {"unchanged": 5, "20 hours": 5, "smallest": 1, "step": 10, "drift": 1, "cold": 2, "payload": 2}
"""Number of runs by case."""
TITLES = {
    "step": "left knee +15 %",
    "drift": "left knee +50 % in 20 min",
    "cold": "viscous friction +40 %",
    "payload": "payload of 5 kg",
}


def tables(rows: list[Row]) -> list[str]:
    """Format the table of docs/watch.md."""
    own = {case: [row for row in rows if row["case"] == case] for case in SEEDS}
    joints, inside, near = (sum(row[name] for row in own["unchanged"]) for name in ("joints", "inside", "near"))
    alarms, rare = (sum(len(row["alarms"]) for row in own[case]) for case in ("unchanged", "20 hours"))
    cells = [
        ("true friction within the 95 % interval now", f"{inside} of {joints} joints"),
        ("friction now within the interval of the next log", f"{near} of {joints} joints, {alarms} alarms"),
        (f"unchanged for {20 * len(own['20 hours'])} h, simulated by windows", f"{rare} alarm{'s' * (rare != 1)}"),
    ]
    for row in own["smallest"]:
        sizes = Counter(f"{100 * size:.0f} %" if size else "more" for size in row["smallest"].values())
        joints_by_size = ", ".join(f"{size}: {count}" for size, count in sorted(sizes.items()))
        cells.append(("joints by the smallest change that is found within 60 s", joints_by_size))
    for case, title in TITLES.items():
        if some := own[case]:
            named = ", ".join(dict.fromkeys(name for row in some for name in row["alarms"] or ["none"]))
            delays = ", ".join(f"{row['delay']:.0f}" for row in some)
            size = f", at +{100 * max(row['change'] for row in some):.0f} %" * (case == "drift")
            cells.append((title, f"{named}; after {delays} s{size}"))
    return [markdown_table(("case", "result"), cells)]


if __name__ == "__main__":
    command(__doc__, [{"case": case, "seed": k} for case, runs in SEEDS.items() for k in range(runs)], run, tables)
