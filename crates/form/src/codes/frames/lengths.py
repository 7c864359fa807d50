{% if has_circumradius %}
{# The centre c of the sphere through 0 and the edges e from a vertex: 2 e·c = |e|² for each. #}
edges = points[cells[:, 1:]] - points[cells[:, :1]]
radii = np.linalg.norm(np.linalg.solve(2*edges, (edges**2).sum(axis=2)[..., None])[..., 0], axis=1)  # of the circles or spheres through the vertices of cells
{% endif %}
{% if has_facet_length %}
pairs = [{% for pair in cell.edges %}({{ pair|join(", ") }}){{ ", " if not loop.last }}{% endfor %}]  # the edges of a cell
edges = {frozenset(edge) for pair in pairs for edge in cells[:, pair].tolist()}


def longest_edge(vertices):
    """That of a facet."""
    own = [[a, b] for a in vertices for b in vertices if a < b and frozenset((a, b)) in edges]
    return max(np.linalg.norm(points[a] - points[b]) for a, b in own)


{% endif %}
