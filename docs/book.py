#!/usr/bin/env python3
# SPDX-License-Identifier: MIT OR Apache-2.0
"""Prepares chapters for mdBook: formulas set by KaTeX, and links that leave `docs` as plain words.

Needs Node.js, and KaTeX where `.ci/book` installs it."""

import html
import json
import posixpath
import re
import string
import subprocess
import sys

# Fenced and indented blocks and code spans stay as they are.
CODE = re.compile(r"(^```.*?^```$|^(?: {4}[^\n]*\n)+|`[^`\n]+`)", re.M | re.S)
MATH = re.compile(r"\$\$(.+?)\$\$|\$([^$\n](?:[^$]*?[^$\s])?)\$", re.S)
LINK = re.compile(r"\[([^\]]*)\]\((\.\.?/[^)\s]+)\)")
# A link whose words are a code span.
CODE_LINK = re.compile(r"\[(`[^`\n]+`)\]\((\.\.?/[^)\s]+)\)")


# Reads [formula, whether on a line of its own] each, and prints their HTML.
SET = """
const katex = require('./target/ci-book/node_modules/katex');
const formulas = JSON.parse(require('fs').readFileSync(0));
console.log(JSON.stringify(formulas.map(([text, displayMode]) => katex.renderToString(text, { displayMode }))));
"""


def set_formulas(formulas):
    done = subprocess.run(["node", "-e", SET], input=json.dumps(formulas), stdout=subprocess.PIPE, text=True)
    if done.returncode:
        sys.exit("docs/book.py: formulas are not set; .ci/book installs what they need")
    return [re.sub(r"(?<=>)[^<]+", plain, text.replace("\n", " ")) for text in json.loads(done.stdout)]


def plain(match):
    """Text between tags, in which Markdown finds no sign of its own."""
    return "".join(f"&#{ord(c)};" if c in string.punctuation else c for c in html.unescape(match[0]))


def prepare(content, path, formulas):
    """Leaves a mark for each formula, which it appends to `formulas`."""
    folder = posixpath.dirname(path)

    def link(match):
        leaves = posixpath.normpath(posixpath.join(folder, match[2])).startswith("..")
        return match[1] if leaves else match[0]

    def formula(match):
        formulas.append((match[1] or match[2], match[1] is not None))
        return f"\0{len(formulas) - 1}\0"

    parts = CODE.split(CODE_LINK.sub(link, content))
    # Parts at odd places are code.
    return "".join(
        part if i % 2 else LINK.sub(link, MATH.sub(formula, part)) for i, part in enumerate(parts)
    )


def chapters(items):
    for item in items:
        if isinstance(item, dict) and "Chapter" in item:
            yield item["Chapter"]
            yield from chapters(item["Chapter"]["sub_items"])


if len(sys.argv) > 1 and sys.argv[1] == "supports":
    sys.exit(0)
_, book = json.load(sys.stdin)
formulas = []
for chapter in chapters(book.get("items") or book.get("sections") or []):
    chapter["content"] = prepare(chapter["content"], chapter.get("path") or "", formulas)
formulas = set_formulas(formulas)
for chapter in chapters(book.get("items") or book.get("sections") or []):
    chapter["content"] = re.sub("\0(\\d+)\0", lambda mark: formulas[int(mark[1])], chapter["content"])
json.dump(book, sys.stdout)
