{% if has_circumradius %}
# Circumradii of cells: from a vertex the centre is at c with 2 e·c = e·e for each edge e there.
edges = points[cells[:, 1:]] - points[cells[:, :1]]
radii = np.linalg.norm(np.linalg.solve(2*edges, (edges**2).sum(axis=2)[..., None])[..., 0], axis=1)
{% endif %}
{% if has_facet_length %}
pairs = [{% for pair in cell.edges %}({{ pair|join(", ") }}){{ ", " if not loop.last }}{% endfor %}]  # the edges of a cell
edges = {frozenset(edge) for pair in pairs for edge in cells[:, pair].tolist()}


def longest_edge(vertices):
    """The length of the longest edge of a facet."""
    own = [[a, b] for a in vertices for b in vertices if a < b and frozenset((a, b)) in edges]
    return max(np.linalg.norm(points[a] - points[b]) for a, b in own)


{% endif %}
