"""Take the README's picture of a report's first screen: `stribeck demo`, then `python docs/screenshot.py`.

Needs Chromium (Debian: `apt-get install chromium`). A palette of 64 colors keeps the file small.
"""

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

WIDTH, HEIGHT = 1280, 860
"""Size of the window [pixels]."""
TARGET = Path(__file__).parent / "assets" / "report.png"


def main(report: Path) -> None:
    """Write the picture of a report."""
    with TemporaryDirectory() as folder:
        raw = Path(folder) / "report.png"
        window = [f"--window-size={WIDTH},{HEIGHT}", f"--screenshot={raw}", f"--user-data-dir={folder}"]
        switches = ["--headless", "--no-sandbox", "--hide-scrollbars", "--virtual-time-budget=8000"]
        subprocess.run(["chromium", *switches, *window, report.resolve().as_uri()], check=True, capture_output=True)
        with Image.open(raw) as picture:
            picture.convert("RGB").quantize(64).save(TARGET, optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "demo/report.html"))
