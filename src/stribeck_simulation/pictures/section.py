"""The simulated walk: where the feet stood and the centre of mass went, and the robot over one stride."""

from markupsafe import Markup

from stribeck.report.figure import house_style, inline_svg
from stribeck.report.page import Section, render
from stribeck.result.mirror import mirrored_pairs
from stribeck_simulation.pictures.walk import WalkPicture
from stribeck_simulation.pictures.walk_figures import Window, from_above, strip

LONG = 4.0
"""A walk that reaches further than this is drawn a second time, closer [m]."""
CLOSE_UP = 2.4
"""Length and width of the close-up [m]."""


def walk_section(picture: WalkPicture) -> Section:
    """Return the report's section with the walk from above and its strip of poses."""
    colours = side_colours([*picture.segment_names, *(print_.foot for print_ in picture.footprints)])
    with house_style():
        figures = _figures(picture, colours)
    sides = [("data", "left"), ("right", "right")] if {"data", "right"} <= set(colours.values()) else []
    body = render("figure_row.html.j2", figures=figures, legend=[*sides, ("path", "centre of mass")])
    return Section(anchor="walk", title="Walk", body=body)


def _figures(picture: WalkPicture, colours: dict[str, str]) -> list[tuple[Markup, str]]:
    """Return the drawings with their captions."""
    whole = _window(picture)
    stride = (picture.poses[0].time, picture.poses[-1].time)
    figures: list[tuple[Markup, str]] = []
    if max(whole[1] - whole[0], whole[3] - whole[2]) > LONG:
        all_the_time = (float(picture.com_time[0]), float(picture.com_time[-1]))
        drawing = inline_svg(from_above(picture, colours, whole, all_the_time), "The whole walk from above", "w0")
        figures.append((drawing, "The whole walk from above; fainter: earlier"))
        whole = _close_up(picture, whole)
    drawing = inline_svg(from_above(picture, colours, whole, stride), "Footprints and centre of mass", "w1")
    figures.append((drawing, "From above; strong: while the poses last; fainter: earlier"))
    span = f"{stride[0]:.2f} to {stride[1]:.2f} s"
    figures.append((inline_svg(strip(picture, colours), f"The robot at {span}", "w2"), f"The robot from {span}"))
    return figures


def side_colours(names: list[str]) -> dict[str, str]:
    """Return the page's colour of each joint or foot: `data` on the left, `right` on the right, `ink` in the middle."""
    colours = dict.fromkeys(names, "ink")
    for left, right in mirrored_pairs(dict.fromkeys(names)):
        colours[left], colours[right] = "data", "right"
    return colours


def _window(picture: WalkPicture) -> Window:
    """Return the least and greatest x and y of all that is drawn from above [m]."""
    x, y = list(picture.com[:, 0]), list(picture.com[:, 1])
    for print_ in picture.footprints:
        reach = max(*print_.size, 0.02) / 2
        x += [print_.place[0] - reach, print_.place[0] + reach]
        y += [print_.place[1] - reach, print_.place[1] + reach]
    return min(x), max(x), min(y), max(y)


def _close_up(picture: WalkPicture, whole: Window) -> Window:
    """Return a square about the middle of the poses [m], no larger than what there is to see."""
    x, y = picture.poses[len(picture.poses) // 2].place
    reach = CLOSE_UP / 2
    return max(x - reach, whole[0]), min(x + reach, whole[1]), max(y - reach, whole[2]), min(y + reach, whole[3])
