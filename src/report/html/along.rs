//! The fields along Γ_C of a 2D mesh, face by face, and the history of the iterations.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use super::Html;
use super::chain::Chain;
use super::chart::Chart;
use super::markup::{figures, html};
use super::plane::{NARROWEST, WIDEST, drawing, path, position, titled, word};
use super::residual::Put;
use crate::text::number::{place, size};
use crate::text::{Text, text};
use faceoff_fem::contact::{Problem, face_fields};
use faceoff_mesh::field::FaceFields;

pub(super) const LEFT: f64 = 46.0;
/// Up to this number of faces, each shows its numbers as a tooltip.
const TOLD: usize = 150;

/// Differences on faces, with the names of the two codes.
pub(in crate::report) type Named = (String, Vec<(u32, f64)>);

/// The data of a scene on its contact faces.
pub(in crate::report) struct Along<'a> {
    pub problem: &'a Problem<'a>,
    pub fields: &'a [FaceFields],
    /// The codes whose residual is shown, the one at fault last.
    pub puts: &'a [Put<'a>],
    /// Differences of means on all faces, relative to max|u|, with the names of the two; the most important one last.
    pub differences: Vec<Named>,
    pub tolerance: f64,
    /// Names of the codes at fault.
    pub faulty: Vec<&'a str>,
}

/// One field along Γ_C, under its heading; empty if Γ_C is not a curve.
pub(in crate::report) fn along_one(put: Put, tolerance: f64, is_faulty: bool) -> Html {
    let along = Along {
        problem: put.problem,
        fields: &[face_fields(put.problem, put.u, put.name)],
        puts: std::slice::from_ref(&put),
        differences: Vec::new(),
        tolerance,
        faulty: is_faulty.then_some(put.name).into_iter().collect(),
    };
    let drawn = along.figure();
    html! { @if !drawn.is_empty() { h2 { (text!("Along Γ_C")) } (drawn) } }
}

pub(super) struct Sheet<'a> {
    pub of: &'a Along<'a>,
    pub chain: &'a Chain,
    pub right: f64,
    pub is_narrow: bool,
    pub svg: String,
    pub at: f64,
}

impl Along<'_> {
    /// Both drawings, of which the page shows one.
    pub fn figure(&self) -> Html {
        let contact: Vec<u32> = self.problem.contact.iter().map(|f| f.face as u32).collect();
        let first = self.fields.first();
        let Some(first) = first.filter(|f| f.dim == 2 && !contact.is_empty()) else {
            return Html::default();
        };
        let chain = super::chain::chain(first, &contact);
        let drawn = [WIDEST, NARROWEST].map(|width| self.drawn(&chain, width));
        figures("", "", drawn)
    }

    fn drawn(&self, chain: &Chain, width: f64) -> Html {
        let is_narrow = width < 500.0;
        let label = if is_narrow { 8.0 } else { 150.0 };
        let mut sheet = Sheet {
            of: self,
            chain,
            right: width - label,
            is_narrow,
            svg: String::new(),
            at: 14.0,
        };
        sheet.band();
        sheet.trace();
        sheet.status();
        sheet.gamma();
        sheet.residuals();
        sheet.differences();
        sheet.positions();
        let label = "u, contact, γ, residual and difference along Γ_C";
        drawing(label, [width, sheet.at], &sheet.svg)
    }

    pub fn is_faulty(&self, name: &str) -> bool {
        self.faulty.contains(&name)
    }
}

impl Sheet<'_> {
    pub fn x(&self, s: f64) -> f64 {
        let (from, to) = self.ends();
        LEFT + (self.right - LEFT) * (s - from) / (to - from).max(f64::MIN_POSITIVE)
    }

    fn ends(&self) -> (f64, f64) {
        let [from, to] = super::plane::ends(self.chain.ends.iter().flat_map(|e| [e.0, e.1]));
        (from, to)
    }

    /// A chart of this height under its title.
    pub fn panel(&mut self, title: impl Into<Text>, height: f64, chart: Chart) {
        self.svg += &word("t b", [0.0, self.at], title);
        self.at += 8.0;
        let frame = [LEFT, self.at, self.right, self.at + height];
        let (from, to) = self.ends();
        self.svg += &chart.strip(frame, [from, to], !self.is_narrow);
        self.at += height + 24.0;
    }

    /// Marks the faces at fault, from top to bottom; it comes first in the drawing.
    fn band(&mut self) {
        let blamed = self.of.puts.iter().flat_map(Put::blamed);
        let blamed: BTreeSet<&[u32]> = blamed.map(|s| &s.vertices[..]).collect();
        let mesh = self.of.problem.space.mesh;
        for (k, row) in self.chain.rows.iter().enumerate() {
            if blamed.contains(mesh.face(self.of.problem.contact[*row].face)) {
                let (a, b) = self.chain.ends[k];
                let (a, b) = (self.x(a), self.x(b));
                let d = format_args!("M{a:.1} 4H{b:.1}V{{foot}}H{a:.1}z");
                self.svg += &path("bandf", d);
            }
        }
    }

    /// The positions, the tooltip of each face, and the end of the band.
    fn positions(&mut self) {
        let (from, to) = self.ends();
        let y = self.at - 8.0;
        for k in 0..=4 {
            let s = from + (to - from) * f64::from(k) / 4.0;
            self.svg += &word("t m", [self.x(s), y], position(s, to - from));
        }
        if !self.is_narrow {
            let axis = self.chain.axis;
            self.svg += &word("t", [self.right + 8.0, y], axis);
        }
        if self.chain.rows.len() <= TOLD {
            let (problem, mesh) = (self.of.problem, self.of.problem.space.mesh);
            for (k, row) in self.chain.rows.iter().enumerate() {
                let face = &problem.contact[*row];
                let (a, b) = self.chain.ends[k];
                let (a, b) = (self.x(a), self.x(b));
                let at = place(&mesh.face_midpoint(face.face)[..2]);
                let mut told = format!("face {:?} at {at}", mesh.face(face.face));
                for put in self.of.puts {
                    let local = mesh.local_face(face.cell, face.face);
                    let rows = problem.space.face_dofs(face.cell, local);
                    let error = rows.map(|r| put.errors[r as usize]).fold(0.0, f64::max);
                    let _ = write!(told, "\n{}: residual {}", put.name, size(error));
                }
                let d = format_args!("M{a:.1} 4H{b:.1}V{:.0}H{a:.1}z", self.at);
                self.svg += &titled("hv", d, &told);
            }
        }
        self.svg = self.svg.replace("{foot}", &format!("{:.0}", self.at + 2.0));
        self.at += 20.0;
    }
}
