{% from "lists.py" import rows %}
{% from "newton.py" import newton %}
{# The dofs of an unknown, or of a component. #}
{% macro part(unknown, component) %}
{{ "np.arange(basis.N)" if unknowns|length == 1 else "basis.split_indices()[" ~ unknown ~ "]" }}
{%- if component is not none and unknowns[unknown].size is not none %}[{{ component }}::{{ unknowns[unknown].size }}]{% endif %}
{% endmacro %}
{# Unknowns at the points of a basis, under their names. #}
{% macro interpolated_from(names, dofs) %}
{% if names|length == 1 -%}
{"{{ names[0] }}" + mark: basis.interpolate({{ dofs }})}
{%- else -%}
dict(zip([name + mark for name in ("{{ names|join('", "') }}")], basis.interpolate({{ dofs }})))
{%- endif %}
{% endmacro %}
{% set kind = {"triangle": "Tri", "tetrahedron": "Tet", "quadrilateral": "Quad", "hexahedron": "Hex"}[cell.name] %}
{% set corners = "cells[:, [6, 2, 5, 7, 1, 3, 4, 0]]" if kind == "Hex" else "cells" %}
{% set point = axes|join(", ") %}
{% set tests = unknowns|map(attribute="test")|join(", ") %}
{% set increments = unknowns|map(attribute="increment")|join(", ") %}
{% include "head.py" %}
{% if means or has_system %}
import scipy.sparse
{% endif %}
import skfem
from scipy.sparse.linalg import {{ "eigsh" if eigen else "splu" }}{{ ", splu" if eigen and holds_wholes }}

{% include "read.py" %}
{% include "lengths.py" %}
{% if more.bends %}


def bent(kind):
    """An element with second derivatives, by central differences, which are exact for slopes that are quadratic."""

    class Bent(kind):
        def gbasis(self, mapping, X, i, tind=None):
            field, = super().gbasis(mapping, X, i, tind)
            slope = lambda X: np.asarray(self.lbasis(X, i)[1]) + 0*X
            shift = np.eye(len(X)).reshape(len(X), len(X), *[1]*(X.ndim - 1))
            own = np.array([slope(X + e) - slope(X - e) for e in shift])/2
            own = own if X.ndim == 3 else own[:, :, None]
            inverse = mapping.invDF(X, tind)
            own = np.broadcast_to(own, (*own.shape[:2], *inverse.shape[2:]))
            field.hess = np.einsum("abek,aiek,bjek->ijek", own, inverse, inverse)
            return field,

    return Bent()


{% endif %}
mesh = skfem.Mesh{{ kind }}(points.T.copy(), {{ corners }}.T.copy()){{ "  # its corners have an order of their own" if kind == "Hex" }}
element = {{ unknowns|map(attribute="element")|join(" * ") }}

# The quadrature points are given explicitly, so that all codes use the same.
rule = np.array({{ rows(rules[0].points, 2) }}).T, np.array({{ rows(rules[0].weights, 4) }})
facet_rule = np.array({{ rows(rules[1].points, 2) }}).T, np.array({{ rows(rules[1].weights, 4) }})
{% for rule in rules[2:] %}
{{ rule.word }} = np.array({{ rows(rule.points, 2) }}).T, np.array({{ rows(rule.weights, 4) }})
{% endfor %}

number = {tuple(vertices): i for i, vertices in enumerate(np.sort(mesh.facets, axis=0).T.tolist())}
boundary = np.array([number[tuple(sorted(vertices))] for vertices in facets.tolist()])
diameter = np.max([np.linalg.norm(mesh.p[:, mesh.t[i]] - mesh.p[:, mesh.t[j]], axis=0) for i in range(len(mesh.t)) for j in range(i)], axis=0)
{% if has_facet_length %}
lengths = np.array([longest_edge(vertices) for vertices in mesh.facets.T.tolist()])
{% endif %}
{% for datum in data %}
{% for part in datum.parts %}


def {{ part.name }}({{ point }}):
    return {{ part.at_points }}
{% endfor %}
{% endfor %}
{% for integral in more.integrals %}
{% set i = loop.index0 %}
{% set facets = ", facets=boundary[np.isin(labels, [" ~ integral.tags|join(", ") ~ "])]" if integral.tags else "" %}


# {{ integral.title }}
{% if integral.kind == "dx" %}
basis{{ i }} = skfem.Basis(mesh, element, quadrature={{ integral.rule_word }}
{%- if integral.tags %}, elements=np.flatnonzero(np.isin(regions, [{{ integral.tags|join(", ") }}])){% endif %})
{% elif integral.kind == "ds" %}
basis{{ i }} = skfem.FacetBasis(mesh, element, quadrature={{ integral.rule_word }}{{ facets }})
{% else %}
basis{{ i }}_plus, basis{{ i }}_minus = (skfem.InteriorFacetBasis(mesh, element, quadrature={{ integral.rule_word }}{{ facets }}, side=other) for other in (0, 1))
{% endif %}
{% for form in integral.forms if not (eigen and form.is_residual) %}


{% if form.is_residual %}
@skfem.LinearForm
def residual{{ i }}{{ form.test }}({{ tests }}, w):
{% else %}
@skfem.BilinearForm
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


basis = skfem.Basis(mesh, element, quadrature=rule)
total = basis.zeros()
{% if time %}
before = basis.zeros()
{% endif %}
{% if interpolated %}


def of_element(basis, element, mark):
    """The basis of another element at the same points."""
    if not mark:
        return basis.with_element(element)
    return skfem.InteriorFacetBasis(mesh, element, quadrature=basis.quadrature, facets=basis.find, side=int(mark == "_minus"))
{% endif %}


def given(basis, mark=""):
    """The unknowns and data at the points of a basis."""
    index = basis.tind if hasattr(basis, "tind") and basis.tind is not None else slice(None)
    all = {{ interpolated_from(unknowns|map(attribute="name")|list, "total") }}
{% if time %}
    all.update({{ interpolated_from(unknowns|map(attribute="old")|list, "before") }})
{% endif %}
{% for each in interpolated %}
    own = of_element(basis, skfem.Element{{ kind }}{{ "" if cell.is_cube else "P" }}{{ each.degree }}(), mark)
    all["{{ each.name }}" + mark] = own.interpolate({{ each.name }}(*own.doflocs))
{% endfor %}
{% if has_circumradius %}
    all["circumradius" + mark] = radii[index][:, None] + 0*basis.dx
{% endif %}
{% if has_facet_length %}
    if isinstance(basis, skfem.FacetBasis):
        all["facet_length"] = lengths[basis.find][:, None] + 0*basis.dx
{% endif %}
    return {**all, "h" + mark: diameter[index][:, None] + 0*basis.dx}


# Dirichlet values; where two groups share a dof, the later one counts.
held, goal = np.zeros(basis.N, bool), basis.zeros()
{% if holds_parts %}


def hold(group, part, g):
    found = basis.get_dofs(facets=boundary[labels == group]).flatten()
    dofs = found[np.isin(found, part)]
    held[dofs] = True
    goal[dofs] = g(*basis.doflocs[:, dofs])


{% endif %}
{% if holds_wholes %}


def hold_whole(group, part, element, trace, g):
    """Hold the normal or tangential moments of a vector on facets, by projection."""
    own = skfem.FacetBasis(mesh, element, facets=boundary[labels == group], quadrature=facet_rule)
    product = lambda u, v, n: sum(a*b for a, b in zip(trace(u, n), trace(v, n)))
    M = skfem.BilinearForm(lambda u, v, w: product(u, v, w.n)).assemble(own)
    b = skfem.LinearForm(lambda v, w: product(g(*w.x), v, w.n)).assemble(own)
    found = np.flatnonzero(M.diagonal() > 1e-10*M.diagonal().max())
    held[part[found]] = True
    goal[part[found]] = splu(M.tocsc()[found][:, found]).solve(b[found])


{% endif %}
{% if means %}

# The means are held by multipliers: the product of a row with dofs is the integral.
rows = np.array([{% for mean in means %}skfem.LinearForm(lambda {{ tests }}, w: {{ mean.test }} + 0*w.x[0]).assemble(basis){{ ", " if not loop.last }}{% endfor %}])
wanted = basis.dx.sum()*np.array([{{ means|map(attribute="value")|join(", ") }}])
{% endif %}
{% set hold %}
{% for one in held %}
{% if not one.is_whole %}
hold({{ one.tag }}, {{ part(one.unknown, one.component) }}, lambda {{ point }}: {{ one.values[0].at_points }})
{% else %}
{% set trace = trace(one.trace, "w[%]"|each(dim, 0), "n[%]"|each(dim, 0)) %}
hold_whole({{ one.tag }}, {{ part(one.unknown, none) }}, {{ one.element }}, lambda w, n: [{{ trace|join(", ") }}], lambda {{ point }}: [{{ one.values|map(attribute="at_points")|join(", ") }}])
{% endif %}
{% endfor %}
{% endset %}
{% set solve %}
{{ hold }}

{% call newton("abs(d).max(initial=0)", "abs(total).max()", free="free = ~held") %}
{% for integral in more.integrals %}
{% set i = loop.index0 %}
{% if integral.kind == "dS" %}
given{{ i }} = {**given(basis{{ i }}_plus, "_plus"), **given(basis{{ i }}_minus, "_minus")}
{% else %}
given{{ i }} = given(basis{{ i }})
{% endif %}
{% endfor %}
r = (
{% for call in more.forms if call.is_residual %}
    {{ "+ " if not loop.first }}residual{{ call.integral }}{{ call.test }}.assemble(basis{{ call.integral }}{{ call.test }}, **given{{ call.integral }})
{% endfor %}
)
A = (
{% for call in more.forms if not call.is_residual %}
    {{ "+ " if not loop.first }}derivative{{ call.integral }}{{ call.trial }}{{ call.test }}.assemble(basis{{ call.integral }}{{ call.trial }}, basis{{ call.integral }}{{ call.test }}, **given{{ call.integral }})
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

# The directions of dofs: constants, by projection.
whole = skfem.Basis(mesh, element)
M = skfem.BilinearForm(lambda {{ increments }}, {{ tests }}, w: 
{%- for u in unknowns %}{{ " + " if not loop.first }}{{ "sum(a*b for a, b in zip(" ~ u.increment ~ ", " ~ u.test ~ "))" if u.size is not none or u.is_vector else u.increment ~ "*" ~ u.test }}{% endfor %}).assemble(whole)
loads = [
{% for axis in axes %}
{% set i = loop.index0 %}
    skfem.LinearForm(lambda {{ tests }}, w: 0*w.x[0]
{%- for u in unknowns %}{% set count = dim if u.is_vector else (u.size or 1) %}{% if i < count %} + {{ u.test }}{{ "[" ~ i ~ "]" if u.size is not none or u.is_vector }}{% endif %}{% endfor %}).assemble(whole),
{% endfor %}
]
directions = splu(M.tocsc()).solve(np.column_stack(loads))
names = np.empty(basis.N, object)
for name, dofs in zip([{% for u in unknowns %}"{{ u.title }}", {% endfor %}], {{ "[slice(None)]" if unknowns|length == 1 else "basis.split_indices()" }}):
    names[dofs] = name
{% if has_state %}
total[:] = state(basis.doflocs.T, directions)
{% endif %}
{% endif %}
{% if eigen %}
{{ hold }}

# The equations of free dofs, so that those that are held are no modes.
free = ~held
{% for integral in more.integrals %}
{% set i = loop.index0 %}
{% if integral.kind == "dS" %}
given{{ i }} = {**given(basis{{ i }}_plus, "_plus"), **given(basis{{ i }}_minus, "_minus")}
{% else %}
given{{ i }} = given(basis{{ i }})
{% endif %}
{% endfor %}
{% for name, is_mass in [("A", false), ("M", true)] %}
{{ name }} = (
{% for call in more.forms|selectattr("is_mass", "eq", is_mass) if not call.is_residual %}
    {{ "+ " if not loop.first }}derivative{{ call.integral }}{{ call.trial }}{{ call.test }}.assemble(basis{{ call.integral }}{{ call.trial }}, basis{{ call.integral }}{{ call.test }}, **given{{ call.integral }})
{% endfor %}
).tocsc()[free][:, free]
{% endfor %}
start = np.random.default_rng(0).standard_normal(free.sum())
eigenvalues, found = eigsh(A, {{ eigen.count }}, M, sigma={{ eigen.shift }}, v0=start, ncv=min({{ 4*eigen.count + 20 }}, free.sum()))
modes = np.zeros((basis.N, len(eigenvalues)))
modes[free] = found
{% elif not time %}
{{ solve }}
{%- else %}

# Initial values.
{% for initial in time.initial %}
part = {{ part(initial.unknown, initial.component) }}
total[part] = (lambda {{ point }}: {{ initial.at_points }})(*basis.doflocs[:, part])
{% endfor %}

# Steps in time: {{ time.t }} is that at the end of a step.
for number in range(1, {{ time.steps + 1 }}):
    {{ time.t }} = number*{{ time.dt }}
    before[:] = total
{{ solve|within }}
{%- endif %}

# The values at the nodes of VTK's cells.
nodes = np.array([{% for node in output.nodes %}[{{ node[1:]|join(", ") }}]{{ ", " if not loop.last }}{% endfor %}]).T
at = np.moveaxis(mesh.mapping().F(nodes), 0, 2)
at = np.pad(at, ((0, 0), (0, 0), (0, {{ 3 - dim }})))
{{ "at_nodes" if eigen else "found" }} = skfem.Basis(mesh, element, quadrature=(nodes, np.ones(nodes.shape[1]))){{ ".interpolate(total)" if not eigen }}


{% if has_system %}
write_system(*system, held, goal, {{ "total, " if not has_state }}basis.doflocs.T, directions, names)


{% endif %}
{% include "write_vtu.py" %}
{% macro values(u, found) %}{{ found if u.size is none else "np.moveaxis(" ~ found ~ ", 0, 2)" }}{% endmacro %}
{% set one = unknowns|length == 1 %}
{% if eigen %}
write_vtu(writes, at, {f"{{ unknowns[0].title }}{number + 1}": {{ values(unknowns[0], "np.asarray(at_nodes.interpolate(mode))") }} for number, mode in enumerate(modes.T)})
lines = [f"lambda{number + 1},{float(value)!r}\n" for number, value in enumerate(eigenvalues)]
Path(writes).with_suffix(".csv").write_text("".join(lines))
{% else %}
write_vtu(writes, at, { {%- for u in unknowns %}"{{ u.title }}": {{ values(u, "np.asarray(found)" if one else "np.asarray(found[" ~ loop.index0 ~ "])") }}{{ ", " if not loop.last }}{% endfor -%} })
{% endif %}
