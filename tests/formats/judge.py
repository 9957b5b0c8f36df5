# SPDX-License-Identifier: MIT OR Apache-2.0
"""What batwing exports, as the readers of other people see it.

    python judge.py BATWING TABLE.bworders RESULTS_OF_ONE_MODEL DESIGN.toml WORK

BATWING is the binary; files go into the directory WORK. Prints one line for each claim and ends with code 1 if one of them fails. Packages that
are not installed are named and their claims left out; numpy must be there.
"""

import importlib.util
import json
import subprocess
import sys
import tomllib
import xml.etree.ElementTree
from pathlib import Path

import numpy as np

failures = []


def claim(holds, text):
    print(f"{'ok    ' if holds else 'FAILED'} {text}")
    if not holds:
        failures.append(text)


def has(package):
    found = importlib.util.find_spec(package) is not None
    if not found:
        print(f"SKIPPED {package} is not installed")
    return found


def batwing(*arguments):
    done = subprocess.run([BATWING, *map(str, arguments), "--json"], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"batwing {' '.join(map(str, arguments))}: {done.stderr}")
    return json.loads(done.stdout)


def orders_by_numpy():
    """The table as NumPy reads it, checked against what the program says of it."""
    batwing("export", TABLE, "--format", "npz", "--out", WORK / "orders.npz")
    table = dict(np.load(WORK / "orders.npz"))
    about = json.loads(table["header"].tobytes())
    said = batwing("import", WORK / "orders.npz")
    claim(about["format"] == "batwing-orders" and len(table["node_side"]) == said["nodes"], "numpy reads the .npz of a table")
    sums = np.bincount(table["order_node"], 0.5 * (table["s"] + table["p"]))
    claim(abs(sums - 1).max() < 1e-5, f"shares of every incidence sum to 1 within {abs(sums - 1).max():.1e}")
    batwing("export", TABLE, "--format", "json", "--out", WORK / "orders.json")
    text = json.loads((WORK / "orders.json").read_text())
    same = all(
        np.array_equal(np.float32([order[2] for node in text["nodes"] for order in node[pol]]), table[pol]) for pol in "sp"
    )
    claim(same, "JSON and .npz hold the same shares to the bit")
    return table, about["grid"]


def outgoing(table, grid, theta, phi):
    """Power and mean tangential direction of light from (theta, phi) in degrees, by side, from the node nearest to it."""
    theta, phi = np.radians([theta, phi])
    inside = np.cos(theta) < 0
    index = [grid["index_inner"], grid["index_outer"]]
    k = -(index[0] if inside else index[1]) * np.sin(theta) * np.array([np.cos(phi), np.sin(phi)])
    distance = (table["node_kx"] - k[0]) ** 2 + (table["node_ky"] - abs(k[1])) ** 2
    distance[table["node_side"] != (0 if inside else 1)] = np.inf
    orders = np.flatnonzero(table["order_node"] == np.argmin(distance))
    share = 0.5 * (table["s"][orders] + table["p"][orders])
    result = {}
    for side in (0, 1):
        here = table["order_side"][orders] == side
        weight = share[here]
        x = (k[0] + table["order"][orders][here] * grid["wavelength"] / grid["period"]) / index[side]
        power = weight.sum()
        result[side] = power, (weight * x).sum() / max(power, 1e-30), k[1] / index[side]
    return result


def scattering_by_radiance(table, grid):
    import pyradiance

    radiance = Path(pyradiance.__file__).parent
    check = radiance / "bin" / "checkBSDF"
    stated = batwing("check", TABLE)["header"]["estimated_error"]
    for kind, options, reach in (("klems", ["--samples", "256"], 0.2), ("tensortree", ["--tree-log2", "5"], 0.15)):
        file = WORK / f"{kind}.xml"
        written = batwing("export", TABLE, "--format", kind, "--out", file, *options)
        worst = max(f["worst_energy_difference"] for f in written["files"])
        count = sum(len(f["incidences"]) for f in written["files"])
        claim(worst < 1e-3, f"{kind}: the power of each of {count} incidences is kept to {worst:.1e}")
        said = {(t["from"], t["transport"]): t["most"] for t in batwing("import", file)["tables"]}
        report = subprocess.run([check, file], capture_output=True, text=True, check=True).stdout
        # Radiance's front, seen from the interior, is our outer side.
        rows = {"Interior Refl": ("outer", "reflected"), "Exterior Refl": ("inner", "reflected"),
                "Int->Ext Trans": ("outer", "transmitted"), "Ext->Int Trans": ("inner", "transmitted")}
        lines = report.splitlines()
        for row, (side, transport) in rows.items():
            line = next(l for l in lines if l.startswith(row))
            total = float(line.split("%")[-2].split()[-1])
            expected = 100 * said[(f"the {side} side", transport)]
            claim(abs(total - expected) < 0.3, f"checkBSDF {kind}: {row} {total} %, ours {expected:.1f} %")
        for line in lines[lines.index(next(l for l in lines if "Reciprocity" in l)) :]:
            print(f"       checkBSDF {kind}: {line}")
        own = written["reciprocity_of_the_table"]
        print(f"       beside that of the table itself: {100 * own['worst']:.1e} % at most, {100 * own['rms']:.1e} % rms")
        claim(own["worst"] < stated, f"the table itself is reciprocal to {own['worst']:.1e}, its estimated error {stated:.1e}")
        pane = f"void BSDF film\n6 0 {kind}.xml 0 1 0 .\n0\n0\n\nfilm polygon pane\n0\n0\n12 0 0 0 1 0 0 1 1 0 0 1 0\n"
        (WORK / "pane.rad").write_text(pane + "\nvoid glow sky\n0\n0\n4 1 1 1 0\n\nsky source all\n0\n0\n4 0 0 1 360\n")
        command = f"{radiance}/bin/oconv pane.rad > pane.oct && echo 0.5 0.5 2 0.1 0.2 -1 | {radiance}/bin/rtrace -h -w -ab 3 -ad 4000 pane.oct"
        seen = subprocess.run(command, shell=True, cwd=WORK, env={"RAYPATH": f".:{radiance}/lib", "PATH": "/usr/bin:/bin"}, capture_output=True, text=True)
        value = float(seen.stdout.split()[0]) if seen.stdout else 0.0
        claim(abs(value - 1) < 0.03, f"rtrace {kind}: a pane of it in uniform light of radiance 1 shows {value:.4f}")
        data = pyradiance.bsdf.load_file(str(file))
        for theta, phi in ((150, 40), (130, 250), (30, 100), (55, 310)):
            expected = outgoing(table, grid, theta, phi)
            drawn = pyradiance.bsdf.sample(data, float(theta), float(phi), 4000, pyradiance.bsdf.SAMPLE_ALL)
            for side, sign in ((0, -1), (1, 1)):
                power, x, y = expected[side]
                here = np.sign(drawn[:, 2]) == sign
                # A wrong sign of an axis would show as 0.5 and more; cells are up to 0.3 wide.
                if power > 0.2:
                    off = np.hypot(drawn[here, 0].mean() - x, drawn[here, 1].mean() - y)
                    close = off < reach and abs(here.mean() - power) < 0.15
                    claim(close, f"pyradiance {kind}: from {theta}, {phi} to side {side}: {here.mean():.3f} of {power:.3f}, mean direction off by {off:.3f}")


def flux(gammas, planes, values):
    """Integral over the sphere of values[plane, gamma], bilinear in the angles (degrees); planes go around once."""
    closed = np.concatenate([values, values[:1]])
    width = np.radians(np.diff([*planes, planes[0] + 360]))
    mean = 0.5 * (closed[:-1] + closed[1:])
    t0, t1 = np.radians(gammas[:-1]), np.radians(gammas[1:])
    slope = (mean[:, 1:] - mean[:, :-1]) / (t1 - t0)
    rings = mean[:, :-1] * (np.cos(t0) - np.cos(t1)) + slope * (np.sin(t1) - np.sin(t0) - (t1 - t0) * np.cos(t1))
    return (rings.sum(axis=1) * width).sum()


def far_field_by_others():
    bins = np.load(RESULTS / "far_field.npy")[0]
    polar = bins.shape[0]
    edges = np.cos(np.radians(np.arange(polar + 1) * 180 / polar))
    lumens = 1000 * (bins.mean(axis=1) * 2 * np.pi * (edges[:-1] - edges[1:])).sum()
    for ending in ("ies", "ldt"):
        for absolute in (False, True):
            file = WORK / f"far{'-absolute' if absolute else ''}.{ending}"
            batwing("export", RESULTS, "--format", ending, "--out", file, *(["--absolute"] if absolute else []))
            ours = batwing("import", file)
            claim(abs(ours["flux_lm"] - lumens) < 1e-3, f"{file.name}: {ours['flux_lm']:.3f} lm, the bins hold {lumens:.3f} lm")
            if importlib.util.find_spec("eulumdat"):
                import eulumdat

                read = eulumdat.Eulumdat.from_ies_file(str(file)) if ending == "ies" else eulumdat.Eulumdat.from_file(str(file))
                gammas, planes, values = map(np.array, (read.g_angles, read.c_angles, read.intensities))
                if planes[-1] >= 360:
                    planes, values = planes[:-1], values[:-1]
                # The package keeps cd per 1000 lm of the flux that it states.
                theirs = flux(gammas, planes, values * read.total_luminous_flux() / 1000)
                claim(abs(theirs / lumens - 1) < 1e-3, f"eulumdat reads {file.name}: {theirs:.3f} lm, {len(read.validate())} warnings")
    has("eulumdat")
    if importlib.util.find_spec("pyradiance"):
        import pyradiance

        tool = Path(pyradiance.__file__).parent / "bin" / "ies2rad"
        done = subprocess.run([tool, "-o", WORK / "far", WORK / "far.ies"], capture_output=True, text=True)
        numbers = (WORK / "far.dat").read_text().split() if (WORK / "far.dat").exists() else []
        claim(done.returncode == 0 and len(numbers) > polar, f"ies2rad reads far.ies: {len(numbers)} numbers")


def rays_by_numpy():
    said = batwing("export", DESIGN, "--format", "tm25", "--paths", "50000", "--out", WORK / "rays.tm25ray")
    data = (WORK / "rays.tm25ray").read_bytes()
    count = int.from_bytes(data[20:28], "little")
    lumens, watts = np.frombuffer(data, "<f4", 2, 12)
    flags = np.frombuffer(data, "<i4", 8, 256)
    rays = np.frombuffer(data, "<f4", offset=36288).reshape(count, 7)
    claim(data[:4] == b"TM25" and count == said["rays"] and list(flags) == [1, 1, 1, 0, 0, 0, 0, 0], f"numpy reads {count} TM-25 rays")
    total = rays[:, 6].sum(dtype=float)
    claim(abs(total / watts - 1) < 1e-6 and abs(total - said["escaped_w"]) < 1e-5, f"their flux is {total:.6f} W, header {watts:.6f} W, ledger {said['escaped_w']:.6f} W")
    claim(abs(np.linalg.norm(rays[:, 3:6], axis=1) - 1).max() < 1e-5, "directions are unit vectors")
    batwing("import", WORK / "rays.tm25ray", "--out", WORK / "rays.ray")
    other = (WORK / "rays.ray").read_bytes()
    same = np.frombuffer(other, "<f4", 8 * count, 44).reshape(count, 8)
    batwing("import", WORK / "rays.tm25ray", "--format", "speos-ray", "--out", WORK / "speos.ray")
    speos = np.frombuffer((WORK / "speos.ray").read_bytes(), "<f4")
    header, columns = speos[:7], speos[7:].reshape(count, 8)
    claim(
        abs(header[0] / total - 1) < 1e-6 and np.allclose(columns[:, :6], rays[:, :6], atol=1e-6)
        and np.allclose(columns[:, 7], rays[:, 6]) and len(set(columns[:, 6])) == 1,
        f"numpy reads the same rays from the Speos file, {columns[0, 6]:.1f} nm",
    )
    batwing("import", WORK / "speos.ray", "--out", WORK / "rays.sdf")
    zemax = (WORK / "rays.sdf").read_bytes()
    columns = np.frombuffer(zemax, "<f4", offset=208).reshape(count, 8)
    claim(
        list(np.frombuffer(zemax, "<u4", 2)) == [1010, count] and list(np.frombuffer(zemax, "<u4", 2, 192)) == [2, 0]
        and np.allclose(columns[:, :7], rays, atol=1e-6),
        f"numpy reads the same rays from the Zemax file, {columns[0, 7]:.4f} um",
    )
    claim(other[:4] == b"LTRF" and other[-7:] == b"LTRFEND" and np.allclose(same[:, :7], rays, atol=1e-6) and len(set(same[:, 7])) == 1, "numpy reads the same rays from the LightTools file")


def geometry_by_others():
    for ending in ("stl", "obj"):
        said = batwing("export", DESIGN, "--format", ending, "--out", WORK / f"dome.{ending}")
        if ending == "stl":
            volume = said["bodies"][0]["volume_mm3"]
    if has("trimesh"):
        import trimesh

        mesh = trimesh.load(WORK / "dome.stl")
        claim(mesh.is_watertight and mesh.is_winding_consistent and mesh.euler_number == 2, f"trimesh: the STL is closed, {len(mesh.faces)} triangles")
        claim(abs(mesh.volume / volume - 1) < 1e-5, f"trimesh: volume {mesh.volume:.6f} mm³, ours {volume:.6f}")
        both = trimesh.load(WORK / "dome.obj", force="mesh")
        claim(both.is_watertight and len(both.split()) == 2, "trimesh: the OBJ holds two closed bodies")
        mesh.export(WORK / "dome-only.obj")
    if has("ezdxf"):
        import ezdxf

        for design in (DESIGN, DESIGN.with_name("bare-dome.toml")):
            for ending in ("dxf", "svg"):
                batwing("export", design, "--format", ending, "--out", WORK / f"meridian.{ending}")
            drawing = ezdxf.readfile(WORK / "meridian.dxf")
            lines, arcs = (drawing.modelspace().query(kind) for kind in ("LINE", "ARC"))
            claim(not drawing.audit().errors and len(lines) + len(arcs) > 2, f"ezdxf: {design.stem} in {len(lines)} lines and {len(arcs)} arcs, no errors")
            centres = sorted((arc.dxf.center.x, arc.dxf.center.y, arc.dxf.radius) for arc in arcs)
            svg_lines, svg_arcs = meridian_of(WORK / "meridian.svg")
            same = len(svg_arcs) == len(centres) and np.allclose(sorted(svg_arcs), centres, atol=1e-6)
            claim(same and svg_lines == len(lines), f"the SVG of {design.stem} has as many lines, and the same arcs by their ends and sense")
    if has("mitsuba") and (WORK / "dome-only.obj").exists():
        import mitsuba

        mitsuba.set_variant("scalar_rgb")
        # The dome as a luminous body, seen in parallel light: the lit part of a square of 4 mm x 4 mm is its silhouette.
        radius = np.hypot(*mesh.vertices[:, :2].T).max()
        meridian = np.unique(np.round([v for v in mesh.vertices if abs(v[1]) < 1e-9 and v[0] > -1e-9], 9), axis=0)[:, ::2]
        upper = np.array([(r, meridian[meridian[:, 0] == r, 1].max()) for r in np.unique(meridian[:, 0])])
        for name, origin, up, area in (
            ("above", [0, 0, 9], [0, 1, 0], np.pi * radius**2),
            ("the side", [0, -9, 0], [0, 0, 1], 2 * steps_area(upper)),
        ):
            look = mitsuba.ScalarTransform4f().look_at(origin, [0, 0, 0], up).scale([2, 2, 1])
            scene = mitsuba.load_dict({
                "type": "scene", "integrator": {"type": "path"},
                "dome": {"type": "obj", "filename": str(WORK / "dome-only.obj"), "emitter": {"type": "area", "radiance": 1.0}},
                "sensor": {"type": "orthographic", "to_world": look, "sampler": {"type": "independent", "sample_count": 16},
                           "film": {"type": "hdrfilm", "width": 256, "height": 256, "rfilter": {"type": "box"}}},
            })
            seen = 16 * np.array(mitsuba.render(scene)).mean()
            claim(abs(seen / area - 1) < 5e-3, f"mitsuba: the dome seen from {name} covers {seen:.4f} mm², its outline {area:.4f} mm²")


def solids_by_opencascade():
    """STEP of the design with steps, of a dome and a lens of arcs, and of one with solids, in the kernel of CAD programs."""
    from step_bodies import copies, volume

    def judged(design, name, expected):
        """Copies of every body, its volume (of a sheet its area), and a box around one of them."""
        file = WORK / f"{name}.step"
        said = batwing("export", design, "--out", file)
        first = file.read_bytes()
        batwing("export", design, "--out", file)
        claim(file.read_bytes() == first, f"the STEP of {name} has the same bytes every time")
        found = copies(file)
        names = [copy["name"] for copy in found]
        claim({n: names.count(n) for n in names} == {n: e[0] for n, e in expected.items()}, f"OpenCascade: {name} holds {len(names)} copies of {len(expected)} bodies")
        claim({b["body"]: b["copies"] for b in said["bodies"]} == {n: e[0] for n, e in expected.items()}, f"and the program says so of {name}")
        whole = [copy["valid"] and (copy["closed"] if copy["solids"] else not copy["closed"]) for copy in found]
        claim(all(whole), f"OpenCascade: all shapes of {name} are valid, and its solids closed")
        off = max(abs(copy["measure"] / expected[copy["name"]][1] - 1) for copy in found)
        claim(off < 1e-9, f"OpenCascade: volumes of {name} are those in closed form within {off:.1e}")
        boxes = [(n, e[2]) for n, e in expected.items() if len(e) == 3]
        near = all(any(np.allclose(copy["box"], box, rtol=0, atol=1e-7) for copy in found if copy["name"] == n) for n, box in boxes)
        claim(near and boxes, f"OpenCascade: {', '.join(n for n, _ in boxes)} of {name} stand where they should")
        return found

    design = tomllib.loads(DESIGN.read_text())
    dome, elements, pitch = design["dome"], design["elements"], design["array"]["pitch_mm"]
    sphere, rim, width = dome["sphere_radius_mm"], 0.5 * dome["width_mm"], 1e-3 * elements["width_um"]
    height = lambda r: np.sqrt(sphere**2 - r**2) - (sphere - dome["height_mm"])
    rings = width * np.arange(elements["count"])
    steps = sum(np.pi * (min(r + width, rim) ** 2 - r**2) * height(r) for r in rings)
    box = design["led"]["size_mm"] + [design["led"]["height_mm"]]
    low, high = -0.5 * pitch - rim, -0.5 * pitch + rim
    found = judged(DESIGN, design["name"], {
        "dome": (4, steps, [low, low, 0, high, high, dome["height_mm"]]),
        "led": (4, np.prod(box)), "mirror": (1, (2 * pitch) ** 2),
    })
    faces = 3 * elements["count"] + 3
    claim(found[0]["faces"] == faces, f"a plane and two halves of a cylinder a step, {faces} faces of the dome in all")

    # An arc about the axis and a bead; a lens with a blunt tip and a hollow below.
    curve = [[0, 1.2], [1.4, 0.7, -0.18], [1.4, 0.3, -1.0], [1.5, 0]]
    lens = [[0, 0.8], [1.2, 0.2, -0.15], [1.2, 0], [0.9, 0], [0, 0.3, 0.1]]
    (WORK / "curved.toml").write_text(
        f'name = "curved"\n[dome]\nmeridian_mm = {curve}\n[silicone]\nindex = 1.41\n[mirror]\nkind = "specular"\nreflectance = 0.9\nextent = "package"\n'
        '[led]\nsize_mm = [1, 1]\nheight_mm = 0.3\nreflectance = 0.5\nreflection = "specular"\ntilt_deg = [3, 0]\n[array]\ncolumns = 1\nrows = 1\npitch_mm = 8\n'
        '[light]\nwavelength_nm = 550\n[receiver]\nplane_height_mm = 9\n'
        f'[[solids]]\nname = "lens"\nkind = "meridian"\nmeridian_mm = {lens}\naxis = [1, 0, 0]\nposition_mm = [0, 0, 4]\nmedium = {{ index = 1.5 }}\n'
    )
    tilt = np.radians(3)
    # Sides go on to the bottom under the tilted box: a wedge below half of its width on the average.
    led = 0.3 + 0.5 * np.tan(tilt)
    judged(WORK / "curved.toml", "curved", {"dome": (1, volume(curve)), "led": (1, led), "lens": (1, volume(lens), [0, -1.2, 2.8, 0.8, 1.2, 5.2]), "mirror": (1, np.pi * 1.5**2)})

    other = DESIGN.with_name("solids.toml")
    design = tomllib.loads(other.read_text())
    dome, solids = design["dome"], {solid["name"]: solid for solid in design["solids"]}
    rim, drop = 0.5 * dome["width_mm"], dome["sphere_radius_mm"] - dome["height_mm"]
    edge = np.sqrt(dome["sphere_radius_mm"] ** 2 - rim**2) - drop
    cap = dome["height_mm"] - edge
    product = lambda name: np.prod(solids[name]["size_mm"])
    bubble, pipe = solids["bubble"]["radius_mm"], solids["pipe"]
    judged(other, "solids", {
        "dome": (4, np.pi * cap * (3 * rim**2 + cap**2) / 6 + np.pi * rim**2 * edge), "led": (4, np.prod(design["led"]["size_mm"]) * design["led"]["height_mm"]),
        "phosphor": (4, product("phosphor")), "bubble": (4, 4 / 3 * np.pi * bubble**3), "baffle": (4, product("baffle")),
        "lens": (4, volume(solids["lens"]["meridian_mm"])), "plate": (1, product("plate")),
        "pipe": (1, np.pi * pipe["radius_mm"] ** 2 * pipe["height_mm"], [-4.4, -8, 4.1, -3.6, 8, 4.9]),
        "fence": (1, product("fence"), [-8, -0.1, 0, 8, 0.1, 1.5]), "mirror": (1, 16.0**2),
    })


def meridian_of(file):
    """Number of lines, and centre and radius of every arc of an SVG, from ends, radius and flags as SVG defines them."""
    lines, arcs = 0, []
    for path in xml.etree.ElementTree.parse(file).getroot().iter("{http://www.w3.org/2000/svg}path"):
        words = path.get("d").split()
        start, end = np.array(words[1:3], float), np.array(words[-2:], float)
        if words[3] == "L":
            lines += 1
            continue
        radius, (large, sweep) = float(words[4]), (int(words[7]), int(words[8]))
        along = end - start
        middle, half = 0.5 * (start + end), 0.5 * np.hypot(*along)
        # The centre lies to the left of the way for a short arc in the positive sense.
        left = np.array([-along[1], along[0]]) / np.hypot(*along)
        sign = 1 if large != sweep else -1
        arcs.append((*(middle + sign * left * np.sqrt(radius**2 - half**2)), radius))
    return lines, arcs


def light_by_mitsuba():
    """Light through the exported dome, smooth and with its relief: what escapes upwards and its far field, traced by others and by this program."""
    import mitsuba
    import trimesh

    from dome_light import intensities

    mitsuba.set_variant("scalar_rgb")
    for name in (DESIGN.with_name("bare-dome.toml"), DESIGN):
        text = name.read_text()
        for old, new in (("columns = 2", "columns = 1"), ("rows = 2", "rows = 1"), ('extent = "array"', 'extent = "package"')):
            assert old in text, f"{name}: {old}"
            text = text.replace(old, new)
        (WORK / "alone.toml").write_text(text)
        design = tomllib.loads(text)
        batwing("export", WORK / "alone.toml", "--format", "stl", "--chord-error", "0.1", "--out", WORK / "alone.stl")
        trimesh.load(WORK / "alone.stl").export(WORK / "alone.obj")
        said = batwing("run", WORK / "alone.toml", "--model", "geometric", "--paths", "4000000", "--out", WORK / "alone", "--quiet")
        model, figures = next(iter(said["designs"][design["name"]].items()))
        ours = figures["power_ledger"]["escaped_up"]
        bins = np.load(WORK / "alone" / design["name"] / model / "far_field.npy")
        rings, batches = bins.shape[1] // 2, 16
        found, solid = intensities(mitsuba, WORK / "alone.obj", design, rings, batches)
        flux = (found * solid).sum(axis=1)
        value, error = flux.mean(), flux.std(ddof=1) / np.sqrt(batches)
        off = (value - ours["value"]) / np.hypot(error, ours["standard_error"])
        claim(abs(off) < 4, f"mitsuba: {value:.4f} ± {error:.4f} of the light of {design['name']} escapes upwards, "
                            f"ours {ours['value']:.4f} ± {ours['standard_error']:.4f}: {off:+.1f} standard errors")
        mean, spread = found.mean(axis=0), found.std(axis=0, ddof=1) / np.sqrt(batches)
        own, own_error = bins[0][:rings].mean(axis=1), np.sqrt((bins[1][:rings] ** 2).sum(axis=1)) / bins.shape[2]
        off = (mean - own) / np.hypot(spread, own_error)
        # Errors from 16 batches: squares are 15/13 on the mean.
        claim((off**2).mean() < 2, f"mitsuba: {rings} rings of its far field differ by {np.sqrt((off**2).mean()):.2f} standard errors rms, {abs(off).max():.1f} at most")


def steps_area(upper):
    """Area under a staircase given by the upper end of every riser: each tread has the height of its outer end."""
    return (np.diff(upper[:, 0]) * upper[1:, 1]).sum()


def images_by_openexr():
    import OpenEXR

    with OpenEXR.File(str(RESULTS / "far_field.exr")) as file:
        channels = file.channels()
        array = np.load(RESULTS / "far_field.npy")
        names = list(channels)
        close = any(np.allclose(channels[n].pixels, array[0], rtol=1e-5) for n in names if channels[n].pixels.shape == array[0].shape)
        claim(close, f"OpenEXR reads far_field.exr (channels {names}) as numpy reads far_field.npy")


def designs_by_jsonschema():
    import tomllib

    import jsonschema

    schema = batwing("schema")
    jsonschema.Draft202012Validator.check_schema(schema)
    judge = jsonschema.Draft202012Validator(schema)
    files = sorted(DESIGN.parent.glob("*.toml"))
    designs = [tomllib.loads(file.read_text()) for file in files]
    wrong = [(f.name, e.message) for f, d in zip(files, designs) for e in judge.iter_errors(d)]
    claim(not wrong and len(files) > 5, f"the JSON Schema of the design file admits the {len(files)} shipped designs {wrong}")
    good = designs[0]
    bad = [
        good | {"colour": "red"},
        {key: value for key, value in good.items() if key != "led"},
        good | {"led": good["led"] | {"size_mm": [1.0]}},
        good | {"mirror": good["mirror"] | {"kind": "shiny"}},
        good | {"led": good["led"] | {"height_mm": True}},
        good | {"receivers": [{"name": "a", "kind": "plane", "bins": [1, 1]}]},
    ]
    claim(all(not judge.is_valid(design) for design in bad), f"and refuses {len(bad)} wrong ones")


BATWING, TABLE, RESULTS, DESIGN, WORK = (Path(a) for a in sys.argv[1:6])
WORK.mkdir(parents=True, exist_ok=True)
orders, grid = orders_by_numpy()
if has("pyradiance"):
    scattering_by_radiance(orders, grid)
if has("jsonschema"):
    designs_by_jsonschema()
far_field_by_others()
rays_by_numpy()
geometry_by_others()
if has("OCP"):
    solids_by_opencascade()
if all(importlib.util.find_spec(package) for package in ("mitsuba", "trimesh")):
    light_by_mitsuba()
if has("OpenEXR"):
    images_by_openexr()
print(f"{len(failures)} claims failed" if failures else "every claim holds")
sys.exit(bool(failures))
