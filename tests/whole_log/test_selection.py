"""Terms are kept if they pay where they were not fitted, from the simplest up, and every other one is told why."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.result import made

from stribeck.core.equations.constants import LEAST_GAIN
from stribeck.core.estimator.terms.selection import (
    Candidate,
    JointTerms,
    Kept,
    held_out_gain,
    select_stepwise,
    with_terms,
)
from stribeck.core.friction.terms import BASE, LADDER
from stribeck.core.result import TermVerdict

FOLDS = np.array([0.8, 1.1, 0.9, 1.2])
"""How much of a gain is found on each fold, its sum 4."""


def world(**gains: float):
    """Scores of a joint whose terms gain this much a fold, independently of each other; others cost a little."""

    def candidate(kept: Kept) -> Candidate:
        total = sum((gains.get(term, -0.3) * FOLDS for term in kept), np.zeros(4))
        return Candidate(1000.0 - total)

    return candidate


RIPPLE = TermVerdict(verdict="kept", reason="it pays")


def kept(verdicts: dict[str, TermVerdict]) -> set[str]:
    """The terms that were chosen, but for those that every joint has."""
    return {name for name, verdict in verdicts.items() if verdict.kept} - BASE


def test_terms_are_kept_if_they_reduce_the_held_out_error() -> None:
    verdicts = select_stepwise(world(viscous=200.0, load=50.0), {})
    assert list(verdicts) == [term.name for term in LADDER]
    assert kept(verdicts) == {"load"}
    assert verdicts["viscous"].verdict == "kept"
    assert verdicts["load"].reason == "held-out chi^2 falls by 200 ± 36"
    assert verdicts["asymmetry"].reason == "held-out chi^2 rises by 1.2 ± 0.2"
    assert verdicts["load"].gain == pytest.approx(200.0)


@pytest.mark.parametrize(("gain", "has_it"), [(-0.3, True), (-5.0, False), (50.0, True)])
def test_a_usual_term_is_kept_unless_the_log_contradicts_it(gain: float, has_it: bool) -> None:
    verdicts = select_stepwise(world(stribeck=gain), {}, BASE | {"stribeck"})
    assert kept(verdicts) == ({"stribeck"} if has_it else set())
    said = "most joints with friction have it, and held-out chi^2 rises by 1.2 ± 0.2 here"
    assert (verdicts["stribeck"].reason == said) == (gain == -0.3)
    assert kept(select_stepwise(world(stribeck=-0.3), {})) == set()


def test_a_gain_that_one_fold_makes_is_not_enough() -> None:
    def candidate(kept: Kept) -> Candidate:
        return Candidate(np.array([1000.0, 1000.0, 1000.0, 1000.0 - 100 * ("load" in kept)]))

    verdicts = select_stepwise(candidate, {})
    assert verdicts["load"].gain == pytest.approx(100.0)
    assert verdicts["load"].gain_error == pytest.approx(100.0)
    assert not kept(verdicts)


def test_the_rise_at_standstill_is_part_of_the_stribeck_effect() -> None:
    """And a Stribeck effect has to better a rise alone."""

    def candidate(kept: Kept) -> Candidate:
        gain = 100.0 * bool(kept & {"rounding", "stribeck"}) + 50.0 * ("stribeck" in kept)
        return Candidate(1000.0 - gain * FOLDS)

    verdicts = select_stepwise(candidate, {})
    assert kept(verdicts) == {"stribeck"}
    assert verdicts["stribeck"].gain == pytest.approx(4 * 50.0)
    assert verdicts["rounding"].reason == "the term stribeck has it"


def carried(verdicts):
    """The terms of a joint that carries 3 N m."""
    return JointTerms(
        verdicts=verdicts,
        mean_load=3.0,
        load_deviation=1.0,
        mean_direction=(0.1, 0.2),
        mean_temperature=None,
        settings={"ripple_per_turn": 4.0, "presliding_travel": 0.01},
    )


def test_a_term_that_pays_but_is_not_seen_whole_is_open_and_makes_what_it_would_change_weak() -> None:
    def candidate(kept: Kept) -> Candidate:
        return Candidate(
            1000.0 - 50.0 * ("stribeck" in kept) * FOLDS, ("open", "too slow") if "stribeck" in kept else None
        )

    verdicts = select_stepwise(candidate, {})
    assert verdicts["stribeck"].verdict == "open"
    assert verdicts["stribeck"].reason == "held-out chi^2 falls by 200 ± 36, but too slow"
    joint = made.joint({"coulomb": 1.0, "offset": 1.0}, reason="all is well")
    found = with_terms(joint, carried(verdicts | {"ripple": RIPPLE}))
    assert found.parameters["coulomb"].verdict == "weak"
    assert found.verdict == "identified"  # of the curve at the speeds of the log, which the term does not change
    assert found.parameters["offset"].verdict == "identified"
    assert "too slow" in found.reason
    assert found.ripple_per_turn == 4.0
    assert with_terms(joint, carried(select_stepwise(world(), {}))).verdict == "identified"


@pytest.mark.parametrize(("noise", "verdict"), [(0.0, "weak"), (0.9, "weak"), (1.1, "no friction")])
def test_unexplained_torque_is_weak_unless_other_sensors_are_as_noisy(noise: float, verdict: str) -> None:
    joint = made.joint(verdict="no friction", reason="no friction detected", residual_rms=2.0)
    assert with_terms(joint, carried(select_stepwise(world(), {})), noise).verdict == verdict


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=50)
def test_no_set_of_terms_that_was_tried_is_clearly_better_than_the_chosen(seed: int) -> None:
    tried: dict[Kept, Candidate] = {}

    def candidate(kept: Kept) -> Candidate:
        own = np.random.default_rng([seed, *(term.name in kept for term in LADDER)])
        scores = own.normal(1000.0, own.choice([3.0, 30.0]), 8) - 5.0 * own.exponential() * len(kept)
        return tried.setdefault(kept, Candidate(scores, ("open", "no") if own.random() < 0.3 and kept > BASE else None))

    verdicts = select_stepwise(candidate, {})
    chosen = tried[frozenset(name for name, verdict in verdicts.items() if verdict.kept)]
    assert chosen.objection is None
    for other in tried.values():
        gain, error = held_out_gain(chosen.scores, other.scores)
        assert other.objection or gain <= max(error, LEAST_GAIN)
