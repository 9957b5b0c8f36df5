#!/usr/bin/env python3
# SPDX-License-Identifier: MIT OR Apache-2.0
"""Checks the documents: relative links, anchors, images, files named in backticks, pages named in code.

Prints a line for each that leads nowhere, and ends with code 1 if there is one."""

import json
import pathlib
import re
import subprocess
import sys
import unicodedata

ROOT = pathlib.Path(__file__).resolve().parent.parent
FENCE = re.compile(r"^(```|~~~).*?^\1", re.M | re.S)
LINK = re.compile(r"!?\[(?:[^\[\]]|\[[^\]]*\])*\]\(\s*([^)\s]+)(?:\s+\"[^\"]*\")?\s*\)")
SPAN = re.compile(r"`([^`\n]+)`")
PAGE = re.compile(r"\bdocs/[\w./-]+\.(?:md|py|bib)\b")
# Folders whose files are named as paths in backticks.
TOPS = ("bsdf", "data", "docs", "pipeline", "rcwa", "tests", "tracer")
# Made when the book is built.
BUILT = ("docs/api/",)


def tracked(*patterns):
    listed = subprocess.run(["git", "ls-files", *patterns], cwd=ROOT, capture_output=True, text=True, check=True)
    return [ROOT / name for name in listed.stdout.split("\n") if name and (ROOT / name).exists()]


def slug(heading):
    text = LINK.sub(lambda m: m[0][m[0].index("[") + 1 : m[0].rindex("](")], heading).replace("`", "")
    kept = (c for c in text.strip().lower() if c in " -_" or unicodedata.category(c)[0] in "LN")
    return "".join(kept).replace(" ", "-")


def anchors(path):
    found, seen = set(), {}
    for line in FENCE.sub("", path.read_text(encoding="utf-8")).split("\n"):
        if match := re.match(r"#{1,6}\s+(.+?)\s*#*$", line):
            name = slug(match[1])
            count = seen.get(name, 0)
            seen[name] = count + 1
            found.add(name if count == 0 else f"{name}-{count}")
    return found


def markdown(path):
    text = path.read_text(encoding="utf-8")
    if path.suffix != ".ipynb":
        return FENCE.sub(lambda m: "\n" * m[0].count("\n"), text)
    cells = json.loads(text)["cells"]
    return "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown")


def check_links(path):
    text = markdown(path)
    for match in LINK.finditer(SPAN.sub(lambda m: " " * len(m[0]), text)):
        target, _, anchor = match[1].partition("#")
        if re.match(r"[a-z]+:", target):
            continue
        other = (path.parent / target).resolve() if target else path
        line = text.count("\n", 0, match.start()) + 1
        inside = other.relative_to(ROOT).as_posix() if other.is_relative_to(ROOT) else ""
        if inside.startswith(BUILT):
            continue
        if not inside or not other.exists():
            yield line, f"no file {match[1]}"
        elif anchor and other.suffix == ".md" and anchor not in anchors(other):
            yield line, f"no heading {match[1]}"


def check_names(path):
    text = markdown(path)
    for match in SPAN.finditer(text):
        name = match[1].rstrip("/")
        if name.split("/")[0] not in TOPS or not re.fullmatch(r"[\w./-]+/[\w.-]+", name) or "NAME" in name:
            continue
        if not (ROOT / name).exists():
            yield text.count("\n", 0, match.start()) + 1, f"no file {name}"


def check_pages(path):
    for number, line in enumerate(path.read_text(encoding="utf-8").split("\n"), 1):
        for match in PAGE.finditer(line):
            if not (ROOT / match[0]).exists():
                yield number, f"no page {match[0]}"


def main():
    checks = [(tracked("*.md", "*.ipynb"), check_links), (tracked("*.md"), check_names)]
    checks.append((tracked("*.rs", "*.py", "*.toml", ".ci/*", ".github/*"), check_pages))
    found = [
        f"{path.relative_to(ROOT)}:{line}: {words}"
        for paths, check in checks
        for path in paths
        for line, words in check(path)
    ]
    chapters = {match[1] for match in LINK.finditer((ROOT / "docs/SUMMARY.md").read_text(encoding="utf-8"))}
    pages = (path.relative_to(ROOT / "docs").as_posix() for path in tracked("docs/*.md"))
    found += [f"docs/SUMMARY.md: no chapter {page}" for page in pages if page not in chapters | {"SUMMARY.md"}]
    print("\n".join(found) if found else f"{len(tracked('*.md'))} documents: all links lead somewhere")
    return bool(found)


sys.exit(main())
