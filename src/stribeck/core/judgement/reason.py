"""Reasons of verdicts, as data; text is made where people read it."""

from typing import Any, NamedTuple


class Reason(NamedTuple):
    """Main clause, details with their own punctuation, and what to do."""

    main: str
    details: str = ""
    remedy: str = ""

    def __str__(self) -> str:
        return f"{self.main}{self.details}{f'; {self.remedy}' if self.remedy else ''}"

    @property
    def fields(self) -> dict[str, Any]:
        """Fields of a `JointResult` that state the reason."""
        return {"reason": str(self), "main_reason": self.main, "remedy": self.remedy or None}
