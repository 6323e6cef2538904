"""Problems found in a log, a robot file or a fit, and settings that fix them; the messages are in `findings.toml`."""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from importlib.resources import files
from pathlib import PurePath
from typing import Any, Self

from stribeck.core.base.spans import Span, exclude_options, longest
from stribeck.core.base.toml import in_toml

FRICTION = "friction-"
"""Prefix of the checks whose findings concern the friction itself."""


@dataclass(frozen=True)
class Setting:
    """Setting of a robot file: table, e.g. "log.torque", key, and value; None if only the user knows the value."""

    table: str
    key: str
    value: Any = None

    def __str__(self) -> str:
        value = "" if self.value is None else f" = {in_toml(self.value)}"
        return f"{self.key}{value} in [{self.table}]"


def rounded(value: float, digits: int) -> float:
    """Round a value of a setting to some digits."""
    return float(f"{value:.{digits}g}")


@dataclass(frozen=True, kw_only=True)
class Finding:
    """Problem that a user should act on.

    Attributes
    ----------
    check
        Name of the check: the anchor of its paragraph in docs/findings.md.
    text
        Problem, place and evidence.
    cure
        Remedy without the spans to exclude; empty if no remedy is known.
    settings
        Settings of the robot file that `stribeck init` writes; empty if the user must decide.
    exclude
        Spans to exclude.
    joints
        Affected joints; empty if the finding concerns the whole log or robot.
    channel
        Wrong channel of the log, e.g. "torque"; empty unless it is a single one.
    logs
        Paths of the affected logs, if there are several.
    stops
        Whether all results would be invalid: `identify` ends, unless `force` is set.
    doubt
        Reason why identified joints are weak until the fault is fixed; empty if they stay identified.
    note
        Whether the finding moves no friction out of its interval: it belongs to the details.
    gains
        Wrong gains of torques by joint [1].
    """

    check: str
    text: str
    cure: str = ""
    settings: tuple[Setting, ...] = ()
    exclude: tuple[Span, ...] = ()
    joints: tuple[str, ...] = ()
    channel: str = ""
    logs: tuple[str, ...] = ()
    stops: bool = False
    doubt: str = ""
    note: bool = False
    gains: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        kind: str,
        joints: Sequence[str] | Mapping[str, str] = (),
        *,
        channel: str = "",
        stops: bool | None = None,
        settings: Sequence[Setting] = (),
        exclude: Sequence[Span] = (),
        gains: Mapping[str, float] = {},
        **values: object,
    ) -> Self:
        """Make a finding from its entry in the catalogue.

        Parameters
        ----------
        kind
            Name of the check, or "check.variant".
        joints
            Affected joints, each with its evidence if a mapping is given; `{joints}` in the template lists them.
        channel, stops
            Override the catalogue's; `stops` is required where the catalogue states a condition.
        settings
            Settings that fix the problem; `{settings}` in the template lists them.
        exclude
            Spans to exclude; only the longest are kept.
        gains
            Wrong gains of torques by joint [1].
        values
            Values for the fields of the template.
        """
        entry = next(entries[kind] for entries in catalogue().values() if kind in entries)
        channel = channel or entry.get("channel", "")
        shown = [f"{name}{note}" for name, note in joints.items()] if isinstance(joints, Mapping) else joints
        fields = {"joints": listed(shown), "channel": channel, "settings": " and ".join(map(str, settings)), **values}
        text, cure = message(entry, fields)
        return cls(
            check=kind.split(".")[0],
            text=text,
            cure=cure,
            settings=tuple(settings) if entry.get("init") else (),
            exclude=tuple(longest(exclude)),
            joints=tuple(dict.fromkeys(joints)),
            channel=channel,
            stops=entry.get("stops") is True if stops is None else stops,
            doubt=entry.get("doubt", ""),
            note=entry.get("note", False),
            gains=gains,
        )

    @property
    def remedy(self) -> str:
        """Remedy with the options that exclude spans."""
        return f"{self.cure}: {exclude_options(self.exclude)}" if self.exclude else self.cure

    def __str__(self) -> str:
        """Join text and remedy in one line."""
        return f"{self.text}. {self.remedy}" if self.cure else self.text

    def has(self, mark: str) -> bool:
        """Return whether the catalogue marks the check, e.g. as "symptom"."""
        return any(entries.get(self.check, {}).get(mark, False) for entries in catalogue().values())

    @property
    def on_friction(self) -> bool:
        """Whether the finding is a misfit of the friction law."""
        return self.check.startswith(FRICTION)

    @property
    def place(self) -> str:
        """Command that explains the check."""
        return f"stribeck explain {self.check}"

    @property
    def line(self) -> str:
        """Text and remedy with the command that explains them."""
        return f"{self} ({self.place})"


@cache
def catalogue() -> dict[str, dict[str, dict[str, Any]]]:
    """Load the entries of findings.toml by section, then by check; a variant's name is "check.variant"."""
    document = tomllib.loads((files("stribeck.core.base") / "findings.toml").read_text(encoding="utf-8"))
    sections: dict[str, dict[str, dict[str, Any]]] = {}
    for section, checks in document.items():
        entries = sections[section] = {}
        for check, entry in checks.items():
            nested = [name for name, value in entry.items() if name != "example" and type(value) is dict]
            variants = {name: entry.pop(name) for name in nested}
            entries[check] = entry
            common = {key: entry[key] for key in ("channel", "stops", "text", "remedy") if key in entry}
            entries |= {f"{check}.{name}": common | variant for name, variant in variants.items()}
    return sections


def message(entry: Mapping[str, Any], values: Mapping[str, object]) -> tuple[str, str]:
    """Fill values into the text and the remedy of a catalogue entry; an example may exclude spans."""
    remedy = entry.get("remedy", "").format_map(values) + (f": {values['exclude']}" if "exclude" in values else "")
    return entry["text"].format_map(values), remedy


def listed(names: Sequence[str]) -> str:
    """List distinct names, only the first six of a longer list."""
    names = list(dict.fromkeys(names))
    return ", ".join(names[:6]) + (f" and {len(names) - 6} more" if len(names) > 6 else "")


def merged(by_log: Sequence[tuple[str, Sequence[Finding]]]) -> list[Finding]:
    """Merge the findings of several logs, given with their paths: one per check, channel and joints.

    If the evidence differs, the first log's is kept; spans to exclude are those of all logs. Findings of a single log
    stay unchanged.
    """
    if len(by_log) == 1:
        return list(by_log[0][1])
    groups: dict[tuple[object, ...], list[tuple[str, Finding]]] = {}
    for path, findings in by_log:
        for report in findings:
            report = replace(report, exclude=tuple(span._replace(log=PurePath(path).name) for span in report.exclude))
            groups.setdefault((report.check, report.channel, report.joints, report.stops), []).append((path, report))
    union = []
    for group in groups.values():
        first = group[0][1]
        logs = tuple(dict.fromkeys(path for path, _ in group))
        if all(report.text == first.text for _, report in group):
            text = f"{listed(logs)}: {first.text}"
        else:
            text = f"{logs[0]}: {first.text}" + (f" (also in {listed(logs[1:])})" if logs[1:] else "")
        spans = tuple(span for _, report in group for span in report.exclude)
        union.append(replace(first, text=text, logs=logs, exclude=spans))
    return union
