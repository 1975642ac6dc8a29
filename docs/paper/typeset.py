"""The paper as a PDF from the numbers and figures in a folder: ``python docs/paper/typeset.py FOLDER``."""

import sys
from pathlib import Path

import typst

folder = Path(sys.argv[1]).resolve()
source = Path(__file__).with_name("paper.typ")
typst.compile(source, output=folder / "paper.pdf", root="/", sys_inputs={"folder": str(folder)})
