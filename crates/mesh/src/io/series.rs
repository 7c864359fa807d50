//! Results at several times: a `.pvd`, XDMF and Exodus files, views in MSH files, and numbered files.

use std::path::{Path, PathBuf};

use super::recognise::recognise;
use super::results::{content, of_content, read_results};
use super::{Content, Format, Native, Read, bytes, collection, pattern, table};
use crate::error::{Error, Result};
use crate::field::Results;
use crate::mesh::Field;

/// One result, or one for each of several times, which are read one by one.
#[derive(Debug)]
pub struct Series {
    path: PathBuf,
    /// Ascending; one that is `None` where a result is of no time.
    pub times: Vec<Option<f64>>,
    held: Held,
}

/// Where the results are.
#[derive(Debug)]
enum Held {
    /// The files of each time.
    Files(Vec<Vec<PathBuf>>),
    /// In one file, which is read already; its views may have times.
    Views(Box<Content>),
    /// In one file, which is read again for each time.
    Steps(&'static Native),
    /// A single result.
    Single,
    /// One in memory, until it is taken.
    Here(Option<Box<Results>>),
}

impl Series {
    /// A file of any kind, or all files that a pattern like `u_*.vtu` names, whose numbers are their times.
    ///
    /// # Errors
    /// A file or list that cannot be read, a pattern that no file matches, a time that is not a number.
    pub fn open(path: &Path) -> Result<Self> {
        let of = |times: Vec<f64>, held| Series {
            path: path.to_owned(),
            times: times.into_iter().map(Some).collect(),
            held,
        };
        if pattern::is_pattern(path) {
            let (times, files) = numbered(path)?
                .into_iter()
                .map(|(k, file)| (k, vec![file]))
                .unzip();
            return Ok(of(times, Held::Files(files)));
        }
        if collection::is_pvd(path) {
            let (listed, is_timed) = collection::by_time(path)?;
            let (times, files): (Vec<f64>, Vec<_>) = listed.into_iter().unzip();
            // The pieces of one time are read as one.
            match &times[..] {
                [_] if is_timed => return Ok(of(times, Held::Single)),
                [] | [_] => {}
                _ => return Ok(of(times, Held::Files(files))),
            }
        } else if !["csv", "sol", "pvtu", "vtu", "vtp", "vtk"]
            .iter()
            .any(|s| collection::has_suffix(path, s))
        {
            let bytes = bytes::read(path).map_err(Error::io(path, "read"))?;
            match recognise(path, &bytes) {
                Some(Format::Native(
                    native @ Native {
                        read: Read::Views(_),
                        ..
                    },
                )) => {
                    let content = native.read_at(path, &bytes, None)?;
                    let times = times_of_views(&content.mesh.fields);
                    let mut series = of(times, Held::Views(Box::new(content)));
                    if series.times.is_empty() {
                        series.times.push(None);
                    }
                    return Ok(series);
                }
                Some(Format::Native(
                    native @ Native {
                        read: Read::Steps { times, .. },
                        ..
                    },
                )) => {
                    let mut times = times(path, &bytes)?;
                    times.sort_by(f64::total_cmp);
                    times.dedup();
                    if !times.is_empty() {
                        return Ok(of(times, Held::Steps(native)));
                    }
                }
                _ => {}
            }
        }
        Ok(Series {
            path: path.to_owned(),
            times: vec![None],
            held: Held::Single,
        })
    }

    /// A result that is in memory.
    pub fn here(results: Results) -> Self {
        Series {
            path: PathBuf::from(&results.source),
            times: vec![None],
            held: Held::Here(Some(Box::new(results))),
        }
    }

    /// The k-th of its results; a single one can be read once. `python` is the interpreter of an environment that has
    /// meshio, for the formats that meshio reads.
    ///
    /// # Errors
    /// The errors of [`read_results`]; several files of one time, which are not a whole.
    pub fn read(&mut self, k: usize, python: Option<&Path>) -> Result<Results> {
        let whole = |path: &Path| -> Result<Results> {
            let bytes = bytes::read(path).map_err(Error::io(path, "read"))?;
            if collection::has_suffix(path, "csv") {
                return table::read_any(path, &bytes);
            }
            read_results(path, &bytes, python)
        };
        match &mut self.held {
            Held::Single => whole(&self.path),
            Held::Here(results) => Ok(results.take().map_or_else(Results::default, |of| *of)),
            Held::Files(files) => match &files[k][..] {
                [one] => whole(one),
                several => {
                    let time = self.times[k].unwrap_or_default();
                    let what = format!("{} files are of the time {time}", several.len());
                    let remedy = "list the pieces of each time in a .pvtu file";
                    Err(Error::whole(&self.path, what, remedy))
                }
            },
            Held::Steps(format) => {
                let bytes = bytes::read(&self.path).map_err(Error::io(&self.path, "read"))?;
                let content = format.read_at(&self.path, &bytes, self.times[k])?;
                of_content(&self.path, content)
            }
            Held::Views(content) if self.times.len() == 1 => {
                of_content(&self.path, std::mem::take(&mut **content))
            }
            Held::Views(content) => {
                let mut content = Content::clone(content);
                let fields = &mut content.mesh.fields;
                fields.retain(|field| field.time.is_none() || field.time == self.times[k]);
                of_content(&self.path, content)
            }
        }
    }

    /// The file, list or pattern.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The name of the k-th of its results in messages.
    pub fn name(&self, k: usize) -> String {
        match &self.held {
            Held::Files(files) if files[k].len() == 1 => files[k][0].display().to_string(),
            _ => self.path.display().to_string(),
        }
    }
}

/// The contents of a file of any kind, with its times, ascending: in the last file of a list with times, or of a pattern as for
/// [`Series::open`]; the values of a solution of Medit's are on `mesh`, or else on the mesh next to it.
///
/// # Errors
/// The errors of [`Series::open`] and [`super::open`]; several files of the last time.
pub fn survey(
    path: &Path,
    mesh: Option<&Path>,
    python: Option<&Path>,
) -> Result<(Content, Vec<f64>)> {
    if pattern::is_pattern(path) || collection::is_pvd(path) {
        let series = Series::open(path)?;
        let times: Vec<f64> = series.times.iter().copied().flatten().collect();
        if let Held::Files(files) = &series.held
            && let Some(last) = files.last()
        {
            let [last] = &last[..] else {
                let what = format!("{} files are of the last time", last.len());
                let remedy = "give one of them, or list the pieces in a .pvtu file";
                return Err(Error::whole(path, what, remedy));
            };
            let (mut content, _) = survey(last, mesh, python)?;
            let name = last.display();
            let told = format!("cells and fields are those of the last file, {name}");
            content.warnings.push(told);
            return Ok((content, times));
        }
    }
    let bytes = bytes::read(path).map_err(Error::io(path, "read"))?;
    let content = content(path, &bytes, mesh, python)?;
    let mut times: Vec<f64> = content.mesh.fields.iter().filter_map(|f| f.time).collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    Ok((content, times))
}

/// The times of the views of a file, ascending; none if no field has several.
fn times_of_views(fields: &[Field]) -> Vec<f64> {
    let again = |k: usize| {
        let field = &fields[k];
        let same = |other: &Field| other.name == field.name && other.on == field.on;
        fields[..k]
            .iter()
            .any(|other| same(other) && other.time != field.time)
    };
    if !(0..fields.len()).any(again) {
        return Vec::new();
    }
    let mut times: Vec<f64> = fields.iter().filter_map(|field| field.time).collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    times
}

/// The files of a pattern with the last number in each name, ascending.
fn numbered(path: &Path) -> Result<Vec<(f64, PathBuf)>> {
    let refuse = |what: String| {
        let remedy = "give a pattern of numbered files, as in 'u_*.vtu'";
        Error::whole(path, what, remedy)
    };
    let number = |file: &Path| -> Option<f64> {
        let stem = file.file_stem()?.to_str()?;
        let end = stem.rfind(|c: char| c.is_ascii_digit())? + 1;
        let start = stem[..end]
            .rfind(|c: char| !c.is_ascii_digit())
            .map_or(0, |k| k + 1);
        stem[start..end].parse().ok()
    };
    let mut files = Vec::new();
    for file in pattern::files(path)? {
        let number = number(&file);
        let number = number
            .ok_or_else(|| refuse(format!("the name of {} has no number", file.display())))?;
        files.push((number, file));
    }
    if files.is_empty() {
        return Err(refuse("no file has such a name".into()));
    }
    files.sort_by(|a, b| a.0.total_cmp(&b.0));
    if let Some(twice) = files.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        let names = [&twice[0].1, &twice[1].1].map(|file| file.display().to_string());
        return Err(refuse(format!(
            "{} and {} have one number",
            names[0], names[1]
        )));
    }
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbered_files_stand_in_the_order_of_their_numbers() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for name in ["u_10.csv", "u_9.csv", "u_2a.csv", "v_1.csv"] {
            std::fs::write(at(name), "vertex,u\n0,1\n").unwrap();
        }
        let mut series = Series::open(&at("u_*.csv")).unwrap();
        assert_eq!(series.times, [Some(2.0), Some(9.0), Some(10.0)]);
        assert_eq!(
            series.read(1, None).unwrap().source,
            at("u_9.csv").display().to_string()
        );
        let refused = |name: &str, words: &str| {
            let error = Series::open(&at(name)).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        };
        refused("w_*.csv", "no file has such a name");
        std::fs::write(at("u_09.csv"), "").unwrap();
        refused("u_*.csv", "have one number");
        std::fs::write(at("u_.csv"), "").unwrap();
        refused("u_*.csv", "has no number");
        let single = Series::open(&at("v_1.csv")).unwrap();
        assert_eq!(single.times, [None]);
    }

    #[test]
    fn a_list_with_times_is_a_series() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let list = |entries: &str| {
            std::fs::write(
                at("u.pvd"),
                format!("<VTKFile><Collection>{entries}</Collection></VTKFile>"),
            )
            .unwrap();
            Series::open(&at("u.pvd"))
        };
        let entry =
            |time: &str, file: &str| format!("<DataSet timestep=\"{time}\" file=\"{file}\"/>");
        let two = entry("0.5", "b.vtu") + &entry("1e-1", "a.vtu") + &entry("0.5", "b.vtu");
        let series = list(&two).unwrap();
        assert_eq!(series.times, [Some(0.1), Some(0.5)]);
        assert!(series.name(1).ends_with("b.vtu"));
        let mut parts = list(&(two + &entry("0.5", "c.vtu"))).unwrap();
        let error = parts.read(1, None).unwrap_err().to_string();
        assert!(error.contains("2 files are of the time 0.5"), "{error}");
        assert_eq!(list(&entry("3", "a.vtu")).unwrap().times, [Some(3.0)]);
        let untimed = list("<DataSet file=\"a.vtu\"/>").unwrap();
        assert_eq!(untimed.times, [None]);
        let error = list(&(entry("x", "a.vtu") + &entry("1", "b.vtu")))
            .unwrap_err()
            .to_string();
        assert!(error.contains("\"x\" is not a time"), "{error}");
    }
}
