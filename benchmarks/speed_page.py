"""The records of the benchmarks as a page of the site: tables, and a figure of the growth with the size."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from textwrap import fill
from typing import Any

from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator
from recording import SCHEMA, shown, three

from verification.figures.style import BODY1, BODY2, new_figure, save, styled

#: Where `make bench` puts the records.
RECORDS = Path(__file__).with_name("records")

#: A panel of the figure in inches: at 96 dots to the inch it fits the screen of a phone.
WIDTH, HEIGHT = 3.5, 2.7

#: On a narrow screen a number keeps its unit and its exponent.
UNBROKEN = str.maketrans({" ": "\N{NO-BREAK SPACE}", "-": "\N{NON-BREAKING HYPHEN}"})

NOTHING = """\
**No measurement is recorded in this copy.** The benchmarks run, and leave their records for the next build of this
site, by

```console
$ make bench
```
"""


def read(folder: Path) -> list[dict[str, Any]]:
    """All records of a folder, in their places.

    Raises
    ------
    ValueError
        A file is no record.
    """
    found = []
    for path in sorted(folder.glob("*.json")):
        try:
            record = json.loads(path.read_text(encoding="utf-8"))
        except ValueError as error:
            raise ValueError(f"{path.name}: no JSON ({error}); remove it and run `make bench`") from None
        schema = record.get("schema") if isinstance(record, dict) else None
        if schema != SCHEMA:
            raise ValueError(f"{path.name}: schema: {schema!r}, needed {SCHEMA!r}; remove it and run `make bench`")
        found.append(record)
    return sorted(found, key=lambda record: record["place"])


def write(records: Path, folder: Path, images: str) -> None:
    """Write ``tables.md`` and a panel of the figure for each comparison into a folder.

    Parameters
    ----------
    records : Path
        The folder of the records; it may be missing.
    folder : Path
        Where to write; what another build has left there is removed.
    images : str
        The folder as seen from the page that includes the tables.
    """
    found = read(records)
    folder.mkdir(parents=True, exist_ok=True)
    for left in (*folder.glob("*.svg"), *folder.glob("*.md")):
        left.unlink()
    growing = [record for record in found if record["growth"]["ours"] is not None]
    for record in growing:
        save(draw(record), folder / f"{record['name']}.svg")
    (folder / "tables.md").write_text("\n".join(page(found, growing, images)), encoding="utf-8")


def page(records: list[dict[str, Any]], growing: list[dict[str, Any]], images: str) -> Iterator[str]:
    """The lines of the page, in MyST Markdown."""
    if not records:
        yield NOTHING
        return
    machines = dict.fromkeys(measured_on(record) for record in records)
    if len(machines) == 1:
        yield from (*machines, "")
    for record in records:
        yield from section(record)
        if len(machines) > 1:
            yield from (measured_on(record), "")
    if growing:
        yield from ("## How time and memory grow with the size", "")
        yield "Both axes are logarithmic, so that a power of the size is a straight line."
        yield "The legends give the powers that were fitted."
        yield from ("", ":::{container} panels")
        yield from (f"![{alternative(record)}]({images}/{record['name']}.svg)" for record in growing)
        yield from (":::", "")


def measured_on(record: dict[str, Any]) -> str:
    """Date and machine of a record, one sentence."""
    at = record["machine"]
    return (
        f"Measured on {record['date']} with ndtheory {record['version']}: {at['cpu']}, {at['cores']} cores,"
        f" {at['system']}, Python {at['python']}, numpy {at['numpy']}, scipy {at['scipy']},"
        f" BLAS {at['blas']} on one thread."
    )


def section(record: dict[str, Any]) -> Iterator[str]:
    """One comparison: what, its table, the growth, what was wanted; without another side, ours alone."""
    rows, unit, peer = record["rows"], record["unit"], record["peer"]
    sized, compared = any(row["size"] is not None for row in rows), any(row["apart"] is not None for row in rows)
    yield from (f"## {record['title']}", "")
    yield f"- *ours*: {record['ours']}."
    if peer:
        yield f"- *{peer}*: {record['other']}."
    yield from (f"- The {record['quantity']} is measured." if record["quantity"] != "CPU time" else "", "")
    against = [peer, "ours / other"] if peer else []
    head = [record["size"]] * sized + ["ours", *against, "rounds"] + ["apart"] * compared
    yield from (line(head), line(["--:"] * len(head)))
    for row in rows:
        cells = [f"{row['size']:,}"] if sized else []
        cells.append(shown(row["ours"], unit))
        cells += [shown(row["other"], unit), three(row["ratio"])] if peer else []
        cells.append(str(row["rounds"]))
        cells += ["-" if row["apart"] is None else f"{row['apart']:.0e}"] * compared
        yield line(cell.translate(UNBROKEN) for cell in cells)
    yield ""
    if told := growth(record):
        since = f"From {record['since']:,} {record['size']} on" if record["since"] else "Over these sizes"
        yield f"{since} the {record['quantity']} grows like {told}."
    if compared:
        yield f"The last column tells how far the two answers are apart: the {in_tex(record['apart'])}."
    if record["wanted"]:
        yield f"The aim of this project is {in_tex(record['wanted'])}."
    yield ""


def in_tex(text: str) -> str:
    """Powers, which a terminal shows as they are written, as mathematics."""
    return re.sub(r"\b(\w)\^([\d.]*\d)", r"$\1^{\2}$", text)


def line(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cells)} |"


def growth(record: dict[str, Any]) -> str:
    """The fitted powers of the size, in words; empty where nothing was fitted."""
    names = {"ours": "ours", "other": record["peer"]}
    fitted = [(names[side], power) for side, power in record["growth"].items() if power is not None]
    return " and ".join(f"$n^{{{power:.2f}}}$ ({name})" for name, power in fitted)


def alternative(record: dict[str, Any]) -> str:
    """The panel for those who do not see it."""
    return f"{record['title']}: {record['quantity']} over {record['size']}, growing like {growth(record)}".replace(
        "$", ""
    )


def draw(record: dict[str, Any]) -> Figure:
    """Both sides over the size, the fitted powers in the legend."""
    with styled():
        figure = new_figure(WIDTH, HEIGHT)
        ax = figure.subplots()
        sides = (("ours", "ours", BODY1, "o-", BODY1), ("other", record["peer"], BODY2, "s--", "white"))
        for side, name, colour, line_style, inside in sides:
            points = [(row["size"], row[side]) for row in record["rows"] if row[side] is not None]
            if points:
                power = record["growth"][side]
                label = name if power is None else f"{name}, $n^{{{power:.2f}}}$"
                ax.loglog(*zip(*points, strict=True), line_style, color=colour, markerfacecolor=inside, label=label)
        sizes = [row["size"] for row in record["rows"]]
        if len(sizes) > 6:  # so many numbers run into each other
            sizes = sizes[::-2]
        ax.xaxis.set_major_locator(FixedLocator(sizes))
        ax.xaxis.set_major_formatter(
            FuncFormatter(lambda size, _: f"{size:,.0f}" if size < 10_000 else f"{size / 1e3:.0f}k")
        )
        ax.xaxis.set_minor_locator(NullLocator())
        ax.set_xlabel(record["size"])
        ax.set_ylabel(f"{record['quantity']} [{record['unit']}]")
        ax.set_title(fill(record["title"], 40))
        ax.legend()
    return figure
