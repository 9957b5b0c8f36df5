#!/usr/bin/env python3
# SPDX-License-Identifier: MIT OR Apache-2.0
"""Checks the book in `target/book`: a page for each chapter, links between pages, formulas, the search.

Prints a line for each fault, and ends with code 1 if there is one."""

import html.parser
import pathlib
import re
import sys
import urllib.parse

ROOT = pathlib.Path(__file__).resolve().parent.parent
BOOK = ROOT / "target/book"
# Built by pdoc, where the Python package is installed.
API = BOOK / "api"
# Words that a reader looks up: a key, an option, a term of the glossary.
WORDS = ("pitch_mm", "until-error", "hemisphere")


class Page(html.parser.HTMLParser):
    def __init__(self, path):
        super().__init__()
        self.links, self.loads, self.names, self.path = [], [], set(), path
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        self.names.update(v for k, v in attributes.items() if k in ("id", "name") and v)
        if link := attributes.get("href") or attributes.get("src"):
            self.links.append(link)
            if tag != "a" and urllib.parse.urlsplit(link).netloc and attributes.get("rel") != "canonical":
                self.loads.append(link)


def chapters():
    summary = (ROOT / "docs/SUMMARY.md").read_text(encoding="utf-8")
    for name in re.findall(r"\]\(([^)]+)\.md\)", summary):
        yield BOOK / (re.sub(r"README$", "index", name) + ".html")


def faults():
    pages = {path: Page(path) for path in chapters() if path.exists()}
    yield from (f"{path}: no page" for path in chapters() if path not in pages)
    for path, page in pages.items():
        yield from (f"{path.relative_to(BOOK)}: needs a network for {link}" for link in page.loads)
        for link in page.links:
            address = urllib.parse.urlsplit(link)
            if address.scheme or address.netloc:
                continue
            other = (path.parent / urllib.parse.unquote(address.path)).resolve() if address.path else path
            if other.is_relative_to(API) and not API.exists():
                continue
            if not other.exists():
                yield f"{path.relative_to(BOOK)}: no file {link}"
            elif other in pages and address.fragment and urllib.parse.unquote(address.fragment) not in pages[other].names:
                yield f"{path.relative_to(BOOK)}: no heading {link}"
    theory = (BOOK / "explanation/theory.html").read_text(encoding="utf-8")
    if theory.count('class="katex-display"') < 10 or "$" in re.sub(r"(?s)<(script|pre|code).*?</\1>", "", theory):
        yield "explanation/theory.html: formulas are not set"
    index = "".join(path.read_text(encoding="utf-8") for path in BOOK.glob("searchindex*"))
    yield from (f"search: `{word}` is not found" for word in WORDS if word not in index)


found = list(faults())
print("\n".join(map(str, found)) or f"book: {len(list(chapters()))} chapters, links and search hold")
sys.exit(bool(found))
