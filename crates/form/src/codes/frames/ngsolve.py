{% from "lists.py" import rows %}
{% from "newton.py" import newton %}
{% macro nodes_of(degrees) -%}
[{% for nodes in degrees %}[{% for node in nodes %}({{ node|join(", ") }},){{ ", " if not loop.last }}{% endfor %}]{{ ", " if not loop.last }}{% endfor %}]
{%- endmacro %}
{# A function that is a part of one in V. #}
{% macro part(total, k) -%}
{{ total }}{{ ".components[" ~ k ~ "]" if functions|length + means|length > 1 }}
{%- endmacro %}
{% macro over(integral) %}
{% set names = "g" ~ integral.named|join("|g") if integral.named else "" %}
{% if integral.kind == "dx" -%}
dx({% if names %}"{{ names }}", {% endif %}intrules={{ integral.rule_word }})
{%- elif integral.kind == "ds" -%}
ds({% if names %}"{{ names }}", {% endif %}skeleton=True, intrules={{ integral.rule_word }})
{%- else -%}
dx(skeleton=True, {% if names %}definedonelements=between("{{ names|replace("|", '", "') }}"), {% endif %}intrules={{ integral.rule_word }})
{%- endif %}
{% endmacro %}
{% macro add(form, integral, terms) %}
{% if terms %}
{{ form }} += (
{% for term in terms %}
    {{ term.signed }}
{% endfor %}
).Compile()*{{ over(integral) }}
{% endif %}
{% endmacro %}
{% set kinds = {"triangle": ["TRIG", "SEGM"], "tetrahedron": ["TET", "TRIG"], "quadrilateral": ["QUAD", "SEGM"], "hexahedron": ["HEX", "QUAD"]}[cell.name] %}
{% set by_hand = integrals|selectattr("by_hand")|list %}
{% set interior = integrals|selectattr("kind", "eq", "dS")|list %}
{% set jumps = ", dgjumps=True" if interior else "" %}
{% include "head.py" %}
import netgen.meshing as netgen
import ngsolve
{% if has_system or eigen %}
import scipy.sparse
import scipy.sparse.linalg
{% endif %}
from ngsolve import (
    BND, CF, HEX, QUAD, SEGM, TET, TRIG, VOL, IfPos, acos, asin, atan, atan2, cos, cosh, curl, div, ds, dx, exp, grad, log, sin, sinh, specialcf, sqrt, tan, x, y, z
)

{% include "read.py" %}
{% include "lengths.py" %}
{% if time %}
{{ time.t }} = ngsolve.Parameter({{ time.t }})  # changes from step to step
{% endif %}
grid = netgen.Mesh(dim={{ dim }})
number = [grid.Add(netgen.MeshPoint(netgen.Pnt(*point, *[0.0]*{{ 3 - dim }}))) for point in points]
groups = [{{ groups|selectattr("less", "eq", 1)|map(attribute="tag")|join(", ") }}]  # of the boundary
{% if dim == 2 %}
inside = {int(r): netgen.FaceDescriptor(surfnr=i + 1, domin=i + 1, bc=i + 1) for i, r in enumerate(np.unique(regions))}
where = {r: grid.Add(descriptor) for r, descriptor in inside.items()}
for vertices, r in zip(cells, regions.tolist()):
    grid.Add(netgen.Element2D(where[r], [number[i] for i in vertices]))
for i, r in enumerate(inside):
    grid.SetMaterial(i + 1, f"g{r}")
for vertices, label in zip(facets, labels.tolist()):
    grid.Add(netgen.Element1D([number[i] for i in vertices], index=groups.index(label) + 1))
for i, label in enumerate(groups):
    grid.SetBCName(i, f"g{label}")
{% else %}
for i, label in enumerate(groups):
    grid.Add(netgen.FaceDescriptor(surfnr=i + 1, domin=1, bc=i + 1))
    grid.SetBCName(i, f"g{label}")
for vertices, label in zip(facets, labels.tolist()):
    grid.Add(netgen.Element2D(groups.index(label) + 1, [number[i] for i in vertices]))
inside = np.unique(regions).tolist()
for vertices, r in zip(cells, regions.tolist()):
    grid.Add(netgen.Element3D(inside.index(r) + 1, [number[i] for i in vertices]))
for i, r in enumerate(inside):
    grid.SetMaterial(i + 1, f"g{r}")
{% endif %}
mesh = ngsolve.Mesh(grid)

# The quadrature points are given explicitly, so that all codes use the same.
{% for rule in rules %}
{{ rule.word }} = { {{- kinds[1 if rule.is_facets else 0] }}: ngsolve.IntegrationRule({{ rows(rule.points, 2) }}, {{ rows(rule.weights, 4) }})}
{% endfor %}
n = specialcf.normal({{ dim }})
{% if has_diameter %}
h = ngsolve.GridFunction(ngsolve.L2(mesh, order=0))  # the longest edge of each cell
h.vec.FV().NumPy()[:] = np.max(
    [np.linalg.norm(points[cells[:, i]] - points[cells[:, j]], axis=1) for i in range(cells.shape[1]) for j in range(i)], axis=0
)
{% endif %}
{% if has_circumradius %}
circumradius = ngsolve.GridFunction(ngsolve.L2(mesh, order=0))
circumradius.vec.FV().NumPy()[:] = radii
{% endif %}
{% if has_facet_length %}
facet_length = ngsolve.GridFunction(ngsolve.FacetFESpace(mesh, order=0))
facet_length.vec.FV().NumPy()[:] = [longest_edge([v.nr for v in facet.vertices]) for facet in mesh.{{ "edges" if dim == 2 else "faces" }}]
{% endif %}


def hold(function, where, degree, *values):
    """Set nodal values on cells, or on facets of groups; of two values at one node, the later counts.

    NGSolve's basis is hierarchical, so a small system is solved for the dofs of each element.
    """
    nodes = {BND: {{ nodes_of(more.nodes[0]) }}, VOL: {{ nodes_of(more.nodes[1]) }}}[where][degree]
    known, solved = {}, {}
    for group, g in values:
        for e in function.space.Elements(where):
            if group is None or e.mat == group:
                place, element = mesh.GetTrafo(e), function.space.GetFE(e)
                keys = [tuple(np.round(CF((x, y, z))(place(*t)), 9)) for t in nodes]
                known.update(zip(keys, [g(place(*t)) for t in nodes]))
                solved[e.nr] = e.dofs, [np.ravel(element.CalcShape(*t)) for t in nodes], keys
    for dofs, shapes, keys in solved.values():
        for dof, value in zip(dofs, np.linalg.solve(shapes, [known[key] for key in keys])):
            function.vec[dof] = value


{% if interior|selectattr("tags")|list %}
def between(*groups):
    """The facets of groups, as a set."""
    found = ngsolve.BitArray(mesh.nfacet)
    found.Clear()
    for e in mesh.Elements(BND):
        if e.mat in groups:
            found.Set(e.{{ "edges" if dim == 2 else "faces" }}[0].nr)
    return found


{% endif %}
{% for datum in data %}
{% for part in datum.parts %}
{% if datum.element %}
{{ part.name }} = ngsolve.GridFunction({{ datum.element }}))
hold({{ part.name }}, VOL, {{ datum.degree }}, (None, CF({{ part.text }})))
{% else %}
{{ part.name }} = CF({{ part.text }})
{% endif %}
{% endfor %}
{% endfor %}

V = {% for function in functions %}{{ function.element }}
{%- if function.held %}, dirichlet="g{{ function.held|map(attribute="tag")|join("|g") }}"{% endif %}{{ jumps }}){{ " * " if not loop.last }}{% endfor %}{{ " * ngsolve.NumberSpace(mesh)" * means|length }}
{{ functions|map(attribute="name")|join(", ") }}{% for mean in means %}, multiplier{{ loop.index0 }}{% endfor %} = V.TrialFunction()
{{ functions|map(attribute="test")|join(", ") }}{% for mean in means %}, mean{{ loop.index0 }}{% endfor %} = V.TestFunction()
{% if time %}
before = ngsolve.GridFunction(V)
{% for function in functions %}
{{ function.old }} = {{ part("before", loop.index0) }}
{% endfor %}
{% endif %}
a = ngsolve.BilinearForm(V)
{% if eigen %}
mass = ngsolve.BilinearForm(V)
{% endif %}
{% if by_hand %}
b = ngsolve.BilinearForm(V)
{% endif %}
{% for each in shared %}
{{ each.name }} = {{ each.value }}
{% endfor %}
{% for integral in integrals %}
{{ add("mass" if integral.is_mass else "b" if integral.by_hand else "a", integral, integral.terms) }}
{%- endfor %}
{% for mean in means %}
{% set k = loop.index0 %}
a += (multiplier{{ k }}*{{ mean.test }} + ({{ mean.name }} - ({{ mean.value }}))*mean{{ k }})*dx(intrules=rule)  # the mean is held by a multiplier
{% endfor %}
total, goal = ngsolve.GridFunction(V), ngsolve.GridFunction(V)
{% if by_hand %}

# NGSolve linearises integrals over interior facets correctly only if they are bilinear; J is the derivative of b.
J = ngsolve.BilinearForm(V)
{% for each in shared_by_derivative %}
{{ each.name }} = {{ each.value }}
{% endfor %}
{% for integral in by_hand %}
{{ add("J", integral, integral.derivative) }}
{%- endfor %}
{% endif %}
{% if holds_wholes %}


normal = lambda e: [{{ trace("normal", "e[%]"|each(dim, 0), "n[%]"|each(dim, 0))|join(", ") }}]
tangential = lambda e: [{{ trace("tangential", "e[%]"|each(dim, 0), "n[%]"|each(dim, 0))|join(", ") }}]


def hold_whole(function, group, trace, g):
    """Hold the normal or tangential moments of a vector on facets, by projection."""
    own = function.space
    q, v = own.TnT()
    measure = ds(group, skeleton=True, intrules=facet_rule)
    product = lambda a, b: sum(i*j for i, j in zip(trace(a), trace(b)))*measure
    M, right = ngsolve.BilinearForm(product(q, v)).Assemble(), ngsolve.LinearForm(product(g, v)).Assemble()
    diagonal = np.array([M.mat[i, i] for i in range(own.ndof)])
    found = ngsolve.BitArray(diagonal > 1e-10*diagonal.max())
    solved = right.vec.CreateVector()
    solved.data = M.mat.Inverse(found, inverse="umfpack") * right.vec
    for i in np.flatnonzero(diagonal > 1e-10*diagonal.max()):
        function.vec[i] = solved[i]


{% endif %}
{% if not eigen %}
r, d = total.vec.CreateVector(), total.vec.CreateVector()
{% endif %}
free = np.array([V.FreeDofs()[i] for i in range(V.ndof)])
{% if eigen %}

# The equations of free dofs, so that those that are held are no modes.
def matrix(form):
    rows, columns, entries = map(np.asarray, form.Assemble().mat.COO())
    return scipy.sparse.csc_matrix((entries, (rows, columns)), (V.ndof, V.ndof))[free][:, free]


start = np.random.default_rng(0).standard_normal(free.sum())
eigenvalues, modes = scipy.sparse.linalg.eigsh(
    matrix(a), {{ eigen.count }}, matrix(mass), sigma={{ eigen.shift }}, v0=start, ncv=min({{ 4*eigen.count + 20 }}, free.sum())
)
{% endif %}
{% set solve %}
# Dirichlet values; where two groups share a dof, the later one counts.
{% for function in functions %}
{% set goal = part("goal", loop.index0) %}
{% if function.is_vector %}
{% for one in function.held %}
{# A product with 0 alone is none. #}
hold_whole({{ goal }}, "g{{ one.tag }}", {{ one.trace }}, CF((
{%- for value in one.values %}{{ "ngsolve.Parameter(" ~ value.text ~ ")" if value.is_number else value.text }}{{ ", " if not loop.last }}{% endfor %})))
{% endfor %}
{% elif function.held %}
hold({{ goal }}, BND, {{ 0 if function.family == "CR" else function.degree }}
{%- for one in function.held %}, ("g{{ one.tag }}", CF({{ one.values[0].text }})){% endfor %})
{% endif %}
{% endfor %}

{% call newton("abs(d.FV().NumPy()).max()", "abs(total.vec.FV().NumPy()).max()") %}
a.Apply(total.vec, r)
a.AssembleLinearization(total.vec)
{% if by_hand %}
b.Apply(total.vec, d)
r.data += d
J.Assemble()
a.mat.AsVector().data += J.mat.AsVector()
{% endif %}
{% if has_system %}
if step == 0:
    rows, columns, entries = map(np.asarray, a.mat.COO())
    system = scipy.sparse.csr_matrix((entries, (rows, columns)), (V.ndof, V.ndof)), r.FV().NumPy().copy()
{% if has_state %}
    total.vec[:] = 0
    continue
{% endif %}
{% endif %}
d.FV().NumPy()[:] = np.where(free, 0, total.vec.FV().NumPy() - goal.vec.FV().NumPy())
r.data -= a.mat * d
d.data += a.mat.Inverse(V.FreeDofs(), inverse="umfpack") * r
total.vec.data -= d
{% endcall %}
{% endset %}
{% if has_system %}
{% include "system.py" %}

def describe(function, title, component):
    """The places and directions of dofs, and the values at nodes, of a hierarchical basis, as a matrix of its dofs."""
    own = function.space
    count = own.ndof
    if component is None:  # one dof per facet or edge
        q, v = own.TnT()
        M = ngsolve.BilinearForm(q*v*dx).Assemble().mat.Inverse(inverse="umfpack")
        loads = [ngsolve.LinearForm(v[k]*dx).Assemble().vec for k in range({{ dim }})]
        ends = [[points[w.nr] for w in e.vertices] for e in (mesh.edges if count == mesh.nedge else mesh.faces)]
        directions = np.column_stack([(M*load).Evaluate().FV().NumPy() for load in loads])
        return scipy.sparse.identity(count), np.mean(ends, axis=1), directions, [title]*count
    rows, columns, values, seen, at = [], [], [], {}, []
    for e in own.Elements(VOL):
        place, element, degree = mesh.GetTrafo(e), own.GetFE(e), {{ "{" }}{% for f in functions if not f.is_vector %}"{{ f.name }}": {{ 4 if f.family == "CR" else f.degree }}, {% endfor %}{{ "}" }}[component[0]]
        for t in {{ nodes_of(more.nodes[1]) }}[degree]:
            where = tuple(CF((x, y, z))(place(*t))[:{{ dim }}])
            key = tuple(np.round(where, 9))
            if key not in seen:
                seen[key] = len(at)
                at.append(where)
                shape = np.ravel(element.CalcShape(*t))
                rows += [seen[key]]*len(shape)
                columns += list(e.dofs)
                values += list(shape)
    to_nodes = scipy.sparse.csc_matrix((values, (rows, columns)), (count, count))
    return to_nodes, np.array(at), np.tile(np.eye(3)[component[1]], (count, 1)), [title]*count


found = [
{% for u in unknowns %}
{% for k in u.functions %}
    describe({{ part("total", k) }}, "{{ u.title }}", {% if u.is_vector %}None{% else %}("{{ functions[k].name }}", {{ loop.index0 }}){% endif %}),
{% endfor %}
{% endfor %}
]
to_nodes, at_dofs = scipy.sparse.block_diag([each[0] for each in found], format="csc"), np.concatenate([each[1] for each in found])
to_nodes.data[abs(to_nodes.data) < 1e-14] = 0
to_nodes.eliminate_zeros()
directions = np.concatenate([np.pad(each[2], ((0, 0), (0, 3 - each[2].shape[1]))) for each in found])
count = len(at_dofs)  # behind them come multipliers of means
from_nodes = scipy.sparse.linalg.inv(to_nodes)
{% if has_state %}
total.vec.FV().NumPy()[:count] = from_nodes @ state(at_dofs, directions)
{% endif %}
{% endif %}
{% if eigen %}
{% elif not time %}

{{ solve }}
{%- else %}

# Initial values.
{% for initial in time.initial %}
hold({{ part("total", initial.function) }}, VOL, {{ 4 if initial.family == "CR" else initial.degree }}, (None, CF({{ initial.text }})))
{% endfor %}

# Steps in time: {{ time.t }} is that at the end of a step.
for number in range(1, {{ time.steps + 1 }}):
    {{ time.t }}.Set(number*{{ time.dt }})
    before.vec.data = total.vec
{% for each in interpolated %}
    hold({{ each.name }}, VOL, {{ each.degree }}, (None, CF({{ each.text }})))
{% endfor %}
{{ solve|within }}
{%- endif %}

# The values at the nodes of VTK's cells.
{# Reference coordinates of simplices belong to the first vertices; the last one is the origin. #}
nodes = ngsolve.IntegrationRule([{% for node in output.nodes %}[{{ (node[1:] if cell.is_cube else node[:dim])|join(", ") }}]{{ ", " if not loop.last }}{% endfor %}], [1.0]*{{ output.nodes|length }})
mapped = mesh.MapToAllElements({ {{- kinds[0] }}: nodes}, VOL)


def values(function):
    return CF(function)(mapped).reshape(len(cells), {{ output.nodes|length }}, -1)


at = values((x, y, z))


{% if has_system %}
A, r = system
A, r = from_nodes.T @ A[:count, :count] @ from_nodes, from_nodes.T @ r[:count]
held = abs(to_nodes) @ free[:count] == 0
values_at_nodes = lambda function: to_nodes @ function.vec.FV().NumPy()[:count]
write_system(scipy.sparse.find(A), r, held, values_at_nodes(goal), {{ "values_at_nodes(total), " if not has_state }}at_dofs, directions, sum((each[3] for each in found), []))


{% endif %}
{% include "write_vtu.py" %}
{% macro parts(u) %}{% for k in u.functions %}{{ part("total", k) }}{{ ", " if not loop.last }}{% endfor %}{% endmacro %}
{% if eigen %}
fields = {}
for number, mode in enumerate(modes.T):
    total.vec.FV().NumPy()[free] = mode
{% set u = unknowns[0] %}
    fields[f"{{ u.title }}{number + 1}"] = values({{ parts(u) if u.functions|length == 1 else "(" ~ parts(u) ~ ")" }})
write_vtu(writes, at, fields)
lines = [f"lambda{number + 1},{float(value)!r}\n" for number, value in enumerate(eigenvalues)]
Path(writes).with_suffix(".csv").write_text("".join(lines))
{% else %}
write_vtu(writes, at, { {%- for u in unknowns %}"{{ u.title }}": values({{ parts(u) if u.functions|length == 1 else "(" ~ parts(u) ~ ")" }}){{ ", " if not loop.last }}{% endfor -%} })
{% endif %}
