"""Which terms each joint's friction has, and why not the others: of the law that is chosen joint by joint."""

from __future__ import annotations

from stribeck.report.page import Section, render
from stribeck.result import Result, TermVerdict


def terms(result: Result) -> Section | None:
    """Return the section with a row a joint and a column a term, or None where a law was given."""
    chosen = {name: joint.terms for name, joint in result.joints.items() if joint.terms}
    if not chosen:
        return None
    names = list(dict.fromkeys(term for own in chosen.values() for term in own))
    common = {term: reason for term in names if (reason := _shared_reason([own[term] for own in chosen.values()]))}
    shown = [term for term in names if term not in common]
    rows = [
        {
            "name": name,
            "anchor": f"joint-{list(result.joints).index(name)}",
            "cells": [(own[term], _note(own[term])) for term in shown],
        }
        for name, own in chosen.items()
    ]
    body = render("terms.html.j2", columns=shown, rows=rows, common=common)
    return Section(anchor="terms", title="Terms of the law", body=body)


def _shared_reason(verdicts: list[TermVerdict]) -> str:
    """Return why a term was not tried in any joint, "" if it was, or if reasons differ."""
    reasons = {verdict.reason for verdict in verdicts}
    return reasons.pop() if len(reasons) == 1 and all(verdict.gain is None for verdict in verdicts) else ""


def _note(verdict: TermVerdict) -> str:
    """Return what the reason says beside the gain."""
    return verdict.reason if verdict.gain is None else verdict.reason.partition(", ")[2]
