"""Draw the steps of the default method, the contact modes, and the rooms of the code: python docs/diagrams.py."""

from collections.abc import Sequence
from pathlib import Path

THEMES = {"light": ("#1f2328", "#d8dee4", "#1868b7"), "dark": ("#e6edf3", "#3a424c", "#6cb2f7")}
"""Colors of text, lines and accents, by theme."""
STEPS = (
    ("Log", "positions, torques"),
    ("Weak form", "windows of 41 ms"),
    ("Pilot", "delay, noise, outliers"),
    ("Sums", "one pass of the log"),
    ("Fit", "friction and model"),
    ("Terms", "held-out parts"),
    ("Intervals", "and verdicts"),
)
"""Steps of the default method, with a detail each."""
MODES = {
    "one sole": ((0,), "all joints"),
    "two soles": ((0, 1), "arms and trunk"),
    "flight": ((), "all joints"),
    "point feet": ((0, 1), "all joints"),
}
"""Contact modes: standing feet, and the joints whose equations are used."""
HOUSE = (
    {"core": "arrays and a model in, a result out"},
    {"io": "readers, writers", "paper": "methods, laws, filters"},
    {"check": "audit, drives, init", "simulation": "known friction"},
    {"design": "plan, replay, rehearse", "service": "fleets, online"},
    {"app": "command line, reports, exports"},
)
"""Floors of the house from the ground up: rooms of `src/stribeck` in the order of their imports, with their content."""


def flow(ink: str, line: str, accent: str) -> tuple[str, int, int]:
    """Draw the steps as a chain of boxes in two rows."""
    parts = []
    for k, (name, detail) in enumerate(STEPS):
        x, y = 10 + 165 * (k % 4), 10 + 85 * (k // 4)
        parts.append(
            f'<rect x="{x}" y="{y}" width="140" height="55" rx="6" fill="none" stroke="{line}" stroke-width="2"/>'
        )
        parts.append(_text(x + 70, y + 24, name, ink, "bold") + _text(x + 70, y + 42, detail, ink))
        if k % 4 < 3 and k < len(STEPS) - 1:
            parts.append(_arrow([(x + 142, y + 27), (x + 161, y + 27)], accent))
    parts.append(_arrow([(575, 67), (575, 80), (80, 80), (80, 91)], accent))
    return "\n".join(parts), 655, 160


def contact_modes(ink: str, line: str, accent: str) -> tuple[str, int, int]:
    """Draw a robot in each contact mode; accents mark standing feet."""
    parts = []
    for k, (name, (standing, used)) in enumerate(MODES.items()):
        middle, lift = 85 + 165 * k, 14 if name == "flight" else 0
        parts.append(f'<path d="M{middle - 65} 140H{middle + 65}" stroke="{line}" stroke-width="2"/>')
        parts.append(f'<circle cx="{middle}" cy="{30 - lift}" r="9" fill="none" stroke="{ink}" stroke-width="2"/>')
        arms = f"M{middle - 25} 70L{middle} {50 - lift}L{middle + 25} 70"
        parts.append(f'<path d="M{middle} {40 - lift}V{85 - lift}{arms}" {_stroke(ink)}/>')
        for foot, side in enumerate((-1, 1)):
            down, color = foot in standing, accent if foot in standing else ink
            x, y = middle + side * (18 if down else 26), 136 if down else 122 - lift
            parts.append(
                f'<path d="M{middle} {85 - lift}L{middle + side * 20} {(85 - lift + y) // 2}L{x} {y}" {_stroke(ink)}/>'
            )
            if name == "point feet":
                parts.append(f'<circle cx="{x}" cy="{y}" r="4" fill="{color}"/>')
            else:
                parts.append(f'<path d="M{x - 6} {y}H{x + 14}" stroke="{color}" stroke-width="5"/>')
        parts.append(_text(middle, 160, name, ink, "bold") + _text(middle, 176, used, ink))
    return "\n".join(parts), 665, 185


def house(ink: str, line: str, accent: str) -> tuple[str, int, int]:
    """Draw the floors of the house, one box per room, below a roof."""
    roof = f'<path d="M5 62L350 8L695 62" {_stroke(accent)}/>'
    parts = [roof + _text(350, 48, "src/stribeck", ink)]
    for k, floor in enumerate(HOUSE):
        y, width = 70 + 52 * (len(HOUSE) - 1 - k), 690 // len(floor)
        for place, (room, content) in enumerate(floor.items()):
            x = 5 + width * place
            parts.append(
                f'<rect x="{x + 2}" y="{y}" width="{width - 4}" height="44" rx="4" fill="none" stroke="{line}" '
                'stroke-width="2"/>'
            )
            middle = x + width // 2
            parts.append(_text(middle, y + 19, room, ink, "bold") + _text(middle, y + 36, content, ink))
    return "\n".join(parts), 700, 70 + 52 * len(HOUSE)


def _text(x: int, y: int, words: str, color: str, weight: str = "normal") -> str:
    return f'<text x="{x}" y="{y}" text-anchor="middle" fill="{color}" font-weight="{weight}">{words}</text>'


def _stroke(color: str) -> str:
    return f'fill="none" stroke="{color}" stroke-width="2"'


def _arrow(points: Sequence[tuple[int, int]], color: str) -> str:
    (x, y), (before, above) = points[-1], points[-2]
    across, up = (x > before) - (x < before), (y > above) - (y < above)
    back, left = x - 6 * across, y - 6 * up
    tip = f"M{back - 4 * up} {left - 4 * across}L{x} {y}L{back + 4 * up} {left + 4 * across}"
    way = "L".join(f"{px} {py}" for px, py in points)
    return f'<path d="M{way}{tip}" {_stroke(color)}/>'


if __name__ == "__main__":
    for draw in (flow, contact_modes, house):
        for theme, colors in THEMES.items():
            body, width, height = draw(*colors)
            head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif"'
            name = f"{draw.__name__.replace('_', '-')}-{theme}.svg"
            (Path(__file__).parent / "assets" / name).write_text(
                f'{head} font-size="12">\n{body}\n</svg>\n', encoding="utf-8"
            )
