//! Bodies of many shapes by each way to solve them: does `auto` choose the fastest?
//!
//! Times are seconds of one core, spent by one thread: what else a machine does hardly counts.

use faceoff_fem::contact::{Discretisation, Iteration, Problem, Stop, solve_by};
use faceoff_fem::linear::{Settings, Solver};
use faceoff_fem::scene::{GroupName, Scene};
use faceoff_mesh::mesh::{CellBlock, CellKind, Group, Mesh, Triangulation};
use nix::sys::resource::{UsageWho, getrusage};
use std::collections::BTreeMap;

/// A dense contact system of more multiplications and additions is not tried: minutes.
const TOO_MANY: f64 = 1e11;

/// A way that takes less than so many times the best is taken again, so often: the least counts.
const NEAR: f64 = 3.0;
const REPEATS: usize = 3;
/// `auto` is to take at most so many times the best.
const GOAL: f64 = 1.3;

/// Unit cubes of a lattice, those that `has`, each cut by the paths of Kuhn (1960).
pub struct Shape {
    name: &'static str,
    cells: [usize; 3],
    has: fn([usize; 3], [usize; 3]) -> bool,
    contact: Contact,
}

#[derive(Clone, Copy, PartialEq)]
enum Contact {
    /// Below, and Γ_D above.
    Below,
    /// Below and above, and Γ_D is the rest.
    BothSides,
    /// On all of the lower half, and Γ_D is the upper one.
    LowerHalf,
}

pub const fn shape(name: &'static str, cells: [usize; 3]) -> Shape {
    Shape {
        name,
        cells,
        has: |_, _| true,
        contact: Below,
    }
}

/// With `has` or another contact.
const fn body(
    name: &'static str,
    cells: [usize; 3],
    has: fn([usize; 3], [usize; 3]) -> bool,
    contact: Contact,
) -> Shape {
    Shape {
        name,
        cells,
        has,
        contact,
    }
}

fn whole(_: [usize; 3], _: [usize; 3]) -> bool {
    true
}

/// Four columns of eight are teeth, below a back of a third.
fn comb([i, j, _]: [usize; 3], n: [usize; 3]) -> bool {
    3 * j >= 2 * n[1] || i % 8 < 4
}

fn wide_comb([i, j, _]: [usize; 3], n: [usize; 3]) -> bool {
    2 * j >= n[1] || i % 16 < 8
}

/// The same in space.
fn brush([i, j, k]: [usize; 3], n: [usize; 3]) -> bool {
    3 * k >= 2 * n[2] || (i % 4 < 2 && j % 4 < 2)
}

/// A disc, or a ball.
fn ball(at: [usize; 3], n: [usize; 3]) -> bool {
    let axes = at.into_iter().zip(n).filter(|(_, n)| *n > 0);
    let from_centre = axes.map(|(k, n)| (2.0 * k as f64 + 1.0) / n as f64 - 1.0);
    from_centre.map(|x| x * x).sum::<f64>() < 1.0
}

fn with_hole(at: [usize; 3], n: [usize; 3]) -> bool {
    let axes = at.into_iter().zip(n).filter(|(_, n)| *n > 0);
    !axes.into_iter().all(|(k, n)| 3 * k >= n && 3 * k < 2 * n)
}

use Contact::{Below, BothSides, LowerHalf};

const SHAPES: [Shape; 60] = [
    shape("square", [16, 16, 0]),
    shape("square", [32, 32, 0]),
    shape("square", [64, 64, 0]),
    shape("square", [128, 128, 0]),
    shape("square", [200, 200, 0]),
    shape("strip", [500, 4, 0]),
    shape("strip", [1000, 4, 0]),
    shape("strip", [2000, 4, 0]),
    shape("strip", [4000, 4, 0]),
    shape("strip", [8000, 4, 0]),
    shape("strip", [8000, 1, 0]),
    shape("strip", [2000, 2, 0]),
    shape("strip", [500, 16, 0]),
    shape("strip", [2000, 16, 0]),
    shape("strip", [1000, 40, 0]),
    shape("strip", [500, 100, 0]),
    shape("strip", [200, 50, 0]),
    shape("tower", [1, 4000, 0]),
    shape("tower", [8, 1000, 0]),
    shape("tower", [30, 600, 0]),
    body("strip, two sides", [1000, 12, 0], whole, BothSides),
    body("strip, two sides", [2000, 1, 0], whole, BothSides),
    body("strip, two sides", [300, 40, 0], whole, BothSides),
    body("square, two sides", [100, 100, 0], whole, BothSides),
    body("comb", [200, 60, 0], comb, Below),
    body("comb", [400, 12, 0], comb, Below),
    body("comb", [80, 120, 0], comb, Below),
    body("comb", [1600, 8, 0], wide_comb, Below),
    body("comb", [600, 30, 0], wide_comb, Below),
    body("square with a hole", [60, 60, 0], with_hole, Below),
    body("square with a hole", [150, 150, 0], with_hole, Below),
    body("disc", [40, 40, 0], ball, LowerHalf),
    body("disc", [150, 150, 0], ball, LowerHalf),
    body("ellipse", [400, 40, 0], ball, LowerHalf),
    body("ellipse", [40, 400, 0], ball, LowerHalf),
    shape("cube", [4, 4, 4]),
    shape("cube", [8, 8, 8]),
    shape("cube", [12, 12, 12]),
    shape("cube", [16, 16, 16]),
    shape("plate", [12, 12, 1]),
    shape("plate", [24, 24, 2]),
    shape("plate", [40, 40, 1]),
    shape("plate", [40, 40, 2]),
    shape("plate", [30, 30, 4]),
    shape("plate", [16, 16, 6]),
    body("plate, two sides", [20, 20, 3], whole, BothSides),
    shape("beam", [200, 4, 4]),
    shape("beam", [100, 2, 2]),
    shape("beam", [60, 6, 6]),
    shape("beam", [400, 2, 1]),
    shape("wall", [40, 2, 20]),
    shape("tower", [4, 4, 100]),
    shape("tower", [6, 6, 50]),
    body("brush", [16, 16, 6], brush, Below),
    body("brush", [24, 24, 3], brush, Below),
    body("ball", [8, 8, 8], ball, LowerHalf),
    body("ball", [14, 14, 14], ball, LowerHalf),
    body("ellipsoid", [30, 10, 6], ball, LowerHalf),
    body("ellipsoid", [8, 8, 40], ball, LowerHalf),
    body("cube with a hole", [12, 12, 12], with_hole, Below),
];

impl Shape {
    fn dim(&self) -> usize {
        if self.cells[2] == 0 { 2 } else { 3 }
    }

    /// Section 6.1 of the paper with this contact.
    pub fn scene(&self) -> super::Outcome<Scene> {
        let built_in = Scene::find(if self.dim() == 2 {
            "one-zone"
        } else {
            "one-zone-3d"
        })?;
        let named = |names: &[&str]| names.iter().map(|n| GroupName::Name((*n).into())).collect();
        let mut boundary = built_in.boundary().clone();
        [boundary.contact, boundary.dirichlet, boundary.neumann] = match self.contact {
            BothSides => [named(&["bottom", "top"]), named(&["sides"]), Vec::new()],
            LowerHalf => [named(&["bottom"]), named(&["top"]), Vec::new()],
            Below => [named(&["bottom"]), named(&["top"]), named(&["sides"])],
        };
        Ok(built_in.with_boundary(boundary))
    }

    pub fn mesh(&self) -> Mesh {
        let dim = self.dim();
        let rows = self.cells.map(|n| n + 1);
        let number = |v: [usize; 3]| ((v[2] * rows[1] + v[1]) * rows[0] + v[0]) as u32;
        let orders: &[&[usize]] = match dim {
            2 => &[&[0, 1], &[1, 0]],
            _ => &[
                &[0, 1, 2],
                &[1, 2, 0],
                &[2, 0, 1],
                &[0, 2, 1],
                &[2, 1, 0],
                &[1, 0, 2],
            ],
        };
        let mut cells = Vec::new();
        for k in 0..self.cells[2].max(1) {
            for (i, j) in (0..self.cells[1]).flat_map(|j| (0..self.cells[0]).map(move |i| (i, j))) {
                if !(self.has)([i, j, k], self.cells) {
                    continue;
                }
                for (turn, order) in orders.iter().enumerate() {
                    let mut at = [i, j, k];
                    let mut simplex = vec![number(at)];
                    for &axis in *order {
                        at[axis] += 1;
                        simplex.push(number(at));
                    }
                    if 2 * turn >= orders.len() {
                        simplex.swap(dim - 1, dim);
                    }
                    cells.push(simplex);
                }
            }
        }
        // Faces of one cell, by side.
        let mut faces: BTreeMap<Vec<u32>, Option<Vec<u32>>> = BTreeMap::new();
        for cell in &cells {
            for out in 0..=dim {
                let face: Vec<u32> = (0..=dim).filter(|k| *k != out).map(|k| cell[k]).collect();
                let mut key = face.clone();
                key.sort_unstable();
                let found = faces.entry(key);
                found.and_modify(|old| *old = None).or_insert(Some(face));
            }
        }
        let place = |v: u32| {
            let v = v as usize;
            [v % rows[0], v / rows[0] % rows[1], v / rows[0] / rows[1]]
        };
        let mut sides: [Vec<u32>; 3] = Default::default();
        for face in faces.into_values().flatten() {
            let top = self.cells[dim - 1];
            let mut heights = face.iter().map(|v| place(*v)[dim - 1]);
            let side = match self.contact {
                LowerHalf if heights.all(|height| 2 * height <= top) => 0,
                LowerHalf => 1,
                _ if heights.clone().all(|height| height == 0) => 0,
                _ if heights.all(|height| height == top) => 1,
                _ => 2,
            };
            sides[side].extend(face);
        }
        let mut first = 0;
        let mut groups = Vec::new();
        for (tag, (side, name)) in sides.iter().zip(["bottom", "top", "sides"]).enumerate() {
            let end = first + (side.len() / dim) as u32;
            groups.push(Group {
                dim: dim as u8 - 1,
                tag: tag as i64 + 1,
                name: Some(name.into()),
                cells: (first..end).collect(),
            });
            first = end;
        }
        // Vertices without a cell, beside a comb's teeth, are left out.
        let mut used = vec![u32::MAX; rows.iter().product()];
        let mut points = Vec::new();
        let unit = 1.0 / self.cells[dim - 1] as f64;
        let mut renumbered = |nodes: Vec<u32>| -> Vec<u32> {
            let number = |v: u32| {
                if used[v as usize] == u32::MAX {
                    used[v as usize] = points.len() as u32;
                    points.push(place(v).map(|x| x as f64 * unit));
                }
                used[v as usize]
            };
            nodes.into_iter().map(number).collect()
        };
        let cells = renumbered(cells.concat());
        let sides = renumbered(sides.concat());
        let kinds = match dim {
            2 => [CellKind::Line, CellKind::Triangle],
            _ => [CellKind::Triangle, CellKind::Tetrahedron],
        };
        Mesh {
            points: points.into(),
            groups,
            blocks: vec![
                CellBlock::new(kinds[0], sides),
                CellBlock::new(kinds[1], cells),
            ],
            ..Mesh::default()
        }
    }
}

/// Seconds that this process, or the programs that it started, spent on any core.
pub fn spent(by_others: bool) -> super::Outcome<f64> {
    let who = match by_others {
        false => UsageWho::RUSAGE_SELF,
        true => UsageWho::RUSAGE_CHILDREN,
    };
    let usage = getrusage(who)?;
    // The system tells the two apart by its ticks only, and their sum to a microsecond.
    let parts = [usage.user_time(), usage.system_time()];
    let seconds = parts.map(|part| part.tv_sec() as f64 + part.tv_usec() as f64 * 1e-6);
    Ok(seconds[0] + seconds[1])
}

/// Prints a row for each shape and method, and for each method how often `auto` is as fast as it is to be.
pub fn compare(name: &str, stop: Stop) -> super::Outcome<()> {
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    println!(
        "\n| shape | squares or cubes | method | unknowns | contact faces | multifrontal | iterative | dense (faer) | auto | chosen | auto / best | Gflop | s predicted | s predicted iterative | MB predicted |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    let mut ratios: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for shape in SHAPES.iter().filter(|shape| shape.name.contains(name)) {
        let (scene, mesh) = (
            shape.scene()?,
            Triangulation::new(shape.name, &shape.mesh())?,
        );
        for method in ["cr", "cr-fc", "p2"] {
            let discretisation = Discretisation::of(&scene, method.parse()?);
            let problem = Problem::new(&scene, &mesh, &discretisation)?;
            let kept = 3.0 * problem.contact.len() as f64 * problem.space.element.degree() as f64;
            let mut ways: Vec<Way> = vec![
                Way::new(Solver::Multifrontal),
                Way::new(Solver::Iterative),
                Way::new(Solver::Auto),
            ];
            if kept.powi(3) < TOO_MANY {
                ways.push(Way::new(Solver::Faer));
            }
            // In turn, so that what else the machine does hits all.
            for _ in 0..REPEATS {
                let best = best(&ways);
                for way in &mut ways {
                    if way.seconds.is_infinite() || way.seconds < NEAR * best {
                        alone.install(|| way.take(&problem, stop))?;
                    }
                }
            }
            let [direct, iterative, auto] = [0, 1, 2].map(|k| &ways[k]);
            for other in &ways[1..] {
                let off = super::distance(&direct.u, &other.u);
                if !(off <= super::AGREEMENT) {
                    let name = shape.name;
                    return Err(
                        format!("{name} {method}: {} is {off:e} apart", other.solver).into(),
                    );
                }
            }
            let ratio = auto.seconds / best(&ways);
            ratios.entry(method).or_default().push(ratio);
            let squares: Vec<String> = shape.cells[..shape.dim()]
                .iter()
                .map(usize::to_string)
                .collect();
            println!(
                "| {} | {} | {method} | {} | {} | {:.4} | {:.4} | {} | {:.4} | {} | {ratio:.2} | {:.3} | {:.4} | {:.4} | {:.0} |",
                shape.name,
                squares.join(" × "),
                problem.space.dofs,
                problem.contact.len(),
                direct.seconds,
                iterative.seconds,
                ways.get(3)
                    .map_or(String::new(), |way| format!("{:.4}", way.seconds)),
                auto.seconds,
                auto.chosen,
                direct.flops / 1e9,
                direct.predicted_seconds,
                iterative.predicted_seconds,
                direct.predicted_mb,
            );
        }
    }
    println!("\n`auto` takes at most {GOAL} times the best of all ways:\n");
    for (method, ratios) in ratios {
        let near = ratios.iter().filter(|ratio| **ratio <= GOAL).count();
        let worst = ratios
            .iter()
            .fold(0.0, |worst: f64, ratio| worst.max(*ratio));
        println!(
            "{method}: on {near} of {} shapes; at worst {worst:.2}",
            ratios.len()
        );
    }
    Ok(())
}

/// A way to solve, the least time that it took, and what it found.
struct Way {
    solver: Solver,
    seconds: f64,
    u: Vec<f64>,
    chosen: Solver,
    flops: f64,
    predicted_mb: f64,
    predicted_seconds: f64,
}

impl Way {
    fn new(solver: Solver) -> Self {
        Way {
            solver,
            seconds: f64::INFINITY,
            u: Vec::new(),
            chosen: solver,
            flops: 0.0,
            predicted_mb: 0.0,
            predicted_seconds: 0.0,
        }
    }

    fn take(&mut self, problem: &Problem, stop: Stop) -> Result<(), String> {
        let settings = Settings {
            solver: self.solver,
            ..Settings::default()
        };
        let before = spent(false).map_err(|error| error.to_string())?;
        let solution = solve_by(problem, Iteration::Newton, stop, settings, |_, _| Ok(()))
            .map_err(|error| error.to_string())?;
        let after = spent(false).map_err(|error| error.to_string())?;
        self.seconds = self.seconds.min(after - before);
        self.chosen = solution.linear.solver;
        self.flops = solution.linear.flops;
        self.predicted_mb = solution.linear.predicted_mb;
        self.predicted_seconds = solution.linear.predicted_seconds;
        self.u = solution.u;
        Ok(())
    }
}

fn best(ways: &[Way]) -> f64 {
    let seconds = ways.iter().map(|way| way.seconds);
    seconds.fold(f64::INFINITY, f64::min)
}
