{% from "lists.py" import rows %}
{% from "newton.py" import newton %}
{% macro number(value) %}fem.Constant(mesh, PETSc.ScalarType({{ value }})){% endmacro %}
{# The space of an unknown, or of a component. #}
{% macro part(unknown, component) %}
V{{ ".sub(" ~ unknown ~ ")" if unknowns|length > 1 }}
{{- ".sub(" ~ component ~ ")" if component is not none and unknowns[unknown].size is not none }}
{%- endmacro %}
{% set total = unknowns[0].name if unknowns|length == 1 else "w" %}
{% set imports = ["logging"] %}
{% include "head.py" %}
import basix
import dolfinx
{% if holds_wholes or means %}
import scipy.sparse
from scipy.sparse.linalg import splu
{% endif %}
import ufl
from dolfinx import fem, graph, io
from dolfinx.fem import petsc
from mpi4py import MPI
from petsc4py import PETSc
{% if eigen %}
from slepc4py import SLEPc
{% endif %}
from ufl import (
    CellDiameter, FacetNormal, Identity, Measure, SpatialCoordinate, TestFunction, TestFunctions, acos, as_tensor, asin, atan, avg,
    conditional, cos, cosh, cross, curl, derivative, det, dev, div, dot, exp, ge, grad, gt, inner, inv, jump, le, ln, lt, max_value,
    min_value, outer, pi, sign, sin, sinh, skew, sqrt, sym, tan, tanh, tr, transpose,
)

logging.getLogger("UFL").setLevel(logging.ERROR)  # it warns of arrays, as the points of rules are

{% include "read.py" %}

{% if cell.is_cube %}
{% if dim == 3 %}
# dolfinx counts corners along x, then y, then z.
cells, facets = cells[:, {{ cell.order }}], facets[:, [0, 1, 3, 2]]
{% else %}
cells = cells[:, {{ cell.order }}]  # dolfinx counts corners along x, then y
{% endif %}
{% endif %}

old = not hasattr(fem, "functionspace")  # before 0.7


def element(family, degree, size=None):
    variant = basix.LagrangeVariant.equispaced if degree > 2 else basix.LagrangeVariant.unset  # nodes of P3 at thirds
    if old and degree > 2:
        scalar = basix.ufl_wrapper.create_element("P", "{{ cell.name }}", degree, variant)
    elif old:
        scalar = ufl.FiniteElement(family, "{{ cell.name }}", degree)
    else:
        return basix.ufl.element(family, "{{ cell.name }}", degree, variant, shape=None if size is None else (size,))
    return scalar if size is None else ufl.VectorElement(scalar, dim=size)


def space(mesh, element):
    return fem.FunctionSpace(mesh, element) if old else fem.functionspace(mesh, element)


lines = ufl.Mesh(element("Lagrange", 1, {{ dim }})) if old else element("Lagrange", 1, {{ dim }})
mesh = dolfinx.mesh.create_mesh(MPI.COMM_WORLD, cells, points, lines) if old else dolfinx.mesh.create_mesh(
    MPI.COMM_WORLD, cells=cells, x=points, e=lines
)


def marked(rank, vertices, numbers):
    """The group numbers of entities; dolfinx has renumbered the mesh."""
    mesh.topology.create_connectivity(rank, 0)
    mesh.topology.create_connectivity(rank, {{ dim }})
    found, numbers = io.distribute_entity_data(getattr(mesh, "_mesh", mesh), rank, vertices, numbers)
    adjacency = getattr(graph, "adjacencylist", None) or graph.create_adjacencylist
    return dolfinx.mesh.meshtags_from_entities(mesh, rank, adjacency(found), numbers.astype(np.int32))


facet_tags, cell_tags = marked({{ dim - 1 }}, facets, labels), marked({{ dim }}, cells, regions)


# The quadrature points are given explicitly, so that all codes use the same.
md = {
    "quadrature_rule": "custom",
    "quadrature_points": np.array({{ rows(rules[0].points, 2)|indent(4) }}),
    "quadrature_weights": np.array({{ rows(rules[0].weights, 4)|indent(4) }}),
}
dx = Measure("dx", domain=mesh, subdomain_data=cell_tags, metadata=md)
{% for rule in rules[2:] %}
md{{ loop.index + 1 }} = {
    "quadrature_rule": "custom",
    "quadrature_points": np.array({{ rows(rule.points, 2)|indent(4) }}),
    "quadrature_weights": np.array({{ rows(rule.weights, 4)|indent(4) }}),
}
{% endfor %}
{% for kind in more.facets %}
{% if loop.first %}
md = {
    "quadrature_rule": "custom",
    "quadrature_points": np.array({{ rows(rules[1].points, 2)|indent(4) }}),
    "quadrature_weights": np.array({{ rows(rules[1].weights, 4)|indent(4) }}),
}
{% endif %}
{{ kind }} = Measure("{{ kind }}", domain=mesh, subdomain_data=facet_tags, metadata=md)
{% endfor %}
{% if more.has_cofactors %}


def cofac(A):
    """The matrix of cofactors, det(A) inv(A).T; UFL's own is its transpose in some releases."""
    if A.ufl_shape == (2, 2):
        return as_tensor([[A[1, 1], -A[1, 0]], [-A[0, 1], A[0, 0]]])
    minor = lambda i, j, k, l: A[i, j]*A[k, l] - A[i, l]*A[k, j]
    rows = [[minor((i + 1) % 3, (j + 1) % 3, (i + 2) % 3, (j + 2) % 3) for j in range(3)] for i in range(3)]
    return as_tensor(rows)


{% endif %}
{% if more.has_flat_jumps %}


def jump(v, n=None):
    """UFL's own, but for a gradient that is 0, as that of P0, whose jump is no scalar there."""
    return ufl.jump(v, n) if n is None or not v.ufl_shape else dot(v("+"), n("+")) + dot(v("-"), n("-"))


{% endif %}
{% if more.has_angle %}
atan2 = getattr(ufl, "atan2", None) or ufl.atan_2
{% endif %}
x = SpatialCoordinate(mesh)
{% if more.has_normal %}
n = FacetNormal(mesh)
{% endif %}
{% if has_diameter %}
h = CellDiameter(mesh)
{% endif %}
{% if has_circumradius %}
circumradius = ufl.Circumradius(mesh)
{% endif %}
{% if has_facet_length %}
edges = [ufl.geometry.FacetJacobian(mesh)[:, k] for k in range({{ dim - 1 }})]  # from one vertex of the facet
{% if dim == 3 %}
edges.append(edges[1] - edges[0])
{% endif %}
{% set squares = "dot(edges[%], edges[%])"|each(2*dim - 3, 0) %}
facet_length = sqrt({{ squares[0] if dim == 2 else "max_value(max_value(" ~ squares[0] ~ ", " ~ squares[1] ~ "), " ~ squares[2] ~ ")" }})
{% endif %}
{% for parameter in parameters %}
{{ parameter.name }} = {{ number(parameter.name) }}
{% endfor %}
{% for datum in data %}
{% if datum.element %}
{% for part in datum.parts %}
{{ part.name }} = fem.Function(space(mesh, {{ datum.element }}))
{{ part.name }}.interpolate(lambda x: {{ part.at_points }})
{% endfor %}
{% endif %}
{% set values = more.data[loop.index0] %}
{% if datum.shape|length == 1 %}
{{ datum.name }} = as_tensor([{{ values|join(", ") }}])
{% elif datum.shape|length == 2 %}
{{ datum.name }} = as_tensor([{% for row in values|batch(datum.shape[1]) %}[{{ row|join(", ") }}]{{ ", " if not loop.last }}{% endfor %}])
{% elif not datum.element %}
{{ datum.name }} = {{ values[0] }}
{% endif %}
{% endfor %}

{% if unknowns|length == 1 %}
V = space(mesh, {{ unknowns[0].element }})
{{ total }} = {{ "ufl.TrialFunction(V)" if eigen else "fem.Function(V)" }}
{{ unknowns[0].test }} = TestFunction(V)
{% if time %}
{{ unknowns[0].old }} = before = fem.Function(V)
{% endif %}
{% else %}
parts = [{{ unknowns|map(attribute="element")|join(", ") }}]
V = space(mesh, ufl.MixedElement(parts) if old else basix.ufl.mixed_element(parts))
w = fem.Function(V)
{{ unknowns|map(attribute="name")|join(", ") }} = ufl.split(w)
{{ unknowns|map(attribute="test")|join(", ") }} = TestFunctions(V)
{% if time %}
before = fem.Function(V)
{{ unknowns|map(attribute="old")|join(", ") }} = ufl.split(before)
{% endif %}
{% endif %}
{% if eigen %}
J = (
    {{ more.form|indent(4) }}
)
mass = (
    {{ more.mass[0]|indent(4) }}
)
{% else %}
{% if scheme %}


{{ scheme.text }}


given = { {%- for name in ["E", "nu", "gamma0", "theta1", "theta2"] %}"{{ name }}": {{ name }}, {% endfor %}"psi": {{ scheme.psi.name }}
{%- for name in ["f", "t", "along", "friction", "coulomb"] if scheme[name] %}, "{{ name }}": {{ scheme[name].name }}{% endfor -%}
{{ ', "plane_stress": True' if scheme.is_stress }}{{ ', "beta": beta, "h_F": facet_length' if scheme.has_jumps }}}
F = elastic_form({{ total }}, {{ unknowns[0].test }}, given, dx, ds(({{ scheme.contact|join(", ") }},)), {{ "ds((" ~ scheme.neumann|join(", ") ~ ",))" if scheme.neumann else none }}, {{ "dS" if scheme.has_jumps else none }})
{% else %}
F = (
    {{ more.form|indent(4) }}
)
{% endif %}
J = derivative(F, {{ total }})
{% endif %}

# Dirichlet values; where two groups share a dof, the later one counts.
fixed, goal = [], fem.Function(V)
{% if holds_parts %}


def hold(part, group, g):
    found = facet_tags.find(group)
    if part is V:
        values = fem.Function(V)
        dofs = own = fem.locate_dofs_topological(V, {{ dim - 1 }}, found)
    else:
        values = fem.Function(part.collapse()[0])
        dofs, own = fem.locate_dofs_topological((part, values.function_space), {{ dim - 1 }}, found)
    values.interpolate(g)
    goal.x.array[dofs] = values.x.array[own]
    fixed.append(dofs)


{% endif %}
{% if holds_wholes %}


normal = lambda w: [{{ trace("normal", "w[%]"|each(dim, 0), "n[%]"|each(dim, 0))|join(", ") }}]
tangential = lambda w: [{{ trace("tangential", "w[%]"|each(dim, 0), "n[%]"|each(dim, 0))|join(", ") }}]


def hold_whole(part, group, trace, g):
    """Hold the normal or tangential moments of a vector on facets, by projection."""
    own, dofs = (V, np.arange(len(goal.x.array))) if part is V else part.collapse()
    q, v = ufl.TrialFunction(own), TestFunction(own)
    product = lambda a, b: sum(i*j for i, j in zip(trace(a), trace(b)))*ds(group)
    M = petsc.assemble_matrix(fem.form(product(q, v)))
    M.assemble()
    M = scipy.sparse.csr_matrix(M.getValuesCSR()[::-1])
    b = petsc.assemble_vector(fem.form(product(g, v))).array
    found = np.flatnonzero(M.diagonal() > 1e-10*M.diagonal().max())
    dofs = np.asarray(dofs)[found]
    goal.x.array[dofs] = splu(M.tocsc()[found][:, found]).solve(b[found])
    fixed.append(dofs)


{% endif %}
{% if means %}

# The means are held by multipliers: the product of a row with dofs is the integral.
rows = np.array([{% for mean in means %}petsc.assemble_vector(fem.form({{ mean.test }}*dx)).array{{ ", " if not loop.last }}{% endfor %}])
volume = fem.assemble_scalar(fem.form(fem.Constant(mesh, PETSc.ScalarType(1.0))*dx))
wanted = volume*np.array([{{ means|map(attribute="value")|join(", ") }}])
{% endif %}
{% if not eigen %}
F, J = fem.form(F), fem.form(J)
{% endif %}
{% set hold %}
{% for one in held %}
{% if not one.is_whole %}
hold({{ part(one.unknown, one.component) }}, {{ one.tag }}, lambda x: {{ one.values[0].at_points }})
{% else %}
{# A form without its coefficients, which are 0, has no mesh. #}
hold_whole({{ part(one.unknown, none) }}, {{ one.tag }}, {{ one.trace }}, as_tensor([
{%- for value in one.values %}{{ number(value.constant) if value.constant else value.text }}{{ ", " if not loop.last }}{% endfor %}]))
{% endif %}
{% endfor %}
held = np.unique(np.concatenate([*fixed, []])).astype(np.int32)
{% endset %}
{% set solve %}
fixed.clear()
{{ hold }}

{% call newton("abs(d.array).max()", "abs(" ~ total ~ ".x.array).max()") %}
A = petsc.assemble_matrix(J)
A.assemble()
r = petsc.assemble_vector(F)
{% if has_system %}
if step == 0:
    first, *found = A.getValuesCSR()
    system = (np.repeat(np.arange(len(first) - 1), np.diff(first)), *found), r.array.copy()
{% if has_state %}
    {{ total }}.x.array[:] = 0
    continue
{% endif %}
{% endif %}
d = A.createVecRight()
d.array[held] = ({{ total }}.x.array - goal.x.array)[held]
{% if means %}
A = scipy.sparse.csr_matrix(A.getValuesCSR()[::-1])
free = np.setdiff1d(np.arange(len(d.array)), held)
border = scipy.sparse.csc_matrix(rows[:, free])
both = scipy.sparse.bmat([[A.tocsc()[free][:, free], border.T], [border, None]], format="csc")
right = np.concatenate([(r.array - A @ d.array)[free], rows @ {{ total }}.x.array - wanted])
d.array[free] = splu(both).solve(right)[: len(free)]
{% else %}
A.zeroRowsColumns(held, 1.0, d, r)
solver = PETSc.KSP().create(mesh.comm)
solver.setOperators(A)
solver.setType("preonly")
solver.getPC().setType("lu")
solver.getPC().setFactorSolverType("mumps")
solver.getPC().setFactorSetUpSolverType()
solver.getPC().getFactorMatrix().setMumpsIcntl(14, 200)  # room to pivot, in percent
solver.setErrorIfNotConverged(True)
solver.solve(r, d)
{% endif %}
{{ total }}.x.array[:] -= d.array
{% endcall %}
{% endset %}
{% if has_system %}
{% include "system.py" %}
at_dofs, directions = np.zeros((2, len(goal.x.array), 3))
names = [""]*len(at_dofs)


def describe(name, part):
    """The places and directions of dofs, by interpolation of constants and coordinates."""
    own, dofs = (V, np.arange(len(goal.x.array))) if part is V else part.collapse()
    function, dofs = fem.Function(own), np.asarray(dofs)
    size = function.ufl_shape[0] if function.ufl_shape else None

    def along(axis, f):
        function.interpolate(lambda x: f(x) if size is None else np.array([f(x) if i == axis else 0*x[0] for i in range(size)]))
        return function.x.array.copy()

    d = np.array([along(i, lambda x: 1 + 0*x[0]) for i in range(size or 1)])
    directions[dofs, : len(d)] = d.T
    for k in range({{ dim }}):
        at_dofs[dofs, k] = sum(d[i]*along(i, lambda x: x[k]) for i in range(len(d)))/(d**2).sum(axis=0)
    for dof in dofs:
        names[dof] = name


{% for u in unknowns %}
describe("{{ u.title }}", {{ part(loop.index0, none) }})
{% endfor %}
{% if has_state %}
{{ total }}.x.array[:] = state(at_dofs, directions)
{% endif %}
{% endif %}
{% if eigen %}

{{ hold }}

# The equations of free dofs, so that those that are held are no modes.
free = PETSc.IS().createGeneral(np.setdiff1d(np.arange(len(goal.x.array)), held).astype(np.int32))
A, M = (petsc.assemble_matrix(fem.form(form)) for form in (J, mass))
A.assemble()
M.assemble()
A, M = A.createSubMatrix(free, free), M.createSubMatrix(free, free)
solver = SLEPc.EPS().create(mesh.comm)
solver.setOperators(A, M)
solver.setProblemType(SLEPc.EPS.ProblemType.GHEP)
solver.setTarget({{ eigen.shift }})
solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
solver.setDimensions({{ eigen.count }}, min({{ 4*eigen.count + 20 }}, free.getSize()))
solver.setTolerances(1e-14, 1000)
transformation = solver.getST()
transformation.setType(SLEPc.ST.Type.SINVERT)
transformation.getKSP().setType("preonly")
transformation.getKSP().getPC().setType("lu")
transformation.getKSP().getPC().setFactorSolverType("mumps")
solver.solve()
if solver.getConverged() < {{ eigen.count }}:
    sys.exit(f"Only {solver.getConverged()} eigenvalues converged.")
modes, eigenvalues, found = [], [], A.createVecRight()
for number in range({{ eigen.count }}):
    eigenvalues.append(float(solver.getEigenpair(number, found).real))
    modes.append(fem.Function(V))
    modes[-1].x.array[free.getIndices()] = found.array
{% elif not time %}

{{ solve }}
{%- else %}


def start(total, part, g):
    """Interpolate the initial value of a part."""
    own, dofs = (V, slice(None)) if part is V else part.collapse()
    values = fem.Function(own)
    values.interpolate(g)
    total.x.array[dofs] = values.x.array


{% for initial in time.initial %}
start({{ total }}, {{ part(initial.unknown, initial.component) }}, lambda x: {{ initial.at_points }})
{% endfor %}

# Steps in time: {{ time.t }} is that at the end of a step.
for number in range(1, {{ time.steps + 1 }}):
    {{ time.t }}.value = number*{{ time.dt }}.value
    before.x.array[:] = {{ total }}.x.array
{% for each in interpolated %}
    {{ each.name }}.interpolate(lambda x: {{ each.at_points }})
{% endfor %}
{{ solve|within }}
{%- endif %}


# The values at the nodes of VTK's cells.
nodes = np.array([{% for node in output.nodes %}[{{ node[1:]|join(", ") }}]{{ ", " if not loop.last }}{% endfor %}])


def values(expression):
    found = fem.Expression(expression, nodes)
    each = np.arange(len(cells), dtype=np.int32)
    return (found.eval(each) if old else found.eval(mesh, each)).reshape(len(cells), len(nodes), -1)


at = values(x)
at = np.pad(at, ((0, 0), (0, 0), (0, 3 - at.shape[2])))


{% if has_system %}
is_held = np.zeros(len(goal.x.array), bool)
is_held[held] = True
write_system(*system, is_held, goal.x.array, {{ total ~ ".x.array, " if not has_state }}at_dofs, directions, names)


{% endif %}
{% include "write_vtu.py" %}
{% if eigen %}
write_vtu(writes, at, {f"{{ unknowns[0].title }}{number + 1}": values(mode) for number, mode in enumerate(modes)})
lines = [f"lambda{number + 1},{float(value)!r}\n" for number, value in enumerate(eigenvalues)]
Path(writes).with_suffix(".csv").write_text("".join(lines))
{% else %}
write_vtu(writes, at, { {%- for u in unknowns %}"{{ u.title }}": values({{ u.name }}){{ ", " if not loop.last }}{% endfor -%} })
{% endif %}
