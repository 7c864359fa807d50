"""Meshes of Gmsh, written by Gmsh and by meshio in formats of text: foreign.py FOLDER

Prints as JSON, for each file, its cells by Gmsh's number of their kind, each as the coordinates of its nodes in
Gmsh's order."""

import json
import sys

import gmsh
import meshio

LINEAR = {1: ("line", 2), 2: ("triangle", 3), 3: ("quad", 4), 4: ("tetra", 4), 5: ("hexahedron", 8), 6: ("wedge", 6)}
folder = sys.argv[1]
seen = {}


def cells():
    tags, points, _ = gmsh.model.mesh.getNodes()
    at = {int(tag): points[3 * i : 3 * i + 3] for i, tag in enumerate(tags)}
    found = {}
    for kind, _, nodes in zip(*gmsh.model.mesh.getElements()):
        width = gmsh.model.mesh.getElementProperties(kind)[3]
        rows = nodes.reshape(-1, width)
        found[str(kind)] = sorted(";".join(" ".join(f"{x + 0.0:.4f}" for x in at[int(n)]) for n in row) for row in rows)
    return found


def write(name, suffixes):
    for suffix in suffixes:
        path = f"{folder}/{name}.{suffix}"
        gmsh.write(path)
        seen[path] = cells()


def model(build, name, order):
    gmsh.clear()
    build()
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setOrder(order)
    suffixes = ["unv", "inp", "bdf"] + (["su2"] if order == 1 else [])
    # Of other cells Gmsh writes rows that do not fit the keyword, or none.
    write(f"{name}{order}", suffixes + (["mesh"] if name == "tetrahedra" else []))
    if order == 1:
        tags, points, _ = gmsh.model.mesh.getNodes()
        place = {int(tag): i for i, tag in enumerate(tags)}
        blocks = [
            (LINEAR[kind][0], [[place[int(n)] for n in row] for row in nodes.reshape(-1, LINEAR[kind][1])])
            for kind, _, nodes in zip(*gmsh.model.mesh.getElements())
            if kind in LINEAR
        ]
        plain = meshio.Mesh(points.reshape(-1, 3), blocks)
        for suffix, form in (("meshb", "medit"), ("inp", "abaqus"), ("avs", "avsucd"), ("bdf", "nastran")):
            path = f"{folder}/{name}-meshio.{suffix}"
            meshio.write(path, plain, file_format=form)
            seen[path] = cells()


def box(recombine, hexahedra):
    def build():
        base = gmsh.model.geo.addPoint
        corners = [base(0, 0, 0), base(1, 0, 0), base(1, 0.5, 0), base(0, 0.5, 0)]
        lines = [gmsh.model.geo.addLine(corners[i], corners[(i + 1) % 4]) for i in range(4)]
        surface = gmsh.model.geo.addPlaneSurface([gmsh.model.geo.addCurveLoop(lines)])
        for line in lines:
            gmsh.model.geo.mesh.setTransfiniteCurve(line, 3)
        gmsh.model.geo.mesh.setTransfiniteSurface(surface)
        if hexahedra:
            gmsh.model.geo.mesh.setRecombine(2, surface)
        layers = [2] if recombine else []
        solid = gmsh.model.geo.extrude([(2, surface)], 0, 0, 0.25, layers, recombine=recombine)
        gmsh.model.geo.synchronize()
        gmsh.model.addPhysicalGroup(2, [surface], 4, name="bottom")
        gmsh.model.addPhysicalGroup(3, [solid[1][1]], 2, name="all of it")

    return build


gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
gmsh.option.setNumber("Mesh.SaveAll", 1)
gmsh.option.setNumber("Mesh.SecondOrderIncomplete", 1)
gmsh.option.setNumber("Mesh.BdfFieldFormat", 2)
for order in (1, 2):
    model(box(False, False), "tetrahedra", order)
    model(box(True, False), "prisms", order)
    model(box(True, True), "hexahedra", order)
print(json.dumps(seen))
