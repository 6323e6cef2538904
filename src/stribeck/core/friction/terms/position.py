"""Coulomb friction that changes over a turn, if gears, seals or bearings do not run true."""

import numpy as np

from stribeck.core.friction.terms.term import Seen, Term, linear


def _refuse(seen: Seen) -> str:
    said = "it is prismatic" if np.isnan(seen.turned) else f"+- {seen.turned:.2g} rad"
    return "" if seen.turned >= 0.1 else f"its position hardly turns: {said}"  # [rad]


COULOMB_POSITION = Term(
    name="coulomb_position",
    parameters=(linear("coulomb_cosine", "Fc_c", "N m"), linear("coulomb_sine", "Fc_s", "N m")),
    columns=("(cos(near) - mean_cosine) * rise", "(sin(near) - mean_sine) * rise"),
    over="position",
    refuse=_refuse,
)
