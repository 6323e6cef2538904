"""Arguments and options that commands share."""

from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

FORMATS_READ = "Log: npz, h5, mat, csv, parquet, mcap or bag file, or a folder (rosbag2, LeRobot)."


def output(metavar: str, text: str) -> Any:
    """Build the option `--output`, `-o`."""
    return typer.Option("--output", "-o", metavar=metavar, help=text)


def _choice(metavar: str, text: str, names: tuple[str, ...], default: str = "") -> Any:
    """Build an option whose help and completion list its values; `default` applies without a robot file's entry."""
    text += f": {', '.join(names)}." + f"  [default: {default}, or as in the robot file]" * bool(default)
    return typer.Option(metavar=metavar, help=text, autocompletion=lambda: names)


Logs = Annotated[list[Path], typer.Argument(metavar="LOG", help=FORMATS_READ)]
LogFile = Annotated[Path, typer.Argument(metavar="LOG", help=FORMATS_READ)]
ResultFile = Annotated[Path, typer.Argument(metavar="RESULT", help="A result.json written by `stribeck identify`.")]
Page = Annotated[Path | None, output("FILE", "Also write the result as an HTML page.")]
RobotFile = Annotated[Path, typer.Option("--robot", "-r", metavar="FILE", help="Robot file (robot.toml).")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print only errors (and JSON with --json).")]
Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON on stdout.")]
Set = Annotated[
    list[str],
    typer.Option("--set", metavar="KEY=VALUE", help="Override a setting of [identify], e.g. --set filter.window=31."),
]
LAW_NAMES = ("coulomb-viscous", "stribeck", "stribeck-exponent", "asymmetric", "lugre", "auto")
METHOD_NAMES = ("whole-log", "curve-fit", "observer", "ground-reaction", "direct")
FORMATS = ("mjcf", "urdf", "drake", "c", "python", "yaml", "table", "isaaclab", "mjlab", "pinocchio")
Force = Annotated[bool, typer.Option("--force", help="Continue although the audit found a fatal error.")]
From = Annotated[float | None, typer.Option("--from", metavar="SECONDS", help="Start of the used part of each log.")]
To = Annotated[float | None, typer.Option("--to", metavar="SECONDS", help="End of the used part of each log.")]
Exclude = Annotated[
    list[str],
    typer.Option("--exclude", metavar="A:B", help="Span of each log that is not used [s], or LOG:A:B; repeatable."),
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Overwrite existing outputs.")]
Law = Annotated[str | None, _choice("NAME", "Friction law", LAW_NAMES, "auto")]
Method = Annotated[str | None, _choice("NAME", "Estimation method", METHOD_NAMES, METHOD_NAMES[0])]
Format = Annotated[str, _choice("FORMAT", "Format", FORMATS)]
Samples = Annotated[int | None, typer.Option(metavar="N", help="Draw N models from the uncertainty of the result.")]
Ranges = Annotated[bool, typer.Option("--ranges", help="Write 95 % ranges for domain randomization.")]
Exported = Annotated[
    str | None, typer.Option(metavar="NAMES", help="Comma-separated joints to export.  [default: all]")
]
Weak = Annotated[bool, typer.Option("--include-weak", help="Also export friction that is weak.")]
Strict = Annotated[bool, typer.Option("--strict", help="Fail if the format cannot represent all of the friction.")]
Form = Annotated[
    str | None,
    typer.Option(
        metavar="FORM",
        help="Friction model. mjcf: plain or lugre  [default: the closer fit]; yaml: all or plain  [default: all].",
    ),
]
Planned = Annotated[
    str | None, typer.Option(metavar="NAMES", help="Comma-separated joints.  [default: all weak or not excited]")
]
Held = Annotated[
    str | None,
    typer.Option(metavar="AXIS", help="Base axis that points up: x, -x, y, ...; if a floating base is held."),
]
Validation = Annotated[
    list[Path], typer.Option("--validate", metavar="LOG", help="Log for validation, not used for the fit.")
]
Labels = Annotated[str | None, typer.Option(metavar="A,B", help="Labels of the results.  [default: log file names]")]


class Command(TyperCommand):
    """A command whose help shows `LOG...` instead of `{LOG}...`, and no Python types."""

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """List the parts of the usage line without braces."""
        return [piece.replace("{", "").replace("}", "") for piece in super().collect_usage_pieces(ctx)]

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write the tables of arguments and options."""
        for title, kind in (("Arguments", "argument"), ("Options", "option")):
            parameters = [each for each in self.get_params(ctx) if each.param_type_name == kind]
            records = [record for each in parameters if (record := each.get_help_record(ctx))]
            if records:
                with formatter.section(title):
                    formatter.write_dl([(name.partition(" <")[0], text) for name, text in records])
