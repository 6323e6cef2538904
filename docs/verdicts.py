"""Draw the four verdicts for docs/verdicts.md, each with samples, curve and 95 % band: python docs/verdicts.py."""

from pathlib import Path

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.friction import get_law

THEMES = {"light": ("#1f2328", "#d8dee4", "#1868b7"), "dark": ("#e6edf3", "#3a424c", "#6cb2f7")}
"""Theme -> colors of text and samples, axes, curve and band."""
PARAMETERS = {
    "viscous": 0.25,
    "coulomb": 0.8,
    "stribeck_gain": 0.4,
    "stribeck_velocity": 0.15,
    "offset": 0.0,
    "slope": 40.0,
}
CASES = {
    "identified": (2.0, 0.15, 1.0, 0.1),
    "weak": (2.0, 0.7, 1.0, 0.3),
    "no friction": (2.0, 0.4, 0.0, 0.1),
    "not excited": (0.04, 0.15, 1.0, 0.0),
}
"""Verdict -> top speed [rad/s], noise [N m], scale of the friction [1], half width of the band [N m] or 0 for none."""
COUNT, SPEED, TORQUE = 40, 2.0, 2.5
"""Samples per panel; limits of the axes [rad/s], [N m]."""
WIDTH, HEIGHT = 160, 130
"""Size of a panel [px]."""


def panel(verdict: str, colors: tuple[str, str, str]) -> str:
    """Draw one verdict as SVG elements around the origin of its axes."""
    (top, noise, scale, half), (ink, axis, accent) = CASES[verdict], colors
    law, draws = get_law("stribeck"), np.random.default_rng(1)
    values = np.array([PARAMETERS[each.name] for each in law.parameters])
    velocity, grid = (
        draws.uniform(-top, top, COUNT),
        np.sort([*np.linspace(-SPEED, SPEED, 40), *np.linspace(-0.1, 0.1, 10)]),
    )
    torque = scale * law.torque(velocity, values) + noise * draws.normal(size=COUNT)
    parts = [f'<path d="M-75 0H75M0 -60V60" stroke="{axis}"/>']
    parts += [f'<circle cx="{x}" cy="{y}" r="1.5" fill="{ink}" opacity=".5"/>' for x, y in _pixels(velocity, torque)]
    if half:
        curve, width = scale * law.torque(grid, values), half * (1.0 + np.abs(grid) / top)
        band = _points(np.append(grid, grid[::-1]), np.append(curve - width, (curve + width)[::-1]))
        parts.append(f'<polygon points="{band}" fill="{accent}" opacity=".25"/>')
        parts.append(f'<polyline points="{_points(grid, curve)}" fill="none" stroke="{accent}" stroke-width="1.5"/>')
    return "\n".join([*parts, f'<text y="-68" text-anchor="middle" fill="{ink}" font-weight="bold">{verdict}</text>'])


def _pixels(velocity: Array, torque: Array) -> list[tuple[float, float]]:
    across, up = 75 / SPEED * velocity, -60 / TORQUE * np.clip(torque, -TORQUE, TORQUE)
    return list(zip(across.round(1).tolist(), up.round(1).tolist(), strict=True))


def _points(velocity: Array, torque: Array) -> str:
    return " ".join(f"{x},{y}" for x, y in _pixels(velocity, torque))


def main() -> None:
    """Write the figure in each theme."""
    size = f"0 0 {len(CASES) * WIDTH} {HEIGHT + 20}"
    for theme, colors in THEMES.items():
        panels = [
            f'<g transform="translate({(k + 0.5) * WIDTH} {HEIGHT / 2 + 18})">\n{panel(verdict, colors)}\n</g>'
            for k, verdict in enumerate(CASES)
        ]
        head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{size}" font-family="sans-serif" font-size="16">'
        text = "\n".join([head, *panels, "</svg>\n"])
        (Path(__file__).parent / "assets" / f"verdicts-{theme}.svg").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
