//! `[spectra.NAME]` of a face-off file: eigenvalues and modes that all codes have.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::tables::{Reader, Several};
use super::{Code, Same};
use faceoff_form::Problem;
use faceoff_mesh::error::Result;

/// Eigenvalues, and perhaps modes, of all codes.
#[derive(Debug, Clone)]
pub struct Spectrum {
    /// The name in reports.
    pub name: String,
    /// The prefix of the names of the numbers that are eigenvalues, before 1, 2, ….
    pub values: String,
    /// The same for the fields that are modes, or a name with `*` for the number; `None` if only values are compared.
    pub modes: Option<String>,
    /// The names in codes that use different ones: of values and modes, in this order.
    pub names: BTreeMap<String, Vec<String>>,
    /// What the codes share.
    pub same: Same,
    /// The tolerance of eigenvalues, relative to the larger; infinite if differences are reported and not judged.
    pub rtol: f64,
    /// The largest sine of an angle between subspaces; `None` if angles are reported and not judged.
    pub angle: Option<f64>,
    /// Eigenvalues whose gap is at most this, relative to the larger, are one cluster, whose modes are compared as a space.
    pub cluster: f64,
    /// The number of lowest eigenvalues that every code must have, without the kernel; `None` if all values of the codes are compared.
    pub count: Option<usize>,
    /// For an eigenproblem: the eigenvalues nearest to this, instead of the lowest.
    pub near: Option<f64>,
    /// Eigenvalues of at most this, relative to the largest, are those of the kernel, and left out.
    pub kernel: Option<f64>,
    /// The lowest eigenvalues, if they are known.
    pub exact: Vec<f64>,
    /// The tolerance of a code on the finest mesh with respect to them, relative to them.
    pub exact_rtol: Option<f64>,
}

impl Spectrum {
    /// The prefixes of a code's values and modes.
    pub fn names_in(&self, code: &str) -> (&str, Option<&str>) {
        let own = self.names.get(code);
        let values = own.and_then(|own| own.first());
        let modes = own.and_then(|own| own.get(1));
        (
            values.unwrap_or(&self.values),
            self.modes.as_ref().map(|of_all| &**modes.unwrap_or(of_all)),
        )
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Table {
    values: String,
    modes: Option<String>,
    #[serde(default)]
    names: BTreeMap<String, Several<String>>,
    same: Same,
    rtol: Option<f64>,
    angle: Option<f64>,
    cluster: Option<f64>,
    count: Option<usize>,
    near: Option<f64>,
    drop_kernel: Option<f64>,
    #[serde(default)]
    exact: Several<f64>,
    exact_rtol: Option<f64>,
}

impl Reader {
    /// The settings that `[eigen]` implies for the one spectrum of an eigenproblem: the names in the scripts' results, the number of values, and the target.
    pub(super) fn spectra_of(&self, form: &Problem, spectra: &mut toml::Table) -> Result<()> {
        let Some(eigen) = &form.eigen else {
            let Some(name) = spectra.keys().next() else {
                return Ok(());
            };
            let what = "the form is not an eigenproblem".to_owned();
            let remedy =
                "write [eigen] with a, m and count instead of [form], or leave the spectrum out";
            return Err(self.refuse(&format!("spectra.{name}"), what, remedy));
        };
        if spectra.is_empty() {
            spectra.insert("lambda".to_owned(), toml::Table::new().into());
        }
        if let Some(name) = spectra.keys().nth(1) {
            let what = "an eigenproblem has one spectrum, and this is a second".to_owned();
            return Err(self.refuse(&format!("spectra.{name}"), what, "keep one"));
        }
        let unknown = form.unknowns.first().map_or("u", |unknown| &unknown.name);
        for (name, table) in spectra.iter_mut() {
            let Some(table) = table.as_table_mut() else {
                continue;
            };
            let given: [(&str, toml::Value); 5] = [
                ("values", "lambda".into()),
                ("modes", unknown.into()),
                ("same", "discretisation".into()),
                ("count", (eigen.count as i64).into()),
                ("near", eigen.shift.into()),
            ];
            for (key, value) in given {
                if table.contains_key(key) && key != "same" {
                    let what = format!("{key} is what [eigen] and its scripts have");
                    return Err(self.refuse(&format!("spectra.{name}"), what, "leave it out"));
                }
                table.entry(key).or_insert(value);
            }
        }
        Ok(())
    }

    /// A table under `[spectra]`.
    pub(super) fn spectrum(
        &self,
        name: String,
        table: toml::Value,
        codes: &[Code],
    ) -> Result<Spectrum> {
        let place = format!("spectra.{name}");
        let table: Table = self.table(&place, table)?;
        let refuse = |what: String, remedy: &str| self.refuse(&place, what, remedy);
        let exact = table.exact.list();
        let given = [
            table.rtol,
            table.angle,
            table.cluster,
            table.drop_kernel,
            table.exact_rtol,
        ];
        let given = given.into_iter().flatten();
        if let Some(bad) = given.into_iter().find(|x| !(*x >= 0.0 && x.is_finite())) {
            return Err(refuse(
                format!("{bad} is not a tolerance"),
                "give a number from 0 on",
            ));
        }
        if table.near.is_some_and(|near| !near.is_finite()) {
            return Err(refuse("near is not finite".into(), "give a number"));
        }
        if table.count == Some(0) {
            return Err(refuse(
                "count is 0, and nothing would be compared".into(),
                "give the number of eigenvalues that every code has, or leave it out",
            ));
        }
        if !exact.is_sorted() || exact.iter().any(|x| !x.is_finite()) {
            return Err(refuse(
                "exact does not ascend".into(),
                "give the lowest eigenvalues in order, each as often as it is one",
            ));
        }
        if exact.is_empty() != table.exact_rtol.is_none() {
            return Err(refuse(
                "exact and exact_rtol go together".into(),
                "give both, or leave both out",
            ));
        }
        if let Some(code) = table
            .names
            .keys()
            .find(|code| codes.iter().all(|c| c.name() != code.as_str()))
        {
            return Err(refuse(
                format!("there is no code `{code}`"),
                "name one of [codes]",
            ));
        }
        let is_same = table.same == Same::Discretisation;
        if !is_same && table.rtol.is_none() && exact.is_empty() {
            return Err(refuse(
                "nothing says how far apart the eigenvalues of one problem may be".into(),
                "give rtol, or exact with exact_rtol",
            ));
        }
        if table.angle.is_some() && table.modes.is_none() {
            return Err(refuse(
                "angle is between modes, and there are none".into(),
                "add modes = \"…\", or leave angle out",
            ));
        }
        let names = table.names.into_iter();
        Ok(Spectrum {
            name,
            values: table.values,
            names: names.map(|(code, names)| (code, names.list())).collect(),
            same: table.same,
            rtol: table
                .rtol
                .unwrap_or(if is_same { 1e-9 } else { f64::INFINITY }),
            angle: table
                .angle
                .or((is_same && table.modes.is_some()).then_some(1e-6)),
            modes: table.modes,
            // Multiple eigenvalues split by rounding on one mesh, and by the error of discretisation on others.
            cluster: table.cluster.unwrap_or(if is_same { 1e-5 } else { 1e-2 }),
            count: table.count,
            near: table.near,
            kernel: table.drop_kernel,
            exact,
            exact_rtol: table.exact_rtol,
        })
    }
}
