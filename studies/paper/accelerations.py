"""Fig. 7.3: the model's acceleration of the right knee against the measured one, in swing."""

from matplotlib.figure import Figure

from studies.paper.acceleration import AS_PAPER, UNFILTERED, calibrated, motions
from studies.paper.estimate import rms
from studies.paper.study import Numbers, Study
from studies.paper.walks import get_walk

WALKS = ("legs-contact", "harsh")
LOGS = {"legs-contact": "exact log", "harsh": "harsh log"}


def run(quick: bool) -> Study:
    walks = {name: calibrated(get_walk(name, quick)) for name in WALKS}
    smooth = {name: motions(walk, AS_PAPER)["knee"] for name, walk in walks.items()}
    raw = {name: motions(walk, UNFILTERED)["knee"] for name, walk in walks.items()}
    numbers = {
        name: {
            "model": rms(smooth[name].model),
            "measured": rms(smooth[name].measured),
            "unfiltered": rms(raw[name].measured),
        }
        for name in WALKS
    }

    def draw(figure: Figure) -> None:
        panels = figure.subplots(1, 2)
        for axes, name in zip(panels, WALKS, strict=True):
            last = smooth[name].last_swing()
            axes.plot(last.time, last.model, "C0", lw=0.8, label="by the model")
            if name == "legs-contact":
                unfiltered = raw[name].last_swing()
                axes.plot(unfiltered.time, unfiltered.measured, "C5", lw=0.8, label="measured, unfiltered")
            axes.plot(last.time, last.measured, "C1", label="measured, window 151")
            axes.set(xlabel="time [s]", title=LOGS[name])
        panels[0].set_ylabel("acceleration of the knee [rad/s²]")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)

    return Study(numbers, {"accelerations": draw})


def texts(numbers: Numbers) -> dict[str, str]:
    """Return the RMS accelerations of the knee."""
    return {
        f"{key}-{name}": f"{value:.0f} rad/s²"
        for name, row in (("exact", numbers["legs-contact"]), ("harsh", numbers["harsh"]))
        for key, value in row.items()
        if (name, key) != ("exact", "unfiltered")
    }
