"""The report as one page: plain words, figures, tables, and where every file comes from.

It needs no network and no script, says no date, and is the same for the same report.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from html import escape
from string import Template
from typing import Any

from rich.table import Table

from dmpcli.reporting import document, provenance
from dmpcli.reporting.figures import ReportFigure
from dmpcli.reporting.stroke_measures import Row

_PAGE = Template("""\
<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="generator" content="dmpcli $tool">
<link rel="icon" href="data:,">
<title>$title</title>
<style>
:root { color-scheme: light; }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 60rem; padding: 1rem; color: #1b1b1b; background: #fff;
  font: 1rem/1.5 system-ui, -apple-system, "Segoe UI", Roboto, "Liberation Sans", sans-serif; }
h1 { font-size: 1.6rem; line-height: 1.2; margin: .5rem 0; overflow-wrap: anywhere; }
h2 { font-size: 1.2rem; margin: 2rem 0 .5rem; border-bottom: 1px solid #ccc; }
p, li, figcaption { overflow-wrap: anywhere; }
nav a { margin-right: 1rem; }
ul.said { padding-left: 1.2rem; }
ul.said li { margin: .3rem 0; }
.warning { border-left: .3rem solid #d55e00; background: #fff4ea; padding: .5rem .8rem;
  margin: .8rem 0; }
figure { margin: 1.5rem 0; }
figure h3 { font-size: 1rem; margin: 0 0 .3rem; overflow-wrap: anywhere; }
figcaption { font-size: .9rem; color: #444; }
.wide { overflow-x: auto; }
.wide svg { display: block; width: 100%; min-width: 33rem; max-width: 45rem; height: auto; }
table { border-collapse: collapse; font-size: .9rem; font-variant-numeric: tabular-nums; }
caption { text-align: left; font-weight: 600; padding: .3rem 0; white-space: nowrap; }
th, td { padding: .2rem .7rem .2rem 0; text-align: left; vertical-align: top;
  border-bottom: 1px solid #e4e4e4; white-space: nowrap; }
th.right, td.right { text-align: right; }
.remark { font-size: .9rem; color: #444; margin: .3rem 0; }
.step { border: 1px solid #ccc; border-radius: .4rem; padding: .5rem .8rem; margin: .6rem 0; }
.step h3 { margin: 0; font-size: 1rem; }
code { font-family: ui-monospace, "Liberation Mono", monospace; font-size: .82rem;
  overflow-wrap: anywhere; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: .1rem .8rem; margin: .3rem 0;
  font-size: .9rem; }
dt { color: #555; }
dd { margin: 0; min-width: 0; overflow-wrap: anywhere; }
footer { margin: 2rem 0 1rem; font-size: .85rem; color: #555; }
@media (max-width: 40rem) { dl { grid-template-columns: 1fr; } dd { margin-bottom: .3rem; } }
@media print {
  body { max-width: none; font-size: 10pt; padding: 0; }
  nav { display: none; }
  .wide { overflow: visible; }
  .wide svg { min-width: 0; }
  figure, table, .step, .warning { break-inside: avoid; }
  h2, h3 { break-after: avoid; }
  th, td { white-space: normal; }
}
</style>
</head>
<body>
<header>
<h1>$title</h1>
<nav><a href="#figures">Figures</a><a href="#tables">Tables</a><a href="#origin">Where it comes
from</a></nav>
</header>
<main>
<section id="summary">
$summary
</section>
$warnings<section id="figures">
<h2>Figures</h2>
$figures
</section>
<section id="tables">
<h2>Tables</h2>
<p class="remark">Lengths in mm, times in s, angles in degrees unless a table says otherwise.</p>
$tables
</section>
<section id="origin">
<h2>Where it comes from</h2>
$origin
</section>
</main>
<footer>Made by dmpcli $tool. The same numbers stand in report.json, every wave height in
wave_heights.csv, the figures as files of their own beside this page.</footer>
</body>
</html>
""")


def page(report: Row, figures: Sequence[ReportFigure]) -> bytes:
    """Return the page.

    Parameters
    ----------
    report : dict
        The document.
    figures : sequence of ReportFigure
    """
    names = [entry["file"] for entry in report["files"]]
    on = f" on {report['surface']['file']}" if report["surface"] else ""
    text = _PAGE.substitute(
        title=escape(f"Report: {', '.join(names)}{on}"),
        tool=escape(report["tool"]),
        summary=_summary(report["summary"]),
        warnings="".join(
            f'<p class="warning">{escape(line)}</p>\n' for line in document.warnings(report)
        ),
        figures="\n".join(_figure(figure) for figure in figures),
        tables="\n".join(_tables(report)),
        origin="\n".join(_step(step) for step in _origin(report)),
    )
    return text.encode()


def _summary(sentences: Sequence[str]) -> str:
    first, *others = sentences or [""]
    items = "".join(f"<li>{_said(line)}</li>\n" for line in others)
    return f'<p>{escape(first)}</p>\n<ul class="said">\n{items}</ul>'


def _said(line: str) -> str:
    """Return a sentence with the name that it begins with in bold."""
    name, colon, text = line.partition(": ")
    return f"<b>{escape(name)}</b>: {escape(text)}" if colon else escape(line)


def _figure(figure: ReportFigure) -> str:
    return (
        f'<figure id="{escape(figure.name)}"><h3>{escape(figure.title)}</h3>\n'
        f'<div class="wide">{inline(figure.files["svg"], figure)}</div>\n'
        f"<figcaption>{escape(figure.caption)}</figcaption></figure>"
    )


_HEAD = re.compile(r"^.*?(?=<svg)", re.DOTALL)
_META = re.compile(r"<metadata>.*?</metadata>\s*", re.DOTALL)
_GROUP = re.compile(r'<g id="[^"]*">')
_NAMED = re.compile(r'id="([^"]+)"')


def inline(svg: bytes, figure: ReportFigure) -> str:
    """Return an SVG file as it can stand in a page: names that no other figure has, and a title."""
    text = _META.sub("", _HEAD.sub("", svg.decode(), count=1))
    text = _GROUP.sub("<g>", text)
    head, end, body = text.partition(">")
    head = re.sub(r' (width|height)="[^"]*"', "", head)
    for name in sorted(set(_NAMED.findall(body))):
        new = f"{figure.name}-{name}"
        body = body.replace(f'id="{name}"', f'id="{new}"')
        body = body.replace(f"#{name})", f"#{new})").replace(f'href="#{name}"', f'href="#{new}"')
    label = escape(f"{figure.title}. {figure.caption}")
    return f'{head} role="img" aria-label="{label}"{end}{body}'.rstrip()


def _tables(report: Row) -> Iterator[str]:
    warned = set(document.warnings(report))
    for group in document.groups(report):
        for part in group:
            if isinstance(part, Table):
                yield f'<div class="wide">{table(part)}</div>'
            elif part not in warned:
                yield f'<p class="remark">{escape(part)}</p>'


def table(made: Table) -> str:
    """Return a table as HTML."""
    sides = [' class="right"' if column.justify == "right" else "" for column in made.columns]
    head = "".join(
        f'<th scope="col"{side}>{escape(str(column.header))}</th>'
        for column, side in zip(made.columns, sides, strict=True)
    )
    rows = zip(*(list(column.cells) for column in made.columns), strict=True)
    body = "\n".join(
        "<tr>"
        + "".join(
            f"<td{side}>{escape(str(cell))}</td>" for cell, side in zip(row, sides, strict=True)
        )
        + "</tr>"
        for row in rows
    )
    title = f"<caption>{escape(str(made.title))}</caption>" if made.title else ""
    return f"<table>{title}<thead><tr>{head}</tr></thead><tbody>\n{body}</tbody></table>"


def _origin(report: Row) -> list[Row]:
    return provenance.steps(report)


def _step(step: Mapping[str, Any]) -> str:
    origin = step["origin"]
    parts = [("SHA-256", f"<code>{escape(step['sha256'])}</code>")]
    if origin is None:
        parts.append(("made by", "another program: nothing is known of it but its content"))
    else:
        made = f"dmpcli {escape(origin['command'])}, version {escape(origin['tool'])}"
        parts.append(("made by", made))
        for given in step["inputs"]:
            name = escape(given["name"] or "not among these files")
            parts.append(
                (f"from {escape(given['role'])}", f"{name} <code>{escape(given['sha256'])}</code>")
            )
        options = " ".join(
            f"{key}={_value(value)}" for key, value in sorted(origin["options"].items())
        )
        if options:
            parts.append(("options", f"<code>{escape(options)}</code>"))
    rows = "".join(f"<dt>{name}</dt><dd>{text}</dd>\n" for name, text in parts)
    kind = _KINDS.get(step["schema"], step["schema"])
    title = f"{escape(step['name'])}: {escape(kind)}"
    return f'<div class="step"><h3>{title}</h3>\n<dl>\n{rows}</dl></div>'


_KINDS = {
    "recording": "recording of another program",
    "demonstration": "recording",
    "pairs": "batch of trajectories",
}


def _value(value: object) -> str:
    if value is None:
        return "-"
    if isinstance(value, float):
        return f"{value:g}"
    if isinstance(value, list):
        return "[" + ",".join(_value(item) for item in value) + "]"
    return str(value)
