#!/usr/bin/env python3
# SPDX-License-Identifier: MIT OR Apache-2.0
"""Prepares chapters for mdBook: formulas for MathJax, and links that leave `docs` as plain words."""

import json
import posixpath
import re
import sys

# Fenced and indented blocks and code spans stay as they are.
CODE = re.compile(r"(^```.*?^```$|^(?: {4}[^\n]*\n)+|`[^`\n]+`)", re.M | re.S)
MATH = re.compile(r"\$\$(.+?)\$\$|\$([^$\n](?:[^$]*?[^$\s])?)\$", re.S)
LINK = re.compile(r"\[([^\]]*)\]\((\.\.?/[^)\s]+)\)")
# A link whose words are a code span.
CODE_LINK = re.compile(r"\[(`[^`\n]+`)\]\((\.\.?/[^)\s]+)\)")


def formula(match):
    display = match[1] is not None
    # Every sign of Markdown is escaped, so that MathJax sees the formula as written.
    text = re.sub(r"""([\\`*_{}\[\]()#+.!<>&|~^$'"-])""", r"\\\1", match[1] or match[2])
    return f"\\\\\\[{text}\\\\\\]" if display else f"\\\\\\({text}\\\\\\)"


def prepare(content, path):
    folder = posixpath.dirname(path)

    def link(match):
        leaves = posixpath.normpath(posixpath.join(folder, match[2])).startswith("..")
        return match[1] if leaves else match[0]

    parts = CODE.split(CODE_LINK.sub(link, content))
    # Parts at odd places are code.
    return "".join(
        part if i % 2 else LINK.sub(link, MATH.sub(formula, part)) for i, part in enumerate(parts)
    )


def walk(items):
    for item in items:
        if isinstance(item, dict) and "Chapter" in item:
            chapter = item["Chapter"]
            chapter["content"] = prepare(chapter["content"], chapter.get("path") or "")
            walk(chapter["sub_items"])


if len(sys.argv) > 1 and sys.argv[1] == "supports":
    sys.exit(0)
_, book = json.load(sys.stdin)
walk(book.get("items") or book.get("sections") or [])
json.dump(book, sys.stdout)
