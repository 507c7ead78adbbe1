"""Put the pictures of a folder onto one sheet, each with its name: `contact_sheet.py FOLDER SHEET.webp`."""

import sys
from pathlib import Path

from PIL import Image, ImageDraw

_COLUMNS, _WIDTH, _HEIGHT, _LINE = 4, 360, 226, 18


def main(folder: str, sheet: str) -> None:
    """Draw the sheet."""
    pictures = sorted(Path(folder).glob("*.png"))
    rows = -(-len(pictures) // _COLUMNS)
    drawn = Image.new("RGB", (_COLUMNS * _WIDTH, rows * (_HEIGHT + _LINE)), "white")
    pen = ImageDraw.Draw(drawn)
    for index, path in enumerate(pictures):
        left, top = index % _COLUMNS * _WIDTH, index // _COLUMNS * (_HEIGHT + _LINE)
        pen.text((left + 4, top + 3), path.stem.replace("_", " "), fill="black")
        picture = Image.open(path).convert("RGB")
        picture.thumbnail((_WIDTH - 6, _HEIGHT - 4))
        drawn.paste(picture, (left + 3, top + _LINE))
    drawn.save(sheet, quality=60, method=6)


if __name__ == "__main__":
    main(*sys.argv[1:])
