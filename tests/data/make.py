"""Makes the meshes of this folder: `python make.py`, with gmsh 4.15 from PyPI.

The big-endian ones are packed here, as Gmsh writes the byte order of the machine it runs on.
"""

import struct

import gmsh


def square(extra=lambda: None):
    gmsh.initialize()
    gmsh.option.setNumber("General.Verbosity", 0)
    gmsh.option.setNumber("Mesh.MeshSizeMin", 0.5)
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.5)
    gmsh.model.occ.addRectangle(0, 0, 0, 1, 1)
    gmsh.model.occ.synchronize()
    gmsh.model.addPhysicalGroup(1, [1], 1, name="bottom side")
    gmsh.model.addPhysicalGroup(1, [2, -4], 7, name="sides")
    gmsh.model.addPhysicalGroup(1, [3], 3)
    gmsh.model.addPhysicalGroup(2, [1], 1, name="Fläche")
    gmsh.model.addPhysicalGroup(0, [1], 9, name="corner")
    extra()
    gmsh.model.mesh.generate(2)


def save(name, version, binary=False, **options):
    gmsh.option.setNumber("Mesh.MshFileVersion", version)
    gmsh.option.setNumber("Mesh.Binary", int(binary))
    for option, value in options.items():
        gmsh.option.setNumber(f"Mesh.{option}", value)
    gmsh.write(name)


def periodic():
    shift = [1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
    gmsh.model.mesh.setPeriodic(1, [2], [4], shift)


square()
for version in (1.0, 2.2, 4.0, 4.1):
    save(f"square-{version}.msh", version)
for version in (2.2, 4.1):
    save(f"square-{version}-binary.msh", version, binary=True)
save("square-parametric.msh", 4.1, SaveParametric=1)
save("square-parametric-2.2.msh", 2.2, SaveParametric=1)
gmsh.finalize()

square(periodic)
save("periodic.msh", 4.1)
save("periodic-binary.msh", 4.1, binary=True)
save("periodic-2.2.msh", 2.2)
gmsh.finalize()

square()
gmsh.option.setNumber("Mesh.PartitionCreateGhostCells", 1)
gmsh.model.mesh.partition(2)
save("parts.msh", 4.1)
save("parts-binary.msh", 4.1, binary=True)
save("parts-2.2.msh", 2.2)
gmsh.finalize()

gmsh.initialize()
gmsh.option.setNumber("General.Verbosity", 0)
gmsh.option.setNumber("Mesh.MeshSizeMin", 2)
gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
gmsh.model.occ.synchronize()
gmsh.model.addPhysicalGroup(3, [1], 2**31 - 1, name="all of it")
gmsh.model.addPhysicalGroup(2, [1, 3], 5, name="two sides")
gmsh.model.mesh.generate(3)
save("box.msh", 4.1, binary=True)
gmsh.model.mesh.setOrder(2)
view = gmsh.view.add("a b")
nodes = gmsh.model.mesh.getNodes()[0]
gmsh.view.addHomogeneousModelData(
    view,
    2,
    "",
    "NodeData",
    nodes[:5],
    [0.1 * n for n in range(15)],
    time=0.5,
    numComponents=3,
)
save("box-quadratic.msh", 4.1, SaveAll=1)
gmsh.option.setNumber("PostProcessing.SaveMesh", 0)
gmsh.view.write(view, "box-quadratic.msh", append=True)
gmsh.finalize()

POINTS = [(7, 0.0, 0.0), (9, 1.0, 0.0), (2**40, 1.0, 1.0), (8, 0.1, 1.0)]


def big_v41():
    def ints(*values):
        return struct.pack(f">{len(values)}i", *values)

    def sizes(*values):
        return struct.pack(f">{len(values)}Q", *values)

    def floats(*values):
        return struct.pack(f">{len(values)}d", *values)

    out = b"$MeshFormat\n4.1 1 8\n" + ints(1) + b"\n$EndMeshFormat\n"
    out += b'$PhysicalNames\n1\n2 6 "plate"\n$EndPhysicalNames\n'
    out += (
        b"$Entities\n"
        + sizes(0, 0, 1, 0)
        + ints(4)
        + floats(0, 0, 0, 1, 1, 0)
        + sizes(1)
        + ints(-6)
        + sizes(0)
    )
    out += (
        b"\n$EndEntities\n$Nodes\n" + sizes(1, 4, 7, 2**40) + ints(2, 4, 0) + sizes(4)
    )
    out += sizes(*(p[0] for p in POINTS)) + b"".join(
        floats(p[1], p[2], 0) for p in POINTS
    )
    out += b"\n$EndNodes\n$Elements\n" + sizes(1, 2, 11, 12) + ints(2, 4, 2) + sizes(2)
    out += sizes(11, 7, 9, 2**40) + sizes(12, 7, 2**40, 8) + b"\n$EndElements\n"
    return out


def big_v22():
    def ints(*values):
        return struct.pack(f">{len(values)}i", *values)

    out = b"$MeshFormat\n2.2 1 8\n" + ints(1) + b"\n$EndMeshFormat\n"
    out += b'$PhysicalNames\n1\n2 6 "plate"\n$EndPhysicalNames\n$Nodes\n4\n'
    tags = [7, 9, 10, 8]
    for tag, (_, x, y) in zip(tags, POINTS):
        out += ints(tag) + struct.pack(">3d", x, y, 0)
    # One element a block, as Gmsh writes them.
    out += (
        b"\n$EndNodes\n$Elements\n2\n"
        + ints(2, 1, 2, 11, 6, 4, 7, 9, 10)
        + ints(2, 1, 2, 12, 6, 4, 7, 10, 8)
    )
    return out + b"\n$EndElements\n"


for name, data in (
    ("big-endian-4.1.msh", big_v41()),
    ("big-endian-2.2.msh", big_v22()),
):
    with open(name, "wb") as file:
        file.write(data)
