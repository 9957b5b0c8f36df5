# SPDX-License-Identifier: MIT OR Apache-2.0
"""`python -m batwing`: the command `batwing`."""

from .cli import program

if __name__ == "__main__":
    program()
