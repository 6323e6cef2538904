"""Friction put into a simulator: it follows its law, takes energy out, and its own state is right."""

from collections.abc import Callable

import numpy as np
import pytest
from tests.models import STRIBECK

from stribeck.core.friction import LAWS, Stribeck
from stribeck.simulation import friction as effects
from stribeck.simulation.friction import FrictionTruth, Instant, LawFriction, LuGre

LUGRE = {"bristle_stiffness": 1000.0, "bristle_damping": 2.0, "viscous": 0.2, "coulomb": 1.0, "offset": 0.0}
LUGRE |= {"stribeck_gain": 0.3, "stribeck_velocity": 0.1}
WAYS = {"viscous_positive": 0.2, "viscous_negative": 0.4, "coulomb_positive": 1.0, "coulomb_negative": 0.7}
STEP = 0.00025


def swing(
    effect: effects.FrictionEffect,
    torque: Callable[[float], float],
    duration: float,
    inertia: float = 0.01,
    step: float = STEP,
) -> dict[str, np.ndarray]:
    """Simulate one joint without gravity: time, position, velocity and friction torque at the end of each step."""
    truth = FrictionTruth(1, [effect])
    q, v = np.zeros((2, 1))
    rows = []
    for k in range(round(duration / step)):
        tau = np.array([torque(k * step)])
        damping, offset = truth.before(Instant(time=k * step, step=step, position=q, velocity=v, torque=tau))
        v = (inertia * v + step * (tau - offset)) / (inertia + step * damping)
        q = q + step * v
        rows.append([(k + 1) * step, q[0], v[0], truth.after(v)[0], tau[0]])
    return dict(zip(("time", "position", "velocity", "friction", "torque"), np.array(rows).T, strict=True))


@pytest.mark.parametrize("name", LAWS)
def test_every_law_is_followed_and_takes_energy_out(name):
    law, known = LAWS[name](), {**STRIBECK, **WAYS, "exponent": 2.0}
    named = {parameter.name: known[parameter.name] for parameter in law.parameters}
    values = np.array(list(named.values()))
    run = swing(LawFriction(["a"], law, {"a": named}), lambda t: 3.0 * np.sin(6.0 * t), 3.0)
    still = law.torque(np.zeros(1), values)
    assert np.all(run["velocity"] * (run["friction"] - still) >= 0)
    moving = np.abs(run["velocity"]) > 0.3
    assert moving.mean() > 0.3
    np.testing.assert_allclose(run["friction"][moving], law.torque(run["velocity"][moving], values), rtol=0.1)
    assert np.abs((run["friction"] - law.torque(run["velocity"], values))[moving]).mean() < 0.02


def test_warm_joints_have_the_warm_parameters():
    drift = effects.Drift({"viscous": 0.5}, time_constant=10.0)
    friction = LawFriction(["a"], Stribeck(), {"a": STRIBECK}, drift)
    cold, later, warm = (friction.values(time)[:, 0] for time in (0.0, 10.0, 1e3))
    names = [parameter.name for parameter in Stribeck.parameters]
    assert dict(zip(names, cold, strict=True)) == STRIBECK
    np.testing.assert_allclose(warm / cold, [0.5, 1, 1, 1, 1, 1])
    assert later[0] == pytest.approx(0.2 * (1 - 0.5 * (1 - np.exp(-1))))


def test_lugre_gives_way_before_it_breaks_away():
    """Slowly loaded below breakaway g, q = -g / s0 ln(1 - tau / g), of which g / s0 ln(1 + tau / g) springs back."""
    held = swing(LuGre(["a"], {"a": LUGRE}), lambda t: 0.8 * min(t / 0.5, max(3 - 2 * t, 0.0), 1.0), 2.0)
    loaded = held["time"] < 1.0
    bent, back = -1.3e-3 * np.log(1 - 0.8 / 1.3), 1.3e-3 * np.log(1 + 0.8 / 1.3)
    assert held["position"][loaded][-1] == pytest.approx(bent, rel=0.02)
    assert held["position"][-1] == pytest.approx(bent - back, rel=0.05)
    assert swing(LuGre(["a"], {"a": LUGRE}), lambda _: 1.4, 0.5)["position"][-1] > 0.1


def test_backlash_lets_nothing_through_until_the_play_is_used_up():
    """Reversing 1 N m against d = 0.5 N m s/rad crosses a play of 2 mrad in 1 ms; then all but the bar's damping."""
    play = {"play": 0.002, "stiffness": 5e3, "damping": 0.5}
    run = swing(effects.Backlash(["a"], {"a": play}), lambda t: 1.0 if t < 0.1 else -1.0, 0.2, inertia=10.0)
    lost = np.abs(run["friction"] - run["torque"]) < 1e-12
    crossing = run["time"][lost]
    first, second = crossing[crossing < 0.05], crossing[crossing > 0.05]
    assert len(first) * STEP == pytest.approx(0.0005, abs=2 * STEP)  # from the middle
    assert len(second) * STEP == pytest.approx(0.001, abs=2 * STEP)
    closed = (run["time"] > 0.05) & (run["time"] < 0.09)
    np.testing.assert_allclose(run["friction"][closed], 0.5 * run["velocity"][closed], atol=0.02)


def test_load_takes_a_share_of_the_torque_and_only_energy_out():
    """Half a period pulls along the motion and half against it: the loss is the same share of both."""
    effect = effects.Load(["a"], {"a": {"load_share": 0.1, "load_slope": 40.0}})
    run = swing(effect, lambda t: 3.0 * np.cos(6.0 * t), 3.0, inertia=0.1)
    assert np.all(run["velocity"] * run["friction"] >= 0)
    moving = np.abs(run["velocity"]) > 0.5
    assert moving.mean() > 0.8
    sign = np.sign(run["velocity"])
    np.testing.assert_allclose(run["friction"][moving], (0.1 * np.abs(run["torque"]) * sign)[moving], rtol=0.02)
    run = swing(effects.Load(["a"], {"a": {"load_share": 0.5, "load_slope": 1e4}}), lambda _: 2.0, 1.0)
    assert run["velocity"][-1] == pytest.approx(1.0 * (2.0 - 1.0) / 0.01, rel=0.01)  # half of it is lost
