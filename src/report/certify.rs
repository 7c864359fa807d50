//! The report of `certify`.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::certified::Certified;
use super::html;
use super::model::{Block, Cell, Report, Story, Table, Todo, percent, short, table};
use crate::engine::Case;
use crate::run::foreign::Understood;
use crate::text::number::place;
use crate::text::{Number, Text, at_least, at_most, interval, text};
use faceoff_fem::certify::{Certificate, Target};
use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::Triangulation;

/// The number of cells with the largest contributions that are named.
const WORST: usize = 10;

/// A certificate of a field in a file, for scripts.
#[derive(Serialize)]
pub struct Certification {
    scene: String,
    result: String,
    understood: Understood,
    /// The method that determines the flux on Γ_C.
    method: String,
    cells: usize,
    faces: usize,
    dofs: usize,
    /// The largest deviation of the values on Γ_D, which were replaced by g, relative to the largest value.
    #[serde(skip_serializing_if = "Option::is_none")]
    boundary_off: Option<f64>,
    certificate: Certified,
}

impl Certification {
    /// For a field that was read from `result` as a function in the case's space.
    pub fn new(
        result: &Path,
        case: &Case,
        understood: Understood,
        boundary_off: Option<f64>,
        certificate: &Certificate,
    ) -> Self {
        let space = &case.problem.space;
        Certification {
            scene: case.scene().name().to_owned(),
            result: result.display().to_string(),
            understood,
            method: case.problem.method().to_string(),
            cells: space.mesh.cell_count(),
            faces: space.mesh.face_count(),
            dofs: space.dofs,
            boundary_off,
            certificate: Certified::new(Target::UH, certificate),
        }
    }
}

/// The report of a certificate.
///
/// # Errors
/// Only those of a broken installation.
pub fn certify<'a>(
    told: &'a Certification,
    case: &'a Case,
    u: &'a [f64],
    certificate: &'a Certificate,
    inputs: Vec<PathBuf>,
) -> Result<Report<'a>> {
    let c = &told.certificate;
    let title = format!("faceoff certify: {}, {}", told.result, told.scene);
    let mut report = Report::new("certify", &title, c.sentence(), told)?;
    let mesh = case.problem.space.mesh;
    report.inputs = inputs;
    report.digests.push(("the mesh".into(), mesh.digest()));
    let between = |of: [f64; 2]| format!("in {}", interval(of, 7));
    let most = |of: f64| format!("at most {}", at_most(of, 7));
    let Certified { bounds, parts, .. } = c;
    let sizes = format!(
        "{} cells, {} faces, {} dofs",
        told.cells, told.faces, told.dofs
    );
    let understood = Text::message(&told.understood.sentence());
    let made_of = format!(
        "misfit {}, contact {}, oscillation {}, not known of the data {}",
        short(parts.misfit),
        short(parts.contact),
        short(parts.oscillation),
        short(parts.unknown)
    );
    let boundary = told.boundary_off.map(|off| {
        let off = Number::new(off, 2);
        let what = text!("boundary values were off by up to {off} and taken as g");
        (text!("on Γ_D"), what)
    });
    let fact = |name: &str, fact: String| (Text::from(name), Text::from(fact));
    let mut proved = vec![
        fact("mesh", sizes),
        fact("‖∇u-∇u_h‖", between([c.lower, c.upper])),
        fact("‖∇u‖", between(c.gradient)),
        fact("‖∇u-G‖, G the averaged gradient", most(bounds.g)),
        fact("‖∇u-∇v‖, v admissible", most(bounds.v)),
    ];
    let first = [
        fact("result", told.result.clone()),
        ("understood as".into(), understood),
    ];
    let last = c.facts().into_iter().chain(boundary);
    let of_parts = [fact("made of", made_of)].into_iter();
    let facts = first.into_iter().chain(proved.clone());
    let facts: Vec<_> = facts.chain(of_parts).chain(last.clone()).collect();
    // The other parts are in the lede.
    proved.extend(last);
    let name = told.result.rsplit('/').next().unwrap_or(&told.result);
    let map = move || html::cells(mesh, &certificate.local, "what each cell adds to the bound");
    let half = c.relative.map(|relative| {
        let (scene, method) = (&told.scene, &told.method);
        let asked = format!("{:.1e}", 0.5 * relative);
        Todo::new(
            "For a field with half of this bound, on a mesh that is refined where it pays:",
            [format!(
                "faceoff solve {scene} --method {method} --accuracy {asked}"
            )],
        )
    });
    report.story = Story {
        claim: match c.percent() {
            Some(percent) => text!("The error of **{name}** is at most {percent} of ‖∇u‖"),
            None => text!(
                "The error of **{name}** is at most {} in the energy norm",
                c.short()
            ),
        },
        rests_on: text!(
            "Proved, whatever made the field: ‖∇u − ∇u_h‖ is between {} and **{}**, and ‖∇u‖ between {} and {}. It is made of misfit {}, contact {} \
             and oscillation {}.",
            at_least(c.lower, 3),
            c.short(),
            at_least(c.gradient[0], 3),
            at_most(c.gradient[1], 3),
            short(parts.misfit),
            short(parts.contact),
            short(parts.oscillation)
        ),
        picture: vec![Block::Beside(vec![
            ("c6", vec![Block::drawn(map)]),
            ("c6", vec![Block::Facts(proved)]),
        ])],
        next: half.into_iter().collect(),
        rest: vec![
            Block::Terminal(vec![Block::facts(facts)]),
            Block::Page(vec![
                Block::heading(2, "Where it comes from"),
                worst(mesh, certificate).into(),
            ]),
        ],
    };
    let what = "A theorem, not an estimate: any field has this bound, of any code; rounding and quadrature are within it.";
    report.notes.push(what.into());
    report.notes.push(text!(
        "The field was read as {}.",
        Text::message(&told.understood.sentence())
    ));
    report.files.push(Box::new(move |folder| {
        super::write_certified(&folder.join("map.vtu"), case, u, certificate)
    }));
    Ok(report)
}

/// The cells with the largest contributions.
fn worst(mesh: &Triangulation, certificate: &Certificate) -> Table {
    let local = &certificate.local;
    let all: f64 = local.iter().sum();
    let mut cells: Vec<usize> = (0..local.len()).collect();
    cells.sort_by(|a, b| local[*b].total_cmp(&local[*a]));
    cells.truncate(WORST);
    table!("The cells that add most to the bound", cells, |cell|
        "cell" => cell,
        "centroid" => place(&centroid(mesh, cell)[..mesh.dim]),
        "adds" => certificate.part(cell),
        "of all squares" => Cell::number(local[cell] / all, percent(local[cell] / all)),
    )
}

fn centroid(mesh: &Triangulation, cell: usize) -> [f64; 3] {
    let corners = mesh.dim + 1;
    let vertices = mesh.vertices(cell);
    let of = |k: usize| vertices[..corners].iter().map(|x| x[k]).sum::<f64>();
    std::array::from_fn(|k| of(k) / corners as f64)
}
