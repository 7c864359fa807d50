def write_vtu(path, at, fields):
    """Coordinates of the nodes of each cell, in VTK's order, and the values there."""
    shape, at = at.shape[:2], at.reshape(-1, 3)
{% if output.is_continuous %}
    # Continuous functions: cells share nodes at the same place.
    _, first, nodes = np.unique(np.round(at/np.ptp(at), 9), axis=0, return_index=True, return_inverse=True)
{% else %}
    first = nodes = np.arange(len(at))  # each cell has its own nodes
{% endif %}

    def array(name, values, kind="Float64"):
        size = 1 if values.ndim == 1 else values.shape[1]
        text = " ".join(map(repr, values.ravel().tolist()))
        return f"<DataArray type='{kind}' Name='{name}' NumberOfComponents='{size}' format='ascii'>{text}</DataArray>"

    data = [array(name, values.reshape(len(at), -1)[first]) for name, values in fields.items()]
    Path(path).write_text(
        "<VTKFile type='UnstructuredGrid' version='1.0' byte_order='LittleEndian'><UnstructuredGrid>"
        f"<Piece NumberOfPoints='{len(first)}' NumberOfCells='{shape[0]}'>"
        f"<Points>{array('points', at[first])}</Points><Cells>"
        + array("connectivity", nodes.reshape(-1), "Int64")
        + array("offsets", shape[1]*np.arange(1, shape[0] + 1), "Int64")
        + array("types", np.full(shape[0], {{ output.kind }}), "UInt8")
        + f"</Cells><PointData>{''.join(data)}</PointData></Piece></UnstructuredGrid></VTKFile>\n"
    )


