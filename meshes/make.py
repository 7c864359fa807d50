"""Remakes every .msh of this folder from the .geo beside it.

    pip install gmsh && python3 meshes/make.py

The numbers of the nodes are shuffled (with a fixed seed), because a result that depends on the
order of a mesh's vertices is wrong, and a mesh in tidy order would hide it.
"""

import random
from pathlib import Path

import gmsh

FOLDER = Path(__file__).parent

gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
for geometry in sorted(FOLDER.glob("*.geo")):
    gmsh.open(str(geometry))
    gmsh.model.mesh.generate(gmsh.model.getDimension())
    tags = [int(tag) for tag in gmsh.model.mesh.getNodes()[0]]
    used = {int(tag) for tag in gmsh.model.mesh.getElements(gmsh.model.getDimension())[2][0]}
    shuffled = sorted(used)
    random.Random(geometry.stem).shuffle(shuffled)
    new = dict(zip(shuffled, range(1, len(shuffled) + 1), strict=True))
    spare = len(shuffled)
    for tag in tags:
        if tag not in new:  # a construction point; not saved, as it lies on no physical group
            spare += 1
            new[tag] = spare
    gmsh.model.mesh.renumberNodes(tags, [new[tag] for tag in tags])
    gmsh.write(str(geometry.with_suffix(".msh")))
gmsh.finalize()
