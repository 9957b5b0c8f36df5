# SPDX-License-Identifier: MIT OR Apache-2.0
"""Reads what batwing writes: results.json, studies, curves, maps and tables of diffraction orders, and runs it.

Needs numpy; `read_exr` also needs OpenEXR, `run` a built binary. Formats: docs/reference/results-schema.md, docs/reference/study-file.md, docs/reference/native-table-format.md.
"""

import csv
import hashlib
import json
import os
import re
import struct
import subprocess
from pathlib import Path

import numpy as np

SCHEMA_VERSION = 4  # of results.json
STUDY_SCHEMA_VERSION = 2  # of study.json
INNER, OUTER = 0, 1  # silicone, air


def results_directory():
    """$BATWING_RESULTS, or `results` at the top of the repository."""
    default = Path(__file__).resolve().parents[2] / "results"
    return Path(os.environ.get("BATWING_RESULTS", default))


def _read_sealed(path, version):
    """A JSON file of results, after a check that it and the files it lists are there and unaltered."""
    try:
        text = path.read_bytes().decode("utf-8")
        content = json.loads(text)
    except (OSError, ValueError) as error:
        raise ValueError(f"{path}: expected a JSON file that batwing wrote: {error}") from error
    if not isinstance(content, dict):
        raise ValueError(f"{path}: expected a JSON object, got {type(content).__name__}")
    if content.get("schema_version") != version:
        raise ValueError(f"{path}: schema_version: expected {version}, got {content.get('schema_version')}")
    rest = re.sub(r'("content_sha256"\s*:\s*")[^"]*', r"\1", text, count=1).rstrip()
    if hashlib.sha256(rest.encode()).hexdigest() != content.get("content_sha256"):
        raise ValueError(f"{path}: content_sha256: altered; its hash is not that of the content")
    for entry in content["files"]:
        file = path.parent / entry["file"]
        if not file.is_file():
            raise ValueError(f"{file}: missing; {path.name} lists it under files")
        if hashlib.sha256(file.read_bytes()).hexdigest() != entry["sha256"]:
            raise ValueError(f"{file}: altered; its hash is not the one that {path.name} lists under files")
    return content


def read_results(directory):
    """results.json, after a check that it and the files it lists are there and unaltered."""
    return _read_sealed(Path(directory) / "results.json", SCHEMA_VERSION)


def binary():
    """$BATWING_BINARY, or the release build at the top of the repository."""
    default = Path(__file__).resolve().parents[2] / "target" / "release" / "batwing"
    return Path(os.environ.get("BATWING_BINARY", default))


def run(*arguments):
    """What `batwing ARGUMENTS --json` prints; ValueError with its message if it fails."""
    command = [str(binary()), *map(str, arguments), "--json", "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise ValueError(done.stderr.strip())
    return json.loads(done.stdout)


def read_study(directory):
    """(study.json, columns of study.csv) of a folder that `batwing study` wrote, after the same check."""
    path = Path(directory) / "study.json"
    study = _read_sealed(path, STUDY_SCHEMA_VERSION)
    return study, read_columns(path.with_name("study.csv"))


def read_columns(path):
    """Columns of a CSV file that also holds text: arrays of numbers where every field is one or empty, else of text."""
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))

    def column(fields):
        try:
            return np.array([float(field) if field else np.nan for field in fields])
        except ValueError:
            return np.array(fields, dtype=str)

    return {name: column([row[i] for row in rows[1:]]) for i, name in enumerate(rows[0])}


def read_csv(path):
    """Columns of a CSV file, as a dict of arrays; empty fields are NaN."""
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    numbers = [[float(field) if field else np.nan for field in row] for row in rows[1:]]
    return dict(zip(rows[0], np.array(numbers).T))


def read_exr(path):
    """(description, value, standard_error) of a map; the description holds axes, units and provenance."""
    import OpenEXR

    with OpenEXR.File(str(path), separate_channels=True) as file:
        text = file.header()["batwing"]
        channels = {name: np.array(channel.pixels) for name, channel in file.channels().items()}
    return json.loads(text), channels["value"], channels["standard_error"]


def centres(axis):
    """Middles of the bins of an axis of an EXR description."""
    edges = np.array(axis["edges"])
    return 0.5 * (edges[:-1] + edges[1:])


class OrderTable:
    """A table of diffraction orders: shares of the incident power at nodes of (side, kx, ky).

    `side`, `kx`, `ky` are arrays over the nodes; wavevectors are in units of 2 pi / wavelength.
    """

    def __init__(self, path):
        data = Path(path).read_bytes()
        magic, version, header_length, payload_length = struct.unpack_from("<8sIIQ", data)
        if (magic, version) != (b"BWORDERS", 2):
            raise ValueError(f"{path}: not a table of version 2")
        if len(data) != 24 + header_length + payload_length + 32:
            raise ValueError(f"{path}: too short or too long")
        if hashlib.sha256(data[:-32]).digest() != data[-32:]:
            raise ValueError(f"{path}: wrong checksum")
        header = json.loads(data[24 : 24 + header_length])
        self.about, self.grid = header["table"], header["grid"]
        for array in header["arrays"]:
            start = 24 + header_length + array["offset"]
            count = int(np.prod(array["shape"]))
            values = np.frombuffer(data, array["dtype"], count, start).reshape(array["shape"])
            setattr(self, array["name"], values)
        self.zone = self.grid["wavelength"] / self.grid["period"]  # spacing of the orders
        self.index = (self.grid["index_inner"], self.grid["index_outer"])
        self.side = self.node_side
        offset = 0.5 * (self.grid["kx_per_zone"] % 2)
        self.kx = (self.node_kx + offset) * self.zone / self.grid["kx_per_zone"]
        self.ky = np.array(self.grid["ky"])[self.node_ky]
        self._number = {key: k for k, key in enumerate(zip(self.side.tolist(), self.node_kx.tolist(), self.node_ky.tolist()))}

    def __len__(self):
        return len(self.side)

    def find(self, side, kx_index, ky_index):
        """Number of a node, or None."""
        return self._number.get((side, kx_index, ky_index))

    def nearest(self, side, kx, ky):
        """Number of the node on `side` nearest to a wavevector."""
        distance = np.where(self.side == side, np.hypot(self.kx - kx, self.ky - ky), np.inf)
        return int(distance.argmin())

    def shares(self, node, to, unpolarised=True):
        """(relative orders, shares) that leave to the side `to`; shares are s and p, or their mean."""
        before = int(self.node_count[node, INNER]) if to == OUTER else 0
        first = int(self.node_first[node]) + before
        count, lowest = int(self.node_count[node, to]), int(self.node_lowest[node, to])
        both = np.stack([self.s[first : first + count], self.p[first : first + count]]).astype(float)
        return np.arange(lowest, lowest + count), both.mean(axis=0) if unpolarised else both

    def albedo(self, to):
        """Share of the incident power that leaves to the side `to`, unpolarised, for every node."""
        return np.array([self.shares(node, to)[1].sum() for node in range(len(self))])

    def directions(self, node, orders, to):
        """Angles (theta, phi) in degrees of orders that leave to the side `to`, theta from that side's normal."""
        kx, ky = self.kx[node] + orders * self.zone, self.ky[node]
        sine = np.hypot(kx, ky) / self.index[to]
        return np.degrees(np.arcsin(np.minimum(sine, 1.0))), np.degrees(np.arctan2(ky, kx))

    def line(self, side, ky_index=0):
        """Numbers of the nodes on `side` at one ky, by ascending kx."""
        return np.flatnonzero((self.side == side) & (self.node_ky == ky_index))

    def angle_of_incidence(self, node):
        """Signed angle in degrees to the normal, in the plane across the grooves."""
        return self._in_plane(self.kx[node], self.ky[node], int(self.side[node]))

    def angles(self, node, orders, to):
        """Signed angles in degrees of orders that leave to the side `to`, in the plane across the grooves."""
        return self._in_plane(self.kx[node] + orders * self.zone, self.ky[node], to)

    def _in_plane(self, kx, ky, side):
        return np.degrees(np.arcsin(np.clip(kx / np.sqrt(self.index[side] ** 2 - ky**2), -1.0, 1.0)))


def smeared(angles, shares, at, sigma):
    """Density per degree at the angles `at` of discrete shares that a normal distribution of standard deviation `sigma` smears."""
    distance = np.asarray(at)[:, None] - np.asarray(angles)[None, :]
    return (np.exp(-0.5 * (distance / sigma) ** 2) / (sigma * np.sqrt(2 * np.pi))) @ np.asarray(shares)


def binned(angles, shares, width):
    """(edges, power in each bin) of discrete shares in bins of `width` degrees from -90 to 90."""
    edges = np.linspace(-90.0, 90.0, round(180 / width) + 1)
    return edges, np.histogram(angles, edges, weights=shares)[0]
