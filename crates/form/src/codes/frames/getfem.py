{% from "newton.py" import newton %}
{% set family = "QK" if cell.is_cube else "PK" %}
{% include "head.py" %}
import getfem as gf


{% include "read.py" %}
{% include "lengths.py" %}

gf.util_trace_level(0)
gf.util_warning_level(0)
{% if not cell.is_cube %}
mesh = gf.Mesh("ptND", points.T, cells.T)
{% else %}
mesh = gf.Mesh("empty", {{ dim }})
cells = cells[:, {{ cell.order }}]  # GetFEM counts corners along the axes in turn
mesh.add_convex(gf.GeoTrans("GT_QK({{ dim }},1)"), points[cells].transpose(2, 1, 0))
{% endif %}


def space(element, size=1):
    found = gf.MeshFem(mesh, size)
    found.set_fem(gf.Fem(element))
    return found


{% if cell.is_cube %}
own = mesh.pid_from_cvid(0)[0].tolist()
local = [[own.index(i) for i in mesh.pid_in_faces([[0], [side]])] for side in range({{ cell.facets }})]  # corners of the facets of a cell
faces = np.sort(cells[:, local], axis=2)
{% else %}
# Facet i of a cell lies opposite its vertex i.
faces = np.sort(np.stack([np.delete(cells, i, axis=1) for i in range({{ dim + 1 }})], axis=1), axis=2)
{% endif %}
sides = {tuple(face): divmod(i, {{ cell.facets }}) for i, face in enumerate(faces.reshape(-1, faces.shape[2]).tolist())}
on = np.array([sides[tuple(sorted(vertices))] for vertices in facets.tolist()])
{% for group in groups %}
{% if group.less == 0 %}
mesh.set_region({{ loop.index }}, np.flatnonzero(regions == {{ group.tag }})[None])  # {{ group.name }}
{% elif group.less == 1 %}
mesh.set_region({{ loop.index }}, on[labels == {{ group.tag }}].T)  # {{ group.name }}
{% endif %}
{% endfor %}
{% set boundary = groups|length + 1 %}
{% set between = groups|length + 2 %}
mesh.set_region({{ boundary }}, mesh.outer_faces())
mesh.set_region({{ between }}, mesh.inner_faces())

# Quadrature rules with the same points as in the other codes.
exact, facet = gf.MeshIm(mesh, gf.Integ("{{ rules[0].name }}")), gf.MeshIm(mesh, gf.Integ("{{ rules[1].name }}"))
model = gf.Model("real")
{% for parameter in parameters %}
model.add_initialized_data("{{ parameter.name }}", {{ parameter.name }})
{% endfor %}
{% if has_diameter %}
corners = points[cells]
longest = np.linalg.norm(corners[:, :, None] - corners[:, None], axis=3).max(axis=(1, 2))
model.add_initialized_fem_data("h", space("FEM_{{ family }}({{ dim }},0)"), longest)  # the longest edge of each cell
{% endif %}
{% if has_circumradius %}
model.add_initialized_fem_data("circumradius", space("FEM_PK({{ dim }},0)"), radii)
{% endif %}
{% if has_facet_length %}
# A facet of a cell is found by its normal in the reference cell, and has its longest edge there.
{% if cell.is_cube %}
corner = np.array([[i >> k & 1 for k in range({{ dim }})] for i in range({{ 2**dim }})])
normals = [corner[side].mean(axis=0)*2 - 1 for side in local]
{% else %}
normals = [[{{ dim }}**-0.5]*{{ dim }}, *(-np.eye({{ dim }}))]
{% endif %}
for i, normal in enumerate(normals):
    model.add_initialized_fem_data(f"length{i}", space("FEM_{{ family }}({{ dim }},0)"), [longest_edge(face) for face in faces[:, i].tolist()])
model.add_macro("own_normal", "Normalized(element_K'*Normal)")
steps = [f"length{i}*Heaviside(own_normal.[{','.join(map(str, normal))}] - 0.9)" for i, normal in enumerate(normals)]
model.add_macro("facet_length", f"({' + '.join(steps)})")
{% endif %}
{% for datum in data %}
{% for part in datum.parts %}
{% if datum.element %}
nodes = space("{{ datum.element }}")
model.add_initialized_fem_data("{{ part.name }}", nodes, (lambda {{ axes|join(", ") }}: {{ part.at_points }})(*nodes.basic_dof_nodes()))
{% else %}
model.add_macro("{{ part.name }}", "{{ part.text }}")
{% endif %}
{% endfor %}
{% endfor %}

spaces = {
{% for function in functions %}
    "{{ function.name }}": space("{{ function.element }}"{% if function.is_vector %}, {{ dim }}{% endif %}),
{% endfor %}
}
for name, of_it in spaces.items():
    model.add_fem_variable(name, of_it)
{% for function in functions if time %}
model.add_fem_data("{{ function.old }}", spaces["{{ function.name }}"])
{% endfor %}
{% for each in shared %}
model.add_macro("{{ each.name }}", "{{ each.value }}")
{% endfor %}
{% for integral in integrals %}

# {{ integral.title }}
F = (
{% for term in integral.terms %}
    "{{ term.text }}"
{% if not loop.last %}
    " + "
{% endif %}
{% endfor %}
)
{% set all = {"dx": "-1", "ds": boundary, "dS": between}[integral.kind] %}
for region in [{{ integral.places|join(", ") or all }}]:
    model.add_nonlinear_term({{ "exact" if integral.kind == "dx" else "facet" }}, F, region)
{% endfor %}
{% for mean in means %}
{% set m = "multiplier" ~ loop.index0 %}

# The mean is held by a multiplier.
model.add_variable("{{ m }}", 1)
model.add_nonlinear_term(exact, "{{ m }}*Test_{{ mean.name }} + ({{ mean.name }} - ({{ mean.value }}))*Test_{{ m }}")
{% endfor %}

# Dirichlet values; where two groups share a dof, the later one counts.
held = np.zeros(model.nbdof(), bool)
total, goal = np.zeros(len(held)), np.zeros(len(held))
{% if holds_parts %}


def hold(name, region, g):
    dofs = spaces[name].basic_dof_on_region(region)
    first, _ = model.interval_of_variable(name)
    held[first + dofs] = True
    goal[first + dofs] = g(*spaces[name].basic_dof_nodes(dofs))


{% endif %}
{% if holds_wholes %}


def hold_whole(name, region, product, load):
    """Hold the normal or tangential moments of a vector on facets, by projection."""
    M, b = (gf.asm_generic(facet, order, text, region, model, "select_output", *[name]*order) for order, text in ((2, product), (1, load)))
    first, size = model.interval_of_variable(name)
    diagonal = np.array(M.diag()).ravel()
    found = np.flatnonzero(diagonal > 1e-10*diagonal.max())
    held[first + found] = True
    goal[first + found] = gf.linsolve_mumps(gf.Spmat("copy", M, found, found), b[found]).ravel()


{% endif %}
{% set solve %}
{% for one in held %}
{% if not one.is_whole %}
hold("{{ one.name }}", {{ one.place }}, lambda {{ axes|join(", ") }}: {{ one.values[0].at_points }})
{% else %}
{% set n = "Normal(%)"|each(dim, 1) %}
{% set test = trace(one.trace, ("Test_" ~ one.name ~ "(%)")|each(dim, 1), n) %}
hold_whole(
    "{{ one.name }}",
    {{ one.place }},
    "{{ trace(one.trace, ("Test2_" ~ one.name ~ "(%)")|each(dim, 1), n)|dot(test) }}",
    "{{ trace(one.trace, one.values|map(attribute="text")|list, n)|dot(test) }}",
)
{% endif %}
{% endfor %}

{% call newton("abs(d).max(initial=0)", "abs(total).max()", free="free = np.flatnonzero(~held)") %}
model.to_variables(total)
model.assembly("build_all")
A = model.tangent_matrix()
{% if has_system %}
if step == 0:
    (starts, at_rows), values_of_A = A.csc_ind(), A.csc_val()
    system = (at_rows, np.repeat(np.arange(len(held)), np.diff(starts)), values_of_A), -model.rhs()
{% if has_state %}
    total[:] = 0
    continue
{% endif %}
{% endif %}
d = np.where(held, goal - total, 0.0)
r = (model.rhs() - A.mult(d))[free]
d[free] = gf.linsolve_mumps(gf.Spmat("copy", A, free, free), r).ravel()
total += d
{% endcall %}
model.to_variables(total)
{% endset %}
{% if has_system %}
{% include "system.py" %}

count = sum(of_it.nbdof() for of_it in spaces.values())  # behind them come multipliers of means
at_dofs, directions, names = np.zeros((count, {{ dim }})), np.zeros((count, 3)), [""]*count


def describe(title, name, component):
    """The places and directions of dofs: of functions of vectors, constants by projection."""
    first, size = model.interval_of_variable(name)
    dofs = slice(first, first + size)
    at_dofs[dofs], names[dofs] = spaces[name].basic_dof_nodes().T, [title]*size
    if component is not None:
        directions[dofs, component] = 1.0
        return
    integrate = lambda order, text: gf.asm_generic(exact, order, text, -1, model, "select_output", *[name]*order)
    M = integrate(2, f"Test2_{name}.Test_{name}")
    for k in range({{ dim }}):
        directions[dofs, k] = gf.linsolve_mumps(M, integrate(1, f"Test_{name}({k + 1})")).ravel()


{% for u in unknowns %}
{% if u.is_vector %}
describe("{{ u.title }}", "{{ u.name }}", None)
{% else %}
{% for part in u.parts %}
describe("{{ u.title }}", "{{ part.name }}", {{ loop.index0 }})
{% endfor %}
{% endif %}
{% endfor %}
{% if has_state %}
total[:count] = state(at_dofs, directions)
{% endif %}
{% endif %}
{% if not time %}
{{ solve }}
{%- else %}

# Initial values.
{% for initial in time.initial %}
first, size = model.interval_of_variable("{{ initial.name }}")
total[first : first + size] = (lambda {{ axes|join(", ") }}: {{ initial.at_points }})(*spaces["{{ initial.name }}"].basic_dof_nodes())
{% endfor %}

# Steps in time: {{ time.t }} is that at the end of a step.
for number in range(1, {{ time.steps + 1 }}):
    {{ time.t }} = number*{{ time.dt }}
    model.set_variable("{{ time.t }}", {{ time.t }})
    model.to_variables(total)
{% for function in functions %}
    model.set_variable("{{ function.old }}", model.variable("{{ function.name }}"))
{% endfor %}
{% for each in interpolated %}
    nodes = space("{{ each.element }}").basic_dof_nodes()
    model.set_variable("{{ each.name }}", (lambda {{ axes|join(", ") }}: {{ each.at_points }})(*nodes))
{% endfor %}
{{ solve|within }}
{%- endif %}

# The values at the nodes of VTK's cells.
output = space("FEM_{{ family }}_DISCONTINUOUS({{ dim }},{{ output.degree }})")
nodes = np.array([{% for node in output.nodes %}[{{ node[1:]|join(", ") }}]{{ ", " if not loop.last }}{% endfor %}])
own = gf.Fem("FEM_{{ family }}_DISCONTINUOUS({{ dim }},{{ output.degree }})").pts().T
order = np.linalg.norm(nodes[:, None] - own, axis=2).argmin(axis=1)
dofs = output.basic_dof_from_cvid()[0].reshape(len(cells), -1)[:, order]
at = np.pad(output.basic_dof_nodes().T[dofs], ((0, 0), (0, 0), (0, {{ 3 - dim }})))


def values(*names):
    found = [gf.compute_interpolate_on(spaces[name], model.variable(name), output) for name in names]
    each = [part[dofs] for values in found for part in np.atleast_2d(values)]
    return np.stack(each, axis=2)


{% if has_system %}
A, r = system
inside = (A[0] < count) & (A[1] < count)
write_system([each[inside] for each in A], r[:count], held[:count], goal[:count], {{ "total[:count], " if not has_state }}at_dofs, directions, names)


{% endif %}
{% include "write_vtu.py" %}
{% macro names(u) %}"{{ u.name if u.is_vector else u.parts|map(attribute="name")|join('", "') }}"{% endmacro %}
write_vtu(writes, at, { {%- for u in unknowns %}"{{ u.title }}": values({{ names(u) }}){{ ", " if not loop.last }}{% endfor -%} })
