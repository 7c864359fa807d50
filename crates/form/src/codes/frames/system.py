

{% if has_state %}
def state(at, directions):
    """Values of all dofs that depend on their places and directions alone, so that every code has the same."""
    phase = at @ np.arange(1.0, 1 + at.shape[1])
    return (directions*(1 + np.sin(phase[:, None] + np.arange(3))/16)).sum(axis=1)


{% endif %}
def write_system(A, r, held, goal, {{ "values, " if not has_state }}at, directions, names):
    """Writes the {{ "system of Newton's method at that state" if has_state else "first system of Newton's method" }}, A (rows, columns, entries) and -r, with rows of the identity for given dofs, and the table of its dofs."""
    folder, count = Path(writes).parent, len(r)
    kept, own = ~held[A[0]], np.flatnonzero(held)
    entries = [np.concatenate([each[kept], more]) for each, more in zip(A, (own, own, np.ones(len(own))))]
    entries = np.column_stack([entries[0] + 1, entries[1] + 1, entries[2]])
    head = "%%MatrixMarket matrix"
    np.savetxt(folder / "A.mtx", entries, "%d %d %.17g", header=f"{head} coordinate real general\n{count} {count} {len(entries)}", comments="")
    np.savetxt(folder / "b.mtx", np.where(held, goal, -r), "%.17g", header=f"{head} array real general\n{count} 1", comments="")
    at, directions = (np.pad(each, ((0, 0), (0, 3 - each.shape[1]))) for each in (at, directions))
    table = np.column_stack([at, directions{{ ", values" if not has_state }}]).tolist()
    rows = [",".join([name, *map(repr, row)]) for name, row in zip(names, table)]
    (folder / "dofs.csv").write_text("\n".join(["field,x,y,z,dx,dy,dz{{ ",value" if not has_state }}", *rows]) + "\n")


