"""Make the picture of the proposal sheet: python docs/make_sheet_picture.py.

Needs Debian's chromium and poppler-utils.
"""

import subprocess
import tempfile
from pathlib import Path

from proposal_tables import sheet

PICTURE = Path(__file__).parent / "pictures" / "proposal_sheet"
CHROMIUM = ["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic"]
CHROMIUM += ["--no-first-run", "--disable-background-networking", "--disable-component-update"]
CHROMIUM += ["--disable-sync", "--no-pdf-header-footer"]


def main() -> None:
    """Print the sheet as a PDF file, and its first page as a picture."""
    with tempfile.TemporaryDirectory() as folder:
        page, pdf = Path(folder) / "sheet.html", Path(folder) / "sheet.pdf"
        sheet(str(page))
        command = [*CHROMIUM, f"--user-data-dir={folder}/browser", f"--print-to-pdf={pdf}"]
        subprocess.run([*command, page.as_uri()], check=True, timeout=120, capture_output=True)
        picture = ["pdftoppm", "-r", "110", "-f", "1", "-singlefile", "-png"]
        subprocess.run([*picture, str(pdf), str(PICTURE)], check=True, timeout=60)


if __name__ == "__main__":
    main()
