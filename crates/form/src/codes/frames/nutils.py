{% from "lists.py" import rows %}
{% from "newton.py" import newton %}
{% include "head.py" %}
from nutils import function, mesh, pointsseq, sample, solver, types
from nutils import points as quadrature


{% include "read.py" %}
{% include "lengths.py" %}

corners = np.sort(cells, axis=1)
sides = {tuple(np.delete(cell, j)): (i, j) for i, cell in enumerate(corners.tolist()) for j in range({{ dim + 1 }})}
marked = np.array([sides[tuple(sorted(vertices))] for vertices in facets.tolist()])
topo, geom = mesh.simplex(
    corners,
    corners,
    points,
    {f"g{tag}": np.flatnonzero(regions == tag) for tag in [{{ groups|selectattr("less", "eq", 0)|map(attribute="tag")|join(", ") }}]},
    {f"g{tag}": marked[labels == tag] for tag in [{{ groups|selectattr("less", "eq", 1)|map(attribute="tag")|join(", ") }}]},
    {},
)


def at(part, places, weights):
    """The quadrature points in each cell or facet of a part of the mesh."""
    rule = quadrature.CoordsWeightsPoints(types.arraydata(np.array(places)), types.arraydata(np.array(weights)))
    everywhere = pointsseq.PointsSequence.uniform(rule, len(part))
    return sample.Sample.new(part.space, (part.transforms, part.opposites), everywhere)


{{ axes|join(", ") }}, = geom
n = function.normal(geom)

# The quadrature points are given explicitly, so that all codes use the same.
rule = {{ rows(rules[0].points, 2) }}, {{ rows(rules[0].weights, 4) }}
facet_rule = {{ rows(rules[1].points, 2) }}, {{ rows(rules[1].weights, 4) }}
{% for rule in rules[2:] %}
{{ rule.word }} = {{ rows(rule.points, 2) }}, {{ rows(rule.weights, 4) }}
{% endfor %}
{% if has_diameter %}
longest = np.linalg.norm(points[cells][:, :, None] - points[cells][:, None], axis=3).max(axis=(1, 2))
h = function.get(longest, 0, topo.f_index)  # the longest edge of each cell
{% endif %}
{% if has_circumradius %}
circumradius = function.get(radii, 0, topo.f_index)
{% endif %}
{% if has_facet_length %}
lengths = np.array([[longest_edge(np.delete(cell, j).tolist()) for j in range({{ dim + 1 }})] for cell in corners])
ones = np.ones((len(corners), {{ dim + 1 }}, 1))
slopes = np.linalg.inv(np.concatenate([ones, points[corners]], axis=2))[:, 1:].transpose(0, 2, 1)  # of the barycentric coordinates
slopes /= np.linalg.norm(slopes, axis=2)[:, :, None]
# The facet of a cell is found by its normal.
facet_length = 0.0
for j in range({{ dim + 1 }}):
    length, slope = [function.get(each[:, j].copy(), 0, topo.f_index) for each in (lengths, slopes)]
    facet_length += length*np.less((slope*n).sum(0), 1e-9 - 1).astype(int)
{% endif %}


def nodal(part, basis, degree, g):
    """The dofs of the nodes on a part of the mesh, and the values of g there."""
    nodes = part.sample("bezier", degree + 1) if degree else at(part, [[1/{{ dim + 1 }}]*({{ dim + 1 }} - 1)], [1.0])
    dofs, first = np.unique(nodes.eval(basis).argmax(axis=1), return_index=True)
    return dofs, g(*nodes.eval(geom)[first].T)


{% for datum in data %}
{% for part in datum.parts %}
{% if not datum.element %}
{{ part.name }} = {{ part.text }}
{% else %}
basis = {{ datum.element }}
{% if time %}
{{ part.name }} = basis @ function.Argument("of_{{ part.name }}", (len(basis),))
{% else %}
_, values = nodal(topo, basis, {{ datum.degree }}, lambda {{ axes|join(", ") }}: {{ part.at_points }})
{{ part.name }} = basis @ values
{% endif %}
{% endif %}
{% endfor %}
{% endfor %}

bases = [
{% for function in functions %}
    {{ function.element }},
{% endfor %}
{% for mean in means %}
    function.ones((1,)),  # a multiplier
{% endfor %}
]
first = np.cumsum([0, *map(len, bases)]).tolist()


def fields(name):
    """One function for each basis; all coefficients are in one argument."""
    all = function.Argument(name, (first[-1],))
    return [basis @ all[i:j] for basis, i, j in zip(bases, first, first[1:])]


{% for function in functions %}{{ function.name }}, {% endfor %}
{% for mean in means %}multiplier{{ loop.index0 }}, {% endfor %}
= fields("total")
{% for function in functions %}{{ function.test }}, {% endfor %}
{% for mean in means %}mean{{ loop.index0 }}, {% endfor %}
= fields("tests")
{% if time %}
{# Multipliers of the step before are of no use. #}
{{ functions|map(attribute="old")|join(", ") }}, *_ = fields("before")
{% endif %}
{% for each in shared %}
{{ each.name }} = {{ each.value }}
{% endfor %}
F = 0.0
{% for integral in integrals %}
{% set part = {"dx": "topo", "ds": "topo.boundary", "dS": "topo.interfaces"}[integral.kind] %}

# {{ integral.title }}
integrand = (
{% for term in integral.terms %}
    {{ term.signed }}
{% endfor %}
)
{% if not integral.tags %}
for part in [{{ part }}]:
{% else %}
for part in [{% for tag in integral.tags %}{{ part }}["g{{ tag }}"]{{ ", " if not loop.last }}{% endfor %}]:
{% endif %}
    F += at(part, *{{ integral.rule_word }}).integral(integrand*function.J(geom))
{% endfor %}
{% for mean in means %}
{% set k = loop.index0 %}

# The mean is held by a multiplier.
F += at(topo, *rule).integral((multiplier{{ k }}*{{ mean.test }} + ({{ mean.name }} - ({{ mean.value }}))*mean{{ k }})*function.J(geom))
{% endfor %}

system = solver.System(F, trial="total", test="tests")
held, total, goal = np.zeros(first[-1], bool), np.zeros(first[-1]), np.zeros(first[-1])
{% set solve %}
# Dirichlet values; where two groups share a dof, the later one counts.
{% for one in held %}
{% set part = "interfaces" if one.is_between else "boundary" %}
dofs, values = nodal(topo.{{ part }}["g{{ one.tag }}"], bases[{{ one.position }}], {{ one.degree }}, lambda {{ axes|join(", ") }}: {{ one.values[0].at_points }})
held[first[{{ one.position }}] + dofs], goal[first[{{ one.position }}] + dofs] = True, values
{% endfor %}

{% call newton("abs(d).max(initial=0)", "abs(total).max()", free="free = ~held") %}
r = system.assemble_residual({"total": total, **arguments})
A = system.assemble_jacobian({"total": total, **arguments})
d = np.where(held, total - goal, 0.0)
d[free] = A.submatrix(free, free).solve((r - A @ d)[free])
total -= d
{% endcall %}
{% endset %}
{% if not time %}
arguments = {}

{{ solve }}
{%- else %}

# Initial values.
{% for initial in time.initial %}
dofs, values = nodal(topo, bases[{{ initial.position }}], {{ initial.degree }}, lambda {{ axes|join(", ") }}: {{ initial.at_points }})
total[first[{{ initial.position }}] + dofs] = values
{% endfor %}

# Steps in time: {{ time.t }} is that at the end of a step.
for number in range(1, {{ time.steps + 1 }}):
    {{ time.t }} = number*{{ time.dt }}
    arguments = {"{{ time.t }}": {{ time.t }}, "before": total.copy()}
{% for each in interpolated %}
    basis = {{ each.element }}
    _, arguments["of_{{ each.name }}"] = nodal(topo, basis, {{ each.degree }}, lambda {{ axes|join(", ") }}: {{ each.at_points }})
{% endfor %}
{{ solve|within }}
{%- endif %}

# The values at the nodes of VTK's cells.
nodes = at(topo, [{% for node in output.nodes %}[{{ node[1:]|join(", ") }}]{{ ", " if not loop.last }}{% endfor %}], [1.0]*{{ output.nodes|length }})


def values(*parts):
    found = [nodes.eval(part, arguments={"total": total}).reshape(len(cells), {{ output.nodes|length }}) for part in parts]
    return np.stack(found, axis=2)


at = np.pad(values({{ axes|join(", ") }}), ((0, 0), (0, 0), (0, {{ 3 - dim }})))


{% include "write_vtu.py" %}
write_vtu(writes, at, { {%- for u in unknowns %}"{{ u.title }}": values({{ u.parts|map(attribute="name")|join(", ") }}){{ ", " if not loop.last }}{% endfor -%} })
