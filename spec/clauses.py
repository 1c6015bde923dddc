#!/usr/bin/env python3
"""Links between clauses: a preprocessor of mdBook, and `clauses.py --check FOLDER`, which follows them in what mdBook wrote.

A clause can be linked to as #clause-7.13.3, a requirement as #SS-BS-004. Numbers of clauses and requirements in the text
become links; code, headings and what is a link already stay as they are.
"""

import html.parser
import json
import os
import re
import sys

from check import CLAUSE

# Where every number with a point is that of a clause, as check.py demands; elsewhere there are decibels and bits too.
PAGES = re.compile(r"0\d-|[abcfg]-|changes")
HEADING = re.compile(r"^(#+) (?:Annex )?((?:\d+|[A-Z])(?:\.\d+)*) .*$", re.M)
REQUIREMENT = r"\bSS-[A-Z]{2}-\d{3}\b"
DEFINED = re.compile(rf"\*\*\[({REQUIREMENT})\]\*\*")
# Fences, code, links, headings and version numbers are kept.
KEPT = re.compile(
    rf"^```.*?^```|`[^`\n]*`|(?:[Vv]ersion|SplatStream) \d+\.\d+|!?\[[^\]\n]*\]\([^)\n]*\)|^#[^\n]*|{DEFINED.pattern}", re.M | re.S)


def chapters(items):
    for item in items:
        if "Chapter" in item:
            yield item["Chapter"]
            yield from chapters(item["Chapter"]["sub_items"])


def targets(book):
    """What can be linked to, and the page it is on."""
    pages = {}
    for chapter in book:
        numbers = HEADING.finditer(chapter["content"]) if PAGES.match(chapter["path"]) else ()
        for number in (match[2] for match in numbers):
            pages[number] = (chapter["path"], "clause-" + number)
        for name in DEFINED.findall(chapter["content"]):
            pages[name] = (chapter["path"], name)
    return pages


def linked(text, page, pages):
    named = re.compile("%s|%s" % (REQUIREMENT, CLAUSE.pattern) if PAGES.match(page) else REQUIREMENT)

    def link(match):
        path, anchor = pages.get(match[0], (None, None))
        if path is None:
            return match[0]
        return "[%s](%s#%s)" % (match[0], "" if path == page else path, anchor)

    parts, end = [], 0
    for kept in KEPT.finditer(text):
        parts += [named.sub(link, text[end:kept.start()]), kept[0]]
        end = kept.end()
    text = "".join(parts) + named.sub(link, text[end:])
    if PAGES.match(page):
        text = HEADING.sub(lambda match: "%s { #clause-%s }" % (match[0], match[2]), text)
    return DEFINED.sub(r'<a id="\1"></a>**[\1]**', text)


def preprocess():
    _, book = json.load(sys.stdin)
    book_chapters = list(chapters(book["items"]))
    pages = targets(book_chapters)
    for chapter in book_chapters:
        chapter["content"] = linked(chapter["content"], chapter["path"], pages)
    json.dump(book, sys.stdout)


class Page(html.parser.HTMLParser):
    """The identifiers of a page and the links of its text."""

    def __init__(self, text):
        super().__init__()
        self.ids, self.links = set(), set()
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        values = dict(attributes)
        self.ids.add(values.get("id"))
        if tag == "a" and re.search("#(clause-|SS-)", values.get("href") or ""):
            self.links.add(values["href"])


def check(folder):
    """Links to places that are not there."""
    pages = {}
    for name in os.listdir(folder):
        if name.endswith(".html") and name != "print.html":
            with open(os.path.join(folder, name), encoding="utf-8") as f:
                pages[name] = Page(f.read())
    links = [(name, *link.split("#")) for name, page in pages.items() for link in page.links]
    lost = [link for link in links if link[2] not in pages.get(link[1] or link[0], Page("")).ids]
    for name, target, anchor in lost:
        print("%s: %s#%s is not there" % (name, target, anchor))
    print("%d links, %d lost" % (len(links), len(lost)))
    return 0 if links and not lost else 1


if __name__ == "__main__":
    if sys.argv[1:2] == ["--check"]:
        sys.exit(check(sys.argv[2]))
    # `supports RENDERER`: for HTML alone.
    if sys.argv[1:2] == ["supports"]:
        sys.exit(sys.argv[2] != "html")
    preprocess()
