{% from "lists.py" import rows %}
{% from "newton.py" import newton %}
{# The dofs of an unknown, or of a component. #}
{% macro part(unknown, component) %}
np.arange(first[{{ unknown }}], first[{{ unknown + 1 }}])
{%- if component is not none and unknowns[unknown].size is not none %}.reshape({{ unknowns[unknown].size }}, -1)[{{ component }}]{% endif %}
{% endmacro %}
{% set add = {"triangle": "Triangle", "tetrahedron": "Tet", "quadrilateral": "Quad", "hexahedron": "Hex"}[cell.name] %}
{% set point = axes|join(", ") %}
{% set tests = unknowns|map(attribute="test")|join(", ") %}
{% set increments = unknowns|map(attribute="increment")|join(", ") %}
{% include "head.py" %}
from types import SimpleNamespace

import mfem.ser as mfem
import scipy.sparse
from scipy.sparse.linalg import splu

{% include "read.py" %}
{% include "lengths.py" %}

mesh = mfem.Mesh({{ dim }}, len(points), len(cells), 0, {{ dim }})
for place in points.tolist():
    mesh.AddVertex(*place, *[0.0]*{{ 3 - dim }})
for vertices in cells.tolist():
    mesh.Add{{ add }}(vertices, 1)
mesh.FinalizeTopology()
mesh.Finalize(False, False)
vertices_of = mesh.{{ "GetEdgeVertices" if dim == 2 else "GetFaceVertices" }}
number = {tuple(sorted(vertices_of(i))): i for i in range(mesh.GetNumFaces())}
marked = np.array([number[tuple(sorted(vertices))] for vertices in facets.tolist()], int)
outside = np.array([mesh.GetFaceElementTransformations(i).Elem2No < 0 for i in range(mesh.GetNumFaces())])
corners = points[cells]
diameter = np.linalg.norm(corners[:, :, None] - corners[:, None], axis=3).max(axis=(1, 2))  # the longest distance of two vertices
{% if has_facet_length %}
lengths = np.array([longest_edge(vertices_of(i)) for i in range(mesh.GetNumFaces())])
{% endif %}


def space(collection):
    """A scalar space with the places of its dofs."""
    found = mfem.FiniteElementSpace(mesh, collection)
    of_cells = np.array([found.GetElementDofs(i) for i in range(len(cells))])
    at = np.zeros((found.GetNDofs(), {{ dim }}))
    for i, dofs in enumerate(of_cells):
        nodes, T = found.GetFE(i).GetNodes(), mesh.GetElementTransformation(i)
        at[dofs] = [T.Transform(nodes.IntPoint(j))[:{{ dim }}] for j in range(nodes.GetNPoints())]
    return SimpleNamespace(V=found, collection=collection, of_cells=of_cells, at=at)


# Each component of an unknown is a function of a scalar space.
spaces = [{% for u in unknowns %}space({{ u.element }}){{ ", " if not loop.last }}{% endfor %}]
sizes = [{% for u in unknowns %}{{ u.size or "None" }}, {% endfor %}]
first = np.cumsum([0, *((count or 1)*len(space.at) for count, space in zip(sizes, spaces))])
dofs_of_cells = np.concatenate(
    [i + len(space.at)*j + space.of_cells for i, count, space in zip(first, sizes, spaces) for j in range(count or 1)], axis=1
)
{% for each in interpolated %}
of_{{ each.name }} = space({{ each.element }})
{% endfor %}
others = [{% for each in interpolated %}of_{{ each.name }}, {% endfor %}]

# The quadrature points are given explicitly, so that all codes use the same.
rule = {{ rows(rules[0].points, 2) }}, {{ rows(rules[0].weights, 4) }}
facet_rule = {{ rows(rules[1].points, 2) }}, {{ rows(rules[1].weights, 4) }}
{% for rule in rules[2:] %}
{{ rule.word }} = {{ rows(rule.points, 2) }}, {{ rows(rule.weights, 4) }}
{% endfor %}


def sample(kind, rule, entities, side=0):
    """MFEM's maps and basis functions at the points of cells, or of facets from a side: arrays by entity and point."""
    all, ip = [], mfem.IntegrationPoint()
    for i in map(int, entities):
        cell, normal = i, np.zeros({{ dim }})
        T = mesh.GetElementTransformation(i) if kind == "dx" else mesh.GetFaceElementTransformations(i)
        if kind != "dx":
            cell = T.Elem2No if side else T.Elem1No
        for place, weight in zip(*rule):
            ip.x, ip.y, ip.z = (*place, 0.0, 0.0)[:3]
            if kind == "dx":
                own, at = T, ip
                T.SetIntPoint(ip)
            else:
                T.SetAllIntPoints(ip)
                own = T.GetElement2Transformation() if side else T.GetElement1Transformation()
                at = T.GetElement2IntPoint() if side else T.GetElement1IntPoint()
                normal = mfem.Vector({{ dim }})
                mfem.CalcOrtho(T.Jacobian(), normal)
                normal = normal.GetDataArray()/np.linalg.norm(normal.GetDataArray())
            row = [cell, i, weight*T.Weight(), np.array(own.Transform(at))[:{{ dim }}], normal.copy()]
            for each in [*spaces, *others]:
                element = each.V.GetFE(cell)
                value, slope = mfem.Vector(element.GetDof()), mfem.DenseMatrix(element.GetDof(), {{ dim }})
                element.CalcShape(at, value)
                element.CalcPhysDShape(own, slope)
                row.append(np.column_stack([value.GetDataArray(), slope.GetDataArray()]))
            all.append(row)
    shape = len(entities), len(rule[1])
    arrays = [np.array(each).reshape(*shape, *np.shape(each[0])) for each in zip(*all)]
    return SimpleNamespace(cell=arrays[0][:, 0], entity=arrays[1][:, 0], weights=arrays[2], x=arrays[3], n=arrays[4], tables=arrays[5:])


class Field(np.ndarray):
    """Values, with their gradient."""


def field(rows):
    """Of values and slopes along the last axis."""
    found = np.ascontiguousarray(rows[..., 0]).view(Field)
    found.grad = np.moveaxis(rows[..., 1:], -1, 0)
    return found


def unknown(k, parts):
    """An unknown of its components, each with values and slopes."""
    parts = [field(rows) for rows in parts]
    if sizes[k] is None:
        return parts[0]
    found = np.stack(parts).view(Field)
    found.grad = np.stack([part.grad for part in parts])
    return found


def functions(at, s, more=()):
    """All basis functions of each unknown, 0 where they belong to another, with one more axis."""
    found, start = [], 0
    for k, space in enumerate(spaces):
        table, parts = at.tables[k][s], []
        for _ in range(sizes[k] or 1):
            whole = np.zeros((*table.shape[:2], dofs_of_cells.shape[1], {{ dim + 1 }}))
            whole[:, :, start : start + table.shape[2]] = table
            start += table.shape[2]
            parts.append(np.expand_dims(whole, more))
        found.append(unknown(k, parts))
    return found


def given(at, s, axes, mark=""):
    """The unknowns and data at the points, with as many more axes."""
    lift = lambda rows: rows.reshape(*rows.shape[:2], *[1]*axes, -1)
    at_points = lambda k, space, values: lift(np.einsum("eqid,ei->eqd", at.tables[k][s], values[space.of_cells[at.cell[s]]]))

    def of(k, total):
        return unknown(k, [at_points(k, spaces[k], each) for each in total[first[k] : first[k + 1]].reshape(sizes[k] or 1, -1)])

    found = {"h" + mark: np.expand_dims(diameter[at.cell[s]], tuple(range(1, axes + 2)))}
{% if has_circumradius %}
    found["circumradius" + mark] = np.expand_dims(radii[at.cell[s]], tuple(range(1, axes + 2)))
{% endif %}
{% if has_facet_length %}
    found["facet_length"] = np.expand_dims(lengths[at.entity[s]], tuple(range(1, axes + 2)))  # on facets
{% endif %}
{% for u in unknowns %}
    found["{{ u.name }}" + mark] = of({{ loop.index0 }}, total)
{% if time %}
    found["{{ u.old }}" + mark] = of({{ loop.index0 }}, before)
{% endif %}
{% endfor %}
{% for each in interpolated %}
    values = (lambda {{ point }}: {{ each.at_points }})(*of_{{ each.name }}.at.T)
    found["{{ each.name }}" + mark] = field(at_points(len(spaces) + {{ loop.index0 }}, of_{{ each.name }}, values))
{% endfor %}
    return found


def sums(form, sides, marks, test, trial=None):
    """The integrals of a form for all basis functions from a side, and, where there are increments, from another."""
    axes, size = (1 if trial is None else 2), dofs_of_cells.shape[1]
    step = max(1, 2**22//(len(sides[0].weights[0])*size**axes)) if len(sides[0].weights) else 1
    found = np.zeros(first[-1]) if trial is None else scipy.sparse.csr_matrix((first[-1], first[-1]))
    for i in range(0, len(sides[0].weights), step):
        s = slice(i, i + step)
        lift = lambda values: values[s].reshape(*values[s].shape[:2], *[1]*axes, *values.shape[2:])
        w = SimpleNamespace(x=np.moveaxis(lift(sides[0].x), -1, 0), n=np.moveaxis(lift(sides[0].n), -1, 0))
        for at, mark in zip(sides, marks):
            vars(w).update(given(at, s, axes, mark))
        dofs = dofs_of_cells[sides[test].cell[s]]
        if trial is None:
            np.add.at(found, dofs, (form(*functions(sides[test], s), w)*lift(sides[0].weights)).sum(axis=1))
            continue
        pairs = form(*functions(sides[trial], s, (2,)), *functions(sides[test], s, (3,)), w)
        values = np.asarray(pairs*lift(sides[0].weights)).sum(axis=1)
        columns = np.broadcast_to(dofs_of_cells[sides[trial].cell[s]][:, None, :], values.shape)
        at_rows = np.broadcast_to(dofs[:, :, None], values.shape)
        found += scipy.sparse.csr_matrix((values.ravel(), (at_rows.ravel(), columns.ravel())), found.shape)
    return found
{% for datum in data %}
{% for part in datum.parts %}


def {{ part.name }}({{ point }}):
    return {{ part.at_points }}
{% endfor %}
{% endfor %}
{% for integral in more.integrals %}
{% set i = loop.index0 %}
{% set all = {"dx": "range(len(cells))", "ds": "np.flatnonzero(outside)", "dS": "np.flatnonzero(~outside)"}[integral.kind] %}
{% set tags = integral.tags|join(", ") %}


# {{ integral.title }}
{% if not tags %}
chosen = {{ all }}
{% elif integral.kind == "dx" %}
chosen = np.flatnonzero(np.isin(regions, [{{ tags }}]))
{% else %}
chosen = marked[np.isin(labels, [{{ tags }}])]
{% endif %}
sides{{ i }} = [sample("{{ integral.kind }}", {{ integral.rule_word }}, chosen, side) for side in {{ "(0, 1)" if integral.kind == "dS" else "(0,)" }}]
{% for form in integral.forms %}


{% if form.is_residual %}
def residual{{ i }}{{ form.test }}({{ tests }}, w):
{% else %}
def derivative{{ i }}{{ form.trial }}{{ form.test }}({{ increments }}, {{ tests }}, w):
{% endif %}
    {{ point }}, = w.x
{% if form.has_normal %}
    n = w.n
{% endif %}
{% for name in form.fields %}
    {{ name }} = w.{{ name }}
{% endfor %}
{% for each in form.shared %}
    {{ each.name }} = {{ each.value }}
{% endfor %}
    return (
{% for term in form.terms %}
        {{ term.signed }}
{% endfor %}
    )
{% endfor %}
{% endfor %}


# Dirichlet values; where two groups share a dof, the later one counts.
held, goal, total = np.zeros(first[-1], bool), np.zeros(first[-1]), np.zeros(first[-1])
{% if time %}
before = total.copy()
{% endif %}
{% if held %}


def hold(group, k, part, g):
    dofs_of = spaces[k].V.{{ "GetEdgeDofs" if dim == 2 else "GetFaceDofs" }}
    found = np.unique([dof for i in marked[labels == group] for dof in dofs_of(int(i))])
    held[part[found]], goal[part[found]] = True, g(*spaces[k].at[found].T)


{% endif %}
{% if means %}

# The means are held by multipliers: the product of a row with dofs is the integral.
whole = [sample("dx", rule, range(len(cells)))]
rows = np.array([{% for mean in means %}sums(lambda {{ tests }}, w: {{ mean.test }} + 0*w.x[0], whole, [""], 0){{ ", " if not loop.last }}{% endfor %}])
wanted = whole[0].weights.sum()*np.array([{{ means|map(attribute="value")|join(", ") }}])
{% endif %}
{% macro place(mark) %}{{ 1 if mark == "_minus" else 0 }}{% endmacro %}
{% macro over(call) %}sides{{ call.integral }}, {{ '["_plus", "_minus"]' if more.integrals[call.integral].kind == "dS" else '[""]' }}, {{ place(call.test) }}{% endmacro %}
{% set solve %}
{% for one in held %}
hold({{ one.tag }}, {{ one.unknown }}, {{ part(one.unknown, one.component) }}, lambda {{ point }}: {{ one.values[0].at_points }})
{% endfor %}

{% call newton("abs(d).max(initial=0)", "abs(total).max()", free="free = ~held") %}
r = (
{% for call in more.forms if call.is_residual %}
    {{ "+ " if not loop.first }}sums(residual{{ call.integral }}{{ call.test }}, {{ over(call) }})
{% endfor %}
)
A = (
{% for call in more.forms if not call.is_residual %}
    {{ "+ " if not loop.first }}sums(derivative{{ call.integral }}{{ call.trial }}{{ call.test }}, {{ over(call) }}, {{ place(call.trial) }})
{% endfor %}
)
{% if has_system %}
if step == 0:
    system = scipy.sparse.find(A), r
{% if has_state %}
    total[:] = 0
    continue
{% endif %}
{% endif %}
d = np.where(held, total - goal, 0.0)
{% if means %}
border = scipy.sparse.csc_matrix(rows[:, free])
both = scipy.sparse.bmat([[A.tocsc()[free][:, free], border.T], [border, None]], format="csc")
d[free] = splu(both).solve(np.concatenate([(r - A @ d)[free], rows @ total - wanted]))[: free.sum()]
{% else %}
d[free] = splu(A.tocsc()[free][:, free]).solve((r - A @ d)[free])
{% endif %}
total -= d
{% endcall %}
{% endset %}
{% if has_system %}
{% include "system.py" %}

at_dofs = np.concatenate([each.at for size, each in zip(sizes, spaces) for _ in range(size or 1)])
directions = np.concatenate([np.tile(np.eye(3)[k], (len(each.at), 1)) for size, each in zip(sizes, spaces) for k in range(size or 1)])
names = np.repeat([{% for u in unknowns %}"{{ u.title }}", {% endfor %}], np.diff(first))
{% if has_state %}
total[:] = state(at_dofs, directions)
{% endif %}
{% endif %}
{% if not time %}
{{ solve }}
{%- else %}

# Initial values.
{% for initial in time.initial %}
part = {{ part(initial.unknown, initial.component) }}
total[part] = (lambda {{ point }}: {{ initial.at_points }})(*spaces[{{ initial.unknown }}].at.T)
{% endfor %}

# Steps in time: {{ time.t }} is that at the end of a step.
for number in range(1, {{ time.steps + 1 }}):
    {{ time.t }} = number*{{ time.dt }}
    before[:] = total
{{ solve|within }}
{%- endif %}

# The values at the nodes of VTK's cells.
nodes = [{% for node in output.nodes %}[{{ node[1:]|join(", ") }}]{{ ", " if not loop.last }}{% endfor %}]
others = []
out = sample("dx", (nodes, np.ones(len(nodes))), range(len(cells)))
at = np.pad(out.x, ((0, 0), (0, 0), (0, {{ 3 - dim }})))


def values(k):
    each = total[first[k] : first[k + 1]].reshape(sizes[k] or 1, -1)
    return np.stack([np.einsum("eqi,ei->eq", out.tables[k][..., 0], part[spaces[k].of_cells]) for part in each], axis=2)


{% if has_system %}
write_system(*system, held, goal, {{ "total, " if not has_state }}at_dofs, directions, names)


{% endif %}
{% include "write_vtu.py" %}
write_vtu(writes, at, { {%- for u in unknowns %}"{{ u.title }}": values({{ loop.index0 }}){{ ", " if not loop.last }}{% endfor -%} })
