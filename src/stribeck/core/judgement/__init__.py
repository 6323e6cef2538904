"""Judgement of fits: excitation, friction curve, weak parameters, verdicts, torque error."""
