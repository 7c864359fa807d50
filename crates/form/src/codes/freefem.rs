//! FreeFEM: the form as `varf` in scalars, on meshes of triangles or tetrahedra, without plugins.

use faceoff_fem::quadrature::Rule;
use minijinja::{Value, context};

use super::python::{LEAVES, USUAL};
use super::speaker::Speaker;
use super::spelling::Style;
use super::table::{Code, Leaves};
use crate::grid::Cells;
use crate::problem::{Domain, Element, Initial, Problem, Space};
use crate::scalar::{Length, Side};

/// FreeFEM 4, by the program without graphics.
pub const CODE: Code = Code {
    name: "freefem",
    suffix: ".edp",
    command: &["FreeFem++-nw", "-v", "0"],
    mesh: ("medit", "mesh"),
    frame: include_str!("frames/freefem.edp"),
    reserved: &[RESERVED],
    first: 1,
    mark: 'X',
    pi: "pi",
    normals: ["N.x", "N.y", "N.z"],
    length: |length, dim| match (length, dim) {
        (Length::Facet, 2) => "lenEdge",
        (Length::Facet, _) => "facetlength(nuTriangle, N.x, N.y, N.z)",
        (Length::Diameter, 2) => "hTriangle",
        (Length::Diameter, _) => "hK",
        _ => length.name(),
    },
    // The jump is the value in the other cell minus that in this one.
    on_side: |value, side| match side {
        Side::Minus => format!("({value} + jump({value}))"),
        _ => value,
    },
    leaves: Leaves {
        name: |of, leaf| of.words.part(leaf).to_owned(),
        first: "d@(%)",
        second: "d@(%)",
        index: |_| String::new(),
        sided_data: false,
        ..LEAVES
    },
    form: STYLE,
    formulas: Style {
        choice: |sign, [a, b, c, d]| format!("(({a} {sign} {b}) ? ({c}) : ({d}))"),
        ..STYLE
    },
    brackets: true,
    element,
    rules,
    by_hand: |_, _| true,
    lacks,
    more,
    has_eigen: true,
    ..USUAL
};

/// The same with contact in elasticity as in `freefem/elastic.idp`.
pub const ELASTIC: Code = Code {
    by_hand_scheme: Some(include_str!("../../../../freefem/elastic.idp")),
    reserved: &[RESERVED, OF_SCHEME],
    lacks: |problem| match problem.dim {
        2 => lacks(problem),
        _ => Err("freefem/elastic.idp is for the plane; take another code".into()),
    },
    ..CODE
};

/// Names in the scheme.
const OF_SCHEME: &str = "mu lambda divergence strain stress11 stress22 stress12 traction1 traction2 un sigman Pn law dLaw contactTest ut sigmat Pt slip dSlip slipTest \
    shear dShear overJumps loads tractionsOn energy elasticResidual elasticDerivative e1 e2 s f1 f2 t1 t2 psi GammaC GammaN onCells onFaces planeStress hasJumps hasLoad hasTractions hasFriction hasCoulomb coefficient radius dRadius";

const STYLE: Style = Style {
    call: |function, arguments| format!("{}({})", function.names()[1], arguments.join(", ")),
    power: |base, n| n.after(base, "^"),
    // `?:` cannot be combined with varf.
    choice: |sign, [a, b, c, d]| {
        let or = match sign {
            "<" => ">=",
            "<=" => ">",
            ">" => "<=",
            _ => "<",
        };
        format!("(({a} {sign} {b})*({c}) + ({a} {or} {b})*({d}))")
    },
};

/// Reserved words of FreeFEM, and names of the frame.
const RESERVED: &str = "EigenValue mode rawvector sigma sym tol maxit ncv eigenvalues modes mass shifted converged M folder writeSystem S columns entries rows toA tob put of0i of1i of2i of3i of4i of5i x y z N P label region nuTriangle nuEdge hTriangle lenEdge area volume pi i Th Vh Out F J Th0 X Y Z A r d it e k \
    mesh mesh3 real int func macro varf string result order file values fixed held dx dy dz dxx dyy jump mean average on int1d int2d int3d \
    P0 P1 P2 P3 P1nc P1dc P2dc P1b sin C D from to own drawnBack cos tan exp log sqrt abs min max pow atan2 asin acos atan sinh cosh tanh cout cin endl square \
    trunc matrix complex bool if else for while break continue return try catch true false verbosity ARGV CG LU UMFPACK sparsesolver \
    clock exit assert load include plot border solve problem fespace ofstream ifstream set qft qfe qfV tgv solver hK edge Rh circumradius facetlength name reads writes done j there value where out Hh DP qf1pE qf2pE qf3pE qf5pE qf2pT qf5pT qfV2 qfV5 readmesh readmesh3 given rest least moments M row gap J0 rm dm n RT0 RT03d RT0Ortho Edge03d dxy dxz dyy dyz dzz mean dofs P1dc3d phase lengths";

fn element(problem: &Problem, space: Space) -> Result<String, String> {
    let dim = problem.dim;
    let name = match (space.element, dim) {
        (Element::Continuous(1), _) => "P1",
        (Element::Continuous(2), _) => "P2",
        (Element::Broken(0), _) => "P0",
        (Element::Broken(1), _) => {
            if dim == 2 {
                "P1dc"
            } else {
                "P1dc3d"
            }
        }
        (Element::CrouzeixRaviart, 2) => "P1nc",
        (Element::RaviartThomas, 2) => "RT0",
        (Element::RaviartThomas, _) => "RT03d",
        (Element::Nedelec, 2) => "RT0Ortho",
        (Element::Nedelec, _) => "Edge03d",
        (other, _) => {
            return Err(format!(
                "FreeFEM without plugins has no {} in {dim}D",
                other.name()
            ));
        }
    };
    Ok(name.into())
}

/// The rules that FreeFEM has built in.
fn rules(problem: &Problem) -> Result<Vec<&'static str>, String> {
    let name = |rule: &Rule| match rule.name {
        "midpoint" => "qfe=qf1pE",
        "centroid" if rule.points[0].len() == 2 => "qft=qf1pT",
        "centroid" => "qfV=qfV1",
        "radon-7" => "qft=qf5pT",
        "edges-3" => "qft=qf2pT",
        "gauss-5" => "qfe=qf5pE",
        "gauss-3" => "qfe=qf3pE",
        "gauss-2" => "qfe=qf2pE",
        "walkington-14" => "qfV=qfV5",
        _ => "qfV=qfV2",
    };
    Ok(problem.all_rules().iter().map(name).collect())
}

fn lacks(problem: &Problem) -> Result<(), String> {
    if problem.cells == Cells::Cubes {
        let (cells, dim) = (problem.cells, problem.dim);
        return Err(format!(
            "FreeFEM has no {}, only {}",
            cells.names(dim),
            Cells::Simplices.names(dim)
        ));
    }
    let mut measures = problem.integrals.iter().map(|i| i.measure.domain);
    if problem.dim == 3 && measures.any(|domain| domain == Domain::Interior) {
        return Err("FreeFEM has no integrals over interior faces in 3D".into());
    }
    let is_drawn =
        |start: &Initial| problem.unknowns[start.unknown].space.element == Element::Broken(1);
    match problem
        .time
        .iter()
        .flat_map(|time| &time.initial)
        .any(is_drawn)
    {
        true => Err(
            "FreeFEM interpolates DG1 at points inside of cells, and other codes at the vertices"
                .into(),
        ),
        false => Ok(()),
    }
}

/// Names for the selection of facets of groups between cells.
fn more(of: &mut Speaker<'_>) -> Value {
    let residual = of.problem.residual();
    let marks = residual.iter().map(|i| {
        let is_marked = i.measure.domain == Domain::Interior && !i.measure.groups.is_empty();
        is_marked.then(|| of.words.fresh("marked"))
    });
    context! { marks => marks.collect::<Value>() }
}
