"""Writers of results, in the plainest form of each format, with nothing of faceoff's. A writer makes of a model some files."""

VTK = {"triangle": 5, "quad": 9, "tetra": 10}
MSH = {"triangle": 2, "quad": 3, "tetra": 4}


def number(v):
    return repr(float(v)).replace("inf", "inf")


def rows(values):
    return "\n".join(" ".join(map(number, row)) for row in values) + "\n"


def vtu_of(points, cells, fields):
    def arrays(on):
        return "".join(
            f'<DataArray type="Float64" Name="{f.name}" NumberOfComponents="{len(f.values[0])}" format="ascii">\n'
            f"{rows(f.values)}</DataArray>\n"
            for f in fields if f.on == on
        )

    at, offsets = 0, []
    for _, numbers in cells:
        at += len(numbers)
        offsets.append(str(at))
    return (
        '<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian"><UnstructuredGrid>\n'
        f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(cells)}">\n'
        f'<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">\n{rows(points)}</DataArray></Points>\n'
        '<Cells><DataArray type="Int64" Name="connectivity" format="ascii">\n'
        + "\n".join(" ".join(map(str, numbers)) for _, numbers in cells)
        + '\n</DataArray><DataArray type="Int64" Name="offsets" format="ascii">' + " ".join(offsets)
        + '</DataArray><DataArray type="UInt8" Name="types" format="ascii">'
        + " ".join(str(VTK[kind]) for kind, _ in cells)
        + f"</DataArray></Cells>\n<PointData>\n{arrays('points')}</PointData>\n<CellData>\n{arrays('cells')}</CellData>\n"
        "</Piece></UnstructuredGrid></VTKFile>\n"
    )


def vtu(model, name):
    return {name + ".vtu": vtu_of(model.points, model.cells, model.fields)}, name + ".vtu"


def pvd(model, name):
    files, sets = {}, []
    for k, (t, fields) in enumerate(model.steps):
        files[f"{name}-{k}.vtu"] = vtu_of(model.points, model.cells, fields)
        sets.append(f'<DataSet timestep="{0 if t is None else t!r}" file="{name}-{k}.vtu"/>')
    files[name + ".pvd"] = f'<VTKFile type="Collection" version="0.1"><Collection>{"".join(sets)}</Collection></VTKFile>\n'
    return files, name + ".pvd"


def pvtu(model, name):
    """Two pieces, each with points of its own."""
    half, files = len(model.cells) // 2, {}
    for k, chosen in enumerate((range(half), range(half, len(model.cells)))):
        used = sorted({v for c in chosen for v in model.cells[c][1]})
        place = {v: i for i, v in enumerate(used)}
        fields = []
        for f in model.fields:
            part = type(f)(f.name, f.on, [f.values[v] for v in (used if f.on == "points" else chosen)])
            fields.append(part)
        cells = [(model.cells[c][0], [place[v] for v in model.cells[c][1]]) for c in chosen]
        files[f"{name}_{k}.vtu"] = vtu_of([model.points[v] for v in used], cells, fields)
    arrays = {
        on: "".join(
            f'<PDataArray type="Float64" Name="{f.name}" NumberOfComponents="{len(f.values[0])}"/>'
            for f in model.fields if f.on == on
        )
        for on in ("points", "cells")
    }
    files[name + ".pvtu"] = (
        '<VTKFile type="PUnstructuredGrid" version="0.1" byte_order="LittleEndian"><PUnstructuredGrid GhostLevel="0">'
        '<PPoints><PDataArray type="Float64" NumberOfComponents="3"/></PPoints>'
        f"<PPointData>{arrays['points']}</PPointData><PCellData>{arrays['cells']}</PCellData>"
        f'<Piece Source="{name}_0.vtu"/><Piece Source="{name}_1.vtu"/></PUnstructuredGrid></VTKFile>\n'
    )
    return files, name + ".pvtu"


def vtk(model, name):
    def data(on):
        text = ""
        for f in model.fields:
            if f.on == on:
                head = f"VECTORS {f.name} double\n" if len(f.values[0]) == 3 else f"SCALARS {f.name} double 1\nLOOKUP_TABLE default\n"
                text += head + rows(f.values)
        return text and f"{'POINT' if on == 'points' else 'CELL'}_DATA {model.size(on)}\n{text}"

    total = sum(len(numbers) + 1 for _, numbers in model.cells)
    return {name + ".vtk": (
        "# vtk DataFile Version 3.0\nresult\nASCII\nDATASET UNSTRUCTURED_GRID\n"
        f"POINTS {len(model.points)} double\n{rows(model.points)}CELLS {len(model.cells)} {total}\n"
        + "".join(f"{len(numbers)} {' '.join(map(str, numbers))}\n" for _, numbers in model.cells)
        + f"CELL_TYPES {len(model.cells)}\n" + "".join(f"{VTK[kind]}\n" for kind, _ in model.cells)
        + data("points") + data("cells")
    )}, name + ".vtk"


def msh(model, name):
    text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n" + f"{len(model.points)}\n"
    text += "".join(f"{k + 1} {' '.join(map(number, p))}\n" for k, p in enumerate(model.points))
    text += f"$EndNodes\n$Elements\n{len(model.cells)}\n"
    text += "".join(
        f"{k + 1} {MSH[kind]} 2 1 1 {' '.join(str(v + 1) for v in numbers)}\n" for k, (kind, numbers) in enumerate(model.cells)
    )
    text += "$EndElements\n"
    for step, (t, fields) in enumerate(model.steps):
        for f in fields:
            part = "NodeData" if f.on == "points" else "ElementData"
            text += f'${part}\n1\n"{f.name}"\n1\n{t or 0.0!r}\n3\n{step}\n{len(f.values[0])}\n{len(f.values)}\n'
            text += "".join(f"{k + 1} {' '.join(map(number, row))}\n" for k, row in enumerate(f.values)) + f"$End{part}\n"
    return {name + ".msh": text}, name + ".msh"


def xdmf(model, name):
    kind = {"triangle": "Triangle", "quad": "Quadrilateral", "tetra": "Tetrahedron"}[model.cells[0][0]]

    def item(values, kind="Float"):
        text = rows(values) if kind == "Float" else "\n".join(" ".join(map(str, row)) for row in values) + "\n"
        more = 'Precision="8"' if kind == "Float" else 'NumberType="Int"'
        return f'<DataItem Dimensions="{len(values)} {len(values[0])}" {more} Format="XML">\n{text}</DataItem>'

    grids = ""
    for t, fields in model.steps:
        grids += (
            f'<Grid Name="g">{"" if t is None else f"<Time Value={chr(34)}{t!r}{chr(34)}/>"}'
            f'<Topology TopologyType="{kind}" NumberOfElements="{len(model.cells)}">'
            f'{item([numbers for _, numbers in model.cells], "Int")}</Topology>'
            f'<Geometry GeometryType="XYZ">{item(model.points)}</Geometry>'
        )
        for f in fields:
            what = "Scalar" if len(f.values[0]) == 1 else "Vector"
            on = "Node" if f.on == "points" else "Cell"
            grids += f'<Attribute Name="{f.name}" AttributeType="{what}" Center="{on}">{item(f.values)}</Attribute>'
        grids += "</Grid>"
    if len(model.steps) > 1:
        grids = f'<Grid Name="all" GridType="Collection" CollectionType="Temporal">{grids}</Grid>'
    return {name + ".xdmf": f'<Xdmf Version="3.0"><Domain>{grids}</Domain></Xdmf>\n'}, name + ".xdmf"


def medit(model, name):
    """Points alone, and no names."""
    kind = {"triangle": "Triangles", "quad": "Quadrilaterals", "tetra": "Tetrahedra"}[model.cells[0][0]]
    dim = 3 if kind == "Tetrahedra" else 2
    mesh = f"MeshVersionFormatted 2\nDimension {dim}\nVertices\n{len(model.points)}\n"
    mesh += "".join(f"{' '.join(map(number, p[:dim]))} 0\n" for p in model.points)
    mesh += f"{kind}\n{len(model.cells)}\n" + "".join(f"{' '.join(str(v + 1) for v in c)} 1\n" for _, c in model.cells) + "End\n"
    fields = [f for f in model.fields if f.on == "points"]
    types = " ".join("1" if len(f.values[0]) == 1 else "2" for f in fields)
    sol = f"MeshVersionFormatted 2\nDimension {dim}\nSolAtVertices\n{len(model.points)}\n{len(fields)} {types}\n"
    for k in range(len(model.points)):
        sol += " ".join(number(v) for f in fields for v in f.values[k][: dim if len(f.values[k]) > 1 else 1]) + "\n"
    return {name + ".mesh": mesh, name + ".sol": sol + "End\n"}, name + ".sol"


def table(model, name, keys, places):
    """CSV: points by numbers or by places, cells by their places."""
    fields = [f for f in model.fields if f.on == "points"]
    columns = [f"{f.name}{i if len(f.values[0]) > 1 else ''}" for f in fields for i in range(len(f.values[0]))]
    text = ",".join([*keys, *columns]) + "\n"
    for k in range(len(model.points)):
        text += ",".join([*places(k), *(number(v) for f in fields for v in f.values[k])]) + "\n"
    return {name + ".csv": text}, name + ".csv"


def csv_numbers(model, name):
    return table(model, name, ["vertex"], lambda k: [str(k)])


def csv_places(model, name):
    return table(model, name, ["x", "y", "z"], lambda k: map(number, model.points[k]))


WRITERS = [vtu, vtk, msh, xdmf, pvtu, medit, csv_numbers, csv_places]
OF_TIMES = [pvd, xdmf, msh]
# These are written by `mesh convert`, as the formats are binary.
CONVERTED = [".vtkhdf", ".med", ".cgns", ".exo", ".xdmf", ".vtu"]
