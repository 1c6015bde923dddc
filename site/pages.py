#!/usr/bin/env python3
"""The pages of the site that nothing else writes: the start page and what decoders do. pages.py FOLDER."""

import html
import pathlib
import re
import sys

HERE = pathlib.Path(__file__).parent
MATRIX = HERE.parent / "conformance/results/matrix.md"
REPOSITORY = "https://github.com/splatstream/splatstream"


def inline(text):
    """Markdown of one line: code, and nothing else."""
    return re.sub(r"`([^`]*)`", r"<code>\1</code>", html.escape(text))


def row(line, cell):
    cells = [inline(text.strip()) for text in line.strip().strip("|").split("|")]
    first, rest = cells[0], cells[1:]
    return f"<tr><th>{first}</th>" + "".join(f"<{cell}>{text}</{cell}>" for text in rest) + "</tr>"


def matrix(text):
    """Title, introduction and table of the page that `conformance matrix` writes."""
    title, *lines = [line for line in text.splitlines() if line]
    table = [line for line in lines if line.startswith("|")]
    said = "".join(f"<p>{inline(line)}</p>" for line in lines if not line.startswith("|"))
    head, _, *body = table
    rows = "".join(row(line, "td") for line in body)
    return title.lstrip("# "), f"{said}<table><thead>{row(head, 'th')}</thead><tbody>{rows}</tbody></table>"


def page(title, main, root):
    shell = (HERE / "shell.html").read_text()
    values = {"title": html.escape(title), "main": main, "root": root, "repository": REPOSITORY}
    return re.sub(r"\{(\w+)\}", lambda found: values[found[1]], shell)


def write(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


def with_icon(path):
    """Browsers ask the server for an icon where a page names none."""
    write(path, path.read_text().replace("<title>", '<link rel="icon" href="../icon.svg"><title>', 1))


def main():
    site = pathlib.Path(sys.argv[1])
    for file in ("style.css", "icon.svg"):
        write(site / file, (HERE / file).read_text())
    with_icon(site / "charts/index.html")
    title, table = matrix(MATRIX.read_text())
    write(site / "conformance/index.html", page(title, f"<h1>{title}</h1>{table}", "../"))
    start = (HERE / "start.html").read_text().replace("{repository}", REPOSITORY)
    if not (site / "spec").is_dir():
        start = start.replace('"spec/index.html"', f'"{REPOSITORY}/blob/main/spec/index.md"')
    write(site / "index.html", page("SplatStream", start, ""))


if __name__ == "__main__":
    main()
