"""Makes the printed specification from the same Markdown as the book: Markdown to Typst, Typst to PDF.

build.py FOLDER writes FOLDER/splatstream-VERSION.pdf and prints its name; index.md says which version it is. Clause numbers and requirements become links,
2^n in prose a power. The bytes depend on the text alone: the date is that of the last change, the fonts are in Typst.
"""

import re
import sys
from pathlib import Path

import typst
from markdown_it import MarkdownIt

SPEC = Path(__file__).resolve().parent.parent
ATTACHED = {
    "default-network.bin": "The registered network of 6.17",
    "worked-example.gss": "The stream of annex D",
    "worked-temporal-example.gss": "The stream of annex E",
}
REQUIREMENT = r"SS-[A-Z]+-\d{3}"
CLAUSE = r"(?<![\w.-])[1-9A-F](?:\.\d+)+(?![\w-]|\.\d)"
POWER = r"2\^(?:-?\w+|\([^()]*\))"
# Files of which numbers with a point are measured values, or sections of their own, and not clauses.
WITHOUT_CLAUSES = ("d-", "e-", "rationale")


def string(text):
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def markup(text):
    """Text as Typst markup that means nothing but itself."""
    return re.sub(r"([^\w\s]|_)", r"\\\1", text)


class Chapter:
    """One Markdown file as Typst markup. `known` are the clauses and requirements that can be linked to."""

    def __init__(self, name, tokens, known):
        self.name, self.tokens, self.known = name, tokens, known
        self.pattern = re.compile(f"({REQUIREMENT}|{CLAUSE}|{POWER})")
        self.place = 0
        self.has_clauses = not name.startswith(WITHOUT_CLAUSES)

    def typst(self):
        return "\n".join(self.blocks(len(self.tokens)))

    # ---- blocks ----

    def blocks(self, end):
        while self.place < end:
            yield self.block()

    def closing(self, kind):
        """The place of the token that closes the one before `place`."""
        depth = 1
        for place in range(self.place, len(self.tokens)):
            depth += {f"{kind}_open": 1, f"{kind}_close": -1}.get(self.tokens[place].type, 0)
            if depth == 0:
                return place
        raise ValueError(f"{self.name}: {kind} is not closed")

    def block(self):
        token = self.tokens[self.place]
        self.place += 1
        match token.type:
            case "heading_open":
                return self.heading(int(token.tag[1]))
            case "fence" | "code_block":
                lines = token.content.rstrip("\n")
                longest = max(map(len, lines.split("\n")))
                return f"#code({longest}, raw({string(lines)}, block: true))"
            case "table_open":
                return self.table()
            case "bullet_list_open" | "ordered_list_open":
                return self.list(token)
            case "paragraph_open":
                text = self.inline(self.tokens[self.place])
                self.place += 2
                return f"{text}\n"
        raise ValueError(f"{self.name}: no way to print {token.type}, line {token.map}")

    def heading(self, level):
        title = self.tokens[self.place].content
        self.place += 2
        number = "" if self.name.startswith("rationale") else clause_of(title)
        return f"#heading(level: {level}, [{markup(title)}])" + (f" <{number}>\n" if number else "\n")

    def list(self, opened):
        ordered = opened.type.startswith("ordered")
        end = self.closing(opened.type.removesuffix("_open"))
        items = []
        while self.place < end:
            self.place += 1
            items.append("[" + "\n".join(self.blocks(self.closing("list_item"))) + "]")
            self.place += 1
        self.place = end + 1
        start = f"start: {opened.attrGet('start') or 1}, " if ordered else ""
        return f"#{'enum' if ordered else 'list'}({start}{', '.join(items)})\n"

    def table(self):
        end = self.closing("table")
        cells = [token for token in self.tokens[self.place:end] if token.type == "inline"]
        count = sum(token.type == "th_open" for token in self.tokens[self.place:end])
        self.place = end + 1
        rows = [cells[start:start + count] for start in range(0, len(cells), count)]
        columns, size = layout(rows)
        printed = [[f"[{self.inline(cell, in_table=True)}]" for cell in row] for row in rows]
        body = ",\n".join(", ".join(row) for row in printed[1:])
        return f"#grid-table(({', '.join(columns)},), ({', '.join(printed[0])},), {size}pt, {body})\n"

    # ---- inside a line ----

    def inline(self, token, in_table=False):
        marks = {"strong_open": "#strong[", "strong_close": "]", "em_open": "#emph[", "em_close": "]",
                 "softbreak": "\n", "link_close": "]"}
        parts = []
        for child in token.children:
            if child.type == "text":
                parts.append(self.text(child.content))
            elif child.type == "code_inline":
                parts.append(f"#raw({string(breakable(child.content) if in_table else child.content)})")
            elif child.type == "link_open":
                parts.append(self.link(child.attrGet("href")))
            elif child.type == "image":
                parts.append(f"#image({string('/' + child.attrGet('src'))}, width: 100%, alt: {string(child.content)})")
            else:
                parts.append(marks[child.type])
        return "".join(parts)

    def link(self, target):
        """Files of the book are other chapters here, or this document itself."""
        return "#[" if target.endswith((".md", ".pdf")) else f"#link({string(target)})["

    def text(self, text):
        if re.fullmatch(rf"\[{REQUIREMENT}\]", text):
            # Where the requirement is: only there it stands in brackets.
            return f"{markup(text)}#metadata(none) <{text[1:-1]}>"
        return "".join(self.piece(piece) for piece in self.pattern.split(text))

    def piece(self, piece):
        if re.fullmatch(POWER, piece):
            return f"2#super[{markup(piece[2:].strip('()'))}]"
        linked = re.fullmatch(REQUIREMENT, piece) or self.has_clauses and re.fullmatch(CLAUSE, piece)
        return f"#link(<{piece}>)[{markup(piece)}]" if linked and piece in self.known else markup(piece)


def breakable(code):
    """A digest in a narrow column may be broken after every 16 digits."""
    zero_width = "\u200b"
    return zero_width.join(re.findall(".{1,16}", code)) if len(code) > 48 and code.isalnum() else code


def layout(rows):
    """Widths of columns: as wide as needed for short ones, shares for those with sentences. And the size of text."""
    columns = list(zip(*[[cell.content for cell in row] for row in rows]))
    longest = [max(map(len, column)) for column in columns]
    size = 8.5 if len(columns) < 7 else 7.5 if len(columns) < 13 else 6.8
    if sum(longest) < 95:
        return ["auto"] * len(columns), size
    wide = [length > 30 for length in longest]
    shares = [max(1, round((sum(map(len, column)) / len(column)) ** 0.6)) for column in columns]
    return [f"{share}fr" if is_wide else "auto" for share, is_wide in zip(shares, wide)], size


def clause_of(title):
    """The number of a heading: `7.1` of `7.1 State`, `F` of `Annex F Numeric widths`; none of a heading without."""
    number = re.match(r"(?:Annex )?((?:\d+|[A-G]\b)(?:\.\d+)*) ", title)
    return number[1] if number else ""


def linkable(chapters):
    """The numbers of clauses and the identifiers of requirements."""
    found = set()
    for name, tokens in chapters.items():
        for token, inline in zip(tokens, tokens[1:]):
            if token.type == "heading_open" and not name.startswith("rationale"):
                found.add(clause_of(inline.content))
            found.update(re.findall(rf"\*\*\[({REQUIREMENT})\]\*\*", token.content))
    return found


def source(version):
    """The whole document as Typst."""
    names = re.findall(r"\(([\w-]+\.md)\)", (SPEC / "SUMMARY.md").read_text())
    markdown = MarkdownIt("commonmark").enable("table")
    chapters = {name: markdown.parse((SPEC / name).read_text()) for name in names}
    known = linkable(chapters)
    body = "\n".join(Chapter(name, tokens, known).typst() for name, tokens in chapters.items())
    year, month, day = map(int, max(re.findall(r"\| (\d+)-(\d+)-(\d+) \|", (SPEC / "changes.md").read_text())))
    files = "\n".join(f'#pdf.attach("/data/{name}", description: {string(what)})' for name, what in ATTACHED.items())
    return (f'#import "/pdf/style.typ": *\n#show: specification.with("{version}", '
            f"datetime(year: {year}, month: {month}, day: {day}))\n{files}\n{body}\n")


def main():
    version = re.search(r"SplatStream ([\d.]+(?:, release candidate \d+)?)", (SPEC / "index.md").read_text())[1]
    output = Path(sys.argv[1]) / f"splatstream-{version.replace(', release candidate ', '-rc')}.pdf"
    beside = output.with_suffix(".part")
    beside.write_bytes(typst.compile(source(version).encode(), root=str(SPEC), format="pdf", ignore_system_fonts=True))
    beside.replace(output)
    print(output)


if __name__ == "__main__":
    main()
