here = Path(__file__)
reads, writes = sys.argv[1:3] or (here.with_name("{{ mesh }}"), here.with_suffix(".vtu"))
{% for parameter in parameters %}
{{ parameter.name }} = {{ parameter.value }}
{% endfor %}


def read_msh(path):
    """Points, and cells and facets (vertices, numbers of groups), of an MSH file: version 2.2, ASCII."""
    lines = iter(Path(path).read_text().splitlines())
    rows = {}
    for line in lines:
        if line in ("$Nodes", "$Elements"):
            rows[line] = [next(lines).split() for _ in range(int(next(lines)))]
    number = {row[0]: i for i, row in enumerate(rows["$Nodes"])}
    points = np.array([row[1 : {{ dim }} + 1] for row in rows["$Nodes"]], float)

    def elements(kind):
        found = [row for row in rows["$Elements"] if row[1] == kind]
        vertices = [[number[i] for i in row[3 + int(row[2]) :]] for row in found]
        return np.array(vertices, np.int64), np.array([int(row[3]) for row in found], np.int32)

    return points, *map(elements, ("{{ cell.kinds|join('", "') }}"))


points, (cells, regions), (facets, labels) = read_msh(reads)
