//! What a code has left: its results, read one time after the other, its numbers and its linear system; and answers to images of a
//! problem, brought back.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use super::program::Folder;
use faceoff_form::image::Motion;
use faceoff_judge::systems::System;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::Results;
use faceoff_mesh::io::{self, Content, Series};
use faceoff_mesh::mesh::Mesh;

/// The output of a code.
pub struct Left {
    /// The files that it was to write.
    pub results: Vec<Written>,
    /// By name, as the code calls them.
    pub numbers: BTreeMap<String, f64>,
    /// Why it has no numbers, where that is known.
    pub numberless: Option<String>,
    /// Fields on facets that were derived from its results, by name, or why there are none.
    pub on_facets: BTreeMap<String, std::result::Result<Facets, String>>,
    /// Its linear system, if it writes one.
    pub system: Option<System>,
    /// From its start to its end.
    pub seconds: f64,
    /// Where they are, if that ends with them.
    pub(super) _folder: Option<Folder>,
}

/// A field on facets that was derived from a result.
pub struct Facets {
    /// As if the code had written it.
    pub written: Written,
    /// A relative tolerance of the dofs times this is one of the field.
    pub scale: f64,
}

/// A result that a code has written, which is read one time after the other.
pub struct Written {
    /// Ascending; one that is `None` where it is of no time.
    pub times: Vec<Option<f64>>,
    /// The mesh that the codes share, whose vertices tables number.
    pub grid: Option<Arc<Results>>,
    /// As messages call it.
    name: String,
    /// Of an answer to an image of the problem.
    image: Option<Back>,
    /// None where the only time was read already.
    series: Option<RefCell<Series>>,
    /// The number of the time that was read last, so that those who ask in turn share it.
    last: RefCell<Option<(usize, Arc<Results>)>>,
}

impl Written {
    /// The last of its times is read at once: a file that cannot be read is not a result.
    pub(super) fn open(path: &Path, name: String) -> Result<Self> {
        let series = Series::open(path)?;
        let written = Written {
            times: series.times.clone(),
            grid: None,
            name,
            image: None,
            series: Some(RefCell::new(series)),
            last: RefCell::new(None),
        };
        written.at(written.times.len() - 1)?;
        Ok(written)
    }

    /// What was made of a result of this time, or of none.
    pub fn made(results: Results, time: Option<f64>) -> Self {
        Written {
            times: vec![time],
            grid: None,
            name: results.source.clone(),
            image: None,
            series: None,
            last: RefCell::new(Some((0, Arc::new(results)))),
        }
    }

    /// The k-th of its results.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn at(&self, k: usize) -> Result<Arc<Results>> {
        if let Some((read, results)) = &*self.last.borrow()
            && *read == k
        {
            return Ok(results.clone());
        }
        let Some(series) = &self.series else {
            let what = format!("{} has one time only", self.name);
            return Err(Error::usage(what, "ask for that"));
        };
        let python = super::meshio_python();
        let mut results = series.borrow_mut().read(k, python.as_deref())?;
        results.source.clone_from(&self.name);
        if let Some(back) = &self.image {
            back.bring(&mut results);
        }
        let results = Arc::new(results);
        *self.last.borrow_mut() = Some((k, results.clone()));
        Ok(results)
    }
}

/// How an answer to an image of a problem is brought back.
#[derive(Debug, Clone, Default)]
pub struct Back {
    /// Where places and components go.
    pub motion: Option<Motion>,
    /// The fields whose components turn.
    pub vectors: Vec<String>,
    /// The original number of each vertex of the mesh that the code was given; empty where it is the same.
    pub numbers: Vec<u32>,
}

impl Back {
    fn bring(&self, results: &mut Results) {
        // Rows that are keyed by vertices.
        if !self.numbers.is_empty() && results.points.is_empty() {
            self.renumber(results);
        }
        if let Some(motion) = &self.motion {
            bring_back(results, motion, &self.vectors);
        }
    }

    fn renumber(&self, results: &mut Results) {
        let old = |k: u32| self.numbers.get(k as usize).copied().unwrap_or(k);
        for node in results.cells.to_mut() {
            *node = old(*node);
        }
        let count = results.on_points.iter().filter(|of| of.at.is_none());
        let count = count.map(|of| of.values.len() / of.components.max(1)).max();
        let ids = match (results.ids.is_empty(), count) {
            (true, Some(count)) => (0..count as u32).map(old).collect(),
            _ => results.ids.iter().map(|id| old(*id)).collect(),
        };
        results.ids = ids;
    }
}

/// Points, and the components of some vectors, where the original has them.
fn bring_back(results: &mut Results, motion: &Motion, vectors: &[String]) {
    for point in results.points.to_mut() {
        *point = motion.back(*point);
    }
    let fields = [
        &mut results.on_points,
        &mut results.on_cells,
        &mut results.on_corners,
    ];
    let fields = fields.into_iter().flatten();
    for field in fields.filter(|field| vectors.contains(&field.name)) {
        let count = field.components;
        if !(2..=3).contains(&count) {
            continue;
        }
        for row in field.values.to_mut().chunks_exact_mut(count) {
            let mut of = [0.0; 3];
            of[..count].copy_from_slice(row);
            row.copy_from_slice(&motion.unturned(of)[..count]);
        }
    }
}

impl Left {
    /// Of an answer to an image of the problem: brings it back.
    pub fn bring_back(&mut self, back: &Back) {
        for written in &mut self.results {
            written.image = Some(back.clone());
            written.last.take();
        }
    }

    /// Has the rows of tables that are keyed by vertices be on the mesh that the code was given, whose vertices they number.
    ///
    /// # Errors
    /// A result that cannot be read; a mesh that is too large for the memory.
    pub fn lay_on(&mut self, mesh: &Mesh) -> Result<()> {
        let mut grid = None;
        for written in &mut self.results {
            let last = written.at(written.times.len() - 1)?;
            if last.width < 2 || !last.points.is_empty() {
                continue;
            }
            if grid.is_none() {
                let content = Content {
                    mesh: mesh.clone(),
                    ..Content::default()
                };
                grid = Some(Arc::new(io::of_content("the mesh".as_ref(), content)?));
            }
            written.grid.clone_from(&grid);
        }
        Ok(())
    }
}
