# SPDX-License-Identifier: MIT OR Apache-2.0
"""Bodies of a STEP file as Open CASCADE imports them, and volumes of revolution in closed form."""

import math

from OCP.Bnd import Bnd_Box
from OCP.BRep import BRep_Tool
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.GProp import GProp_GProps
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_Label, TDF_ChildIterator
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_FACE, TopAbs_SHELL, TopAbs_SOLID
from OCP.TopExp import TopExp_Explorer
from OCP.XCAFDoc import XCAFDoc_DocumentTool, XCAFDoc_ShapeTool


def copies(file):
    """Copies of bodies in a STEP file: name, kind, valid and closed, volume, box around it."""
    document = TDocStd_Document(TCollection_ExtendedString("step"))
    reader = STEPCAFControl_Reader()
    reader.SetNameMode(True)
    assert reader.ReadFile(str(file)).name == "IFSelect_RetDone", file
    assert reader.Transfer(document), file

    def all_of(shape, kind):
        explorer, parts = TopExp_Explorer(shape, kind), []
        while explorer.More():
            parts.append(explorer.Current())
            explorer.Next()
        return parts

    def name_of(label):
        name = TDataStd_Name()
        return name.Get().ToExtString() if label.FindAttribute(TDataStd_Name.GetID_s(), name) else ""

    tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    labels = TDF_ChildIterator(tool.Label(), True)
    found = []
    while labels.More():
        label = labels.Value()
        labels.Next()
        if not XCAFDoc_ShapeTool.IsComponent_s(label):
            continue
        part, shape = TDF_Label(), XCAFDoc_ShapeTool.GetShape_s(label)
        assert XCAFDoc_ShapeTool.GetReferredShape_s(label, part)
        solids = len(all_of(shape, TopAbs_SOLID))
        closed = all(BRep_Tool.IsClosed_s(shell) for shell in all_of(shape, TopAbs_SHELL))
        box, props = Bnd_Box(), GProp_GProps()
        BRepBndLib.AddOptimal_s(shape, box, False, False)
        if solids:
            BRepGProp.VolumeProperties_s(shape, props, 1e-12, False, False)
        else:
            BRepGProp.SurfaceProperties_s(shape, props)
        low, high = box.CornerMin(), box.CornerMax()
        found.append({
            "name": name_of(part), "copy": name_of(label), "solids": solids, "faces": len(all_of(shape, TopAbs_FACE)),
            "valid": BRepCheck_Analyzer(shape).IsValid(), "closed": closed, "measure": props.Mass(),
            "box": [low.X(), low.Y(), low.Z(), high.X(), high.Y(), high.Z()],
        })
    return found


def arc(start, end, bulge):
    """Centre, radius, and angles from start to end of an arc by its bulge."""
    turn = 4 * math.atan(bulge)
    along = (end[0] - start[0], end[1] - start[1])
    to_left = 0.5 / math.tan(turn / 2)
    centre = (0.5 * (start[0] + end[0]) - along[1] * to_left, 0.5 * (start[1] + end[1]) + along[0] * to_left)
    first = math.atan2(start[1] - centre[1], start[0] - centre[0])
    return centre, math.dist(start, centre), first, first + turn


def volume(rows):
    """Volume under a meridian of rows [r, z] and [r, z, bulge] down to the plane z = 0 or back to the axis."""
    total = 0.0
    for start, row in zip(rows, rows[1:]):
        if len(row) == 2:
            r, s = start[0], row[0]
            total += math.pi / 3 * (r * r + r * s + s * s) * (start[1] - row[1])
            continue
        (c, _), radius, first, last = arc(start[:2], row[:2], row[2])

        def integral(t):
            # Of (c + R cos t)^2 cos t.
            sin, cos = math.sin(t), math.cos(t)
            return c * c * sin + c * radius * (t + sin * cos) + radius**2 * (sin - sin**3 / 3)

        total -= math.pi * radius * (integral(last) - integral(first))
    return total
