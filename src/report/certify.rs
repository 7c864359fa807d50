//! What `certify` answers.

use std::path::{Path, PathBuf};

use plotters::coord::Shift;
use plotters::prelude::*;
use serde::Serialize;

use super::certified::Certified;
use super::drawing::{Drawing, Drawn, shade};
use super::model::{Block, Cell, Figure, Report, percent, short, table};
use super::number::place;
use crate::engine::Case;
use crate::run::foreign::Understood;
use faceoff_fem::certify::{Certificate, Target};
use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::Triangulation;

/// So many cells that add most are named.
const WORST: usize = 10;

/// A certificate of a field that a file holds, as scripts read it.
#[derive(Serialize)]
pub struct Certification {
    scene: String,
    result: String,
    understood: Understood,
    /// By which the flux on Γ_C was read.
    method: String,
    cells: usize,
    faces: usize,
    dofs: usize,
    /// By how much values on Γ_D, which were taken as g, were off, relative to the largest value.
    #[serde(skip_serializing_if = "Option::is_none")]
    boundary_off: Option<f64>,
    certificate: Certified,
}

impl Certification {
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
/// None but of a broken installation.
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
    let between = |[low, high]: [f64; 2]| format!("in [{low:.6e}, {high:.6e}]");
    let Certified { bounds, parts, .. } = c;
    let sizes = format!(
        "{} cells, {} faces, {} dofs",
        told.cells, told.faces, told.dofs
    );
    let mut facts = vec![
        ("result", told.result.clone()),
        ("understood as", told.understood.sentence()),
        ("mesh", sizes),
        ("‖∇u-∇u_h‖", between([c.lower, c.upper])),
        ("‖∇u‖", between(c.gradient)),
        (
            "‖∇u-G‖, G the averaged gradient",
            format!("at most {:.6e}", bounds.g),
        ),
        ("‖∇u-∇v‖, v admissible", format!("at most {:.6e}", bounds.v)),
        (
            "made of",
            format!(
                "misfit {}, contact {}, oscillation {}, not known of the data {}",
                short(parts.misfit),
                short(parts.contact),
                short(parts.oscillation),
                short(parts.unknown)
            ),
        ),
    ];
    facts.extend(c.facts());
    facts.extend(told.boundary_off.map(|off| {
        let what = format!("boundary values were off by up to {off:.1e} and taken as g");
        ("on Γ_D", what)
    }));
    report.blocks = vec![Block::facts(facts)];
    report
        .blocks
        .push(Block::Page(vec![worst(mesh, certificate).into()]));
    if mesh.dim == 2 {
        let caption = "What each cell adds to the bound, the root of its square: the darker, the more, over three powers of \
                       ten from the largest on; refining there pays most.";
        report.blocks.push(Block::Page(vec![Block::Figure(Figure {
            name: "map".into(),
            caption: caption.into(),
            picture: Box::new(Map { mesh, certificate }),
        })]));
    }
    report.files.push(Box::new(move |folder| {
        super::write_certified(&folder.join("map.vtu"), case, u, certificate)
    }));
    Ok(report)
}

/// The cells that add most.
fn worst(mesh: &Triangulation, certificate: &Certificate) -> super::model::Table {
    let local = &certificate.local;
    let all: f64 = local.iter().sum();
    let mut cells: Vec<usize> = (0..local.len()).collect();
    cells.sort_by(|a, b| local[*b].total_cmp(&local[*a]));
    cells.truncate(WORST);
    table!("The cells that add most to the bound", cells, |cell|
        "cell" => cell,
        "centroid" => place(&centroid(mesh, cell)[..mesh.dim]),
        "adds" => certificate.part(cell),
        "of all squares" => Cell::Number(local[cell] / all, percent(local[cell] / all)),
    )
}

fn centroid(mesh: &Triangulation, cell: usize) -> [f64; 3] {
    let corners = mesh.dim + 1;
    let vertices = mesh.vertices(cell);
    let of = |k: usize| vertices[..corners].iter().map(|x| x[k]).sum::<f64>();
    std::array::from_fn(|k| of(k) / corners as f64)
}

/// The cells of a plane mesh by what they add.
struct Map<'a> {
    mesh: &'a Triangulation,
    certificate: &'a Certificate,
}

/// Pixels of the longer side.
const SIZE: f64 = 640.0;
/// Up to so many cells each is drawn; of more, the largest in each square.
const MOST: usize = 5000;
/// Pixels of the side of such a square.
const SQUARE: f64 = 5.0;

impl Map<'_> {
    /// Lowest corner and extent.
    fn extent(&self) -> [[f64; 2]; 2] {
        let mut ends = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
        for point in &self.mesh.points {
            for k in 0..2 {
                ends[0][k] = ends[0][k].min(point[k]);
                ends[1][k] = ends[1][k].max(point[k]);
            }
        }
        [ends[0], [0, 1].map(|k| ends[1][k] - ends[0][k])]
    }

    /// From the plane to pixels; y points up.
    fn pixel(&self, [low, extent]: [[f64; 2]; 2], x: [f64; 3]) -> [f64; 2] {
        let scale = SIZE / extent[0].max(extent[1]);
        [
            (x[0] - low[0]) * scale,
            (extent[1] - (x[1] - low[1])) * scale,
        ]
    }
}

impl Drawing for Map<'_> {
    fn size(&self) -> (u32, u32) {
        let [_, extent] = self.extent();
        let longer = extent[0].max(extent[1]);
        let side = |k: usize| (SIZE * extent[k] / longer).ceil().max(1.0) as u32;
        (side(0), side(1))
    }

    fn on<DB: DrawingBackend>(&self, area: &DrawingArea<DB, Shift>) -> Drawn<DB> {
        let (mesh, local) = (self.mesh, &self.certificate.local);
        let view = self.extent();
        let most = local.iter().fold(0.0, |most: f64, part| most.max(*part));
        // Squares of the parts, so that six powers are three of the parts.
        let colour = |part: f64| match part / most {
            share if share > 0.0 => shade(-share.log10() / 6.0),
            _ => shade(1.0),
        };
        let round = |[x, y]: [f64; 2]| (x.round() as i32, y.round() as i32);
        if mesh.cell_count() <= MOST {
            for (cell, part) in local.iter().enumerate() {
                let corners = mesh.vertices(cell);
                let corners = corners[..3].iter().map(|x| round(self.pixel(view, *x)));
                area.draw(&Polygon::new(
                    corners.collect::<Vec<_>>(),
                    colour(*part).filled(),
                ))?;
            }
            return Ok(());
        }
        let mut squares = std::collections::BTreeMap::new();
        for (cell, part) in local.iter().enumerate() {
            let [x, y] = self.pixel(view, centroid(mesh, cell));
            let square = [x, y].map(|x| (x / SQUARE) as i32);
            let known: &mut f64 = squares.entry(square).or_default();
            *known = known.max(*part);
        }
        for ([i, j], part) in squares {
            let at = |k: i32| (f64::from(k) * SQUARE) as i32;
            let corners = [(at(i), at(j)), (at(i + 1), at(j + 1))];
            area.draw(&Rectangle::new(corners, colour(part).filled()))?;
        }
        Ok(())
    }
}
