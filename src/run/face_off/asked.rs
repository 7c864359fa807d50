//! What a face-off file asks of a field or a number: its table and the checks of it.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::code::Code;
use super::form::{in_full, not_open};
use super::integrals::misplaced;
use super::tables::{KEYS, Reader, Several};
use super::{Asked, Formula, Judged, Same};
use faceoff_form::Problem;
use faceoff_judge::{On, UpTo};
use faceoff_mesh::error::Result;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AskedTable {
    same: Option<Same>,
    rtol: Option<f64>,
    #[serde(default)]
    atol: f64,
    on: Option<On>,
    components: Option<usize>,
    #[serde(default)]
    exact: Several<Given>,
    exact_rtol: Option<f64>,
    #[serde(default)]
    orders: OrdersTable,
    uncovered: Option<f64>,
    times: Option<Judged>,
    #[serde(default)]
    up_to: Several<UpTo>,
    #[serde(default)]
    value: Several<String>,
    #[serde(default)]
    names: BTreeMap<String, String>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct OrdersTable {
    l2: Option<f64>,
    h1: Option<f64>,
}

impl AskedTable {
    /// The defaults of a form file: its codes share the mesh, the spaces and the rules. Formulas may name its parameters and data.
    fn complete(&mut self, form: &Problem) {
        self.same.get_or_insert(Same::Discretisation);
        let texts = match &mut self.exact {
            Several::One(one) => std::slice::from_mut(one),
            Several::List(list) => list,
        };
        for given in texts {
            if let Given::Text(text) = given {
                *text = in_full(text, form);
            }
        }
    }

    /// What a field with a value may not say.
    fn only_compared(&self) -> Option<String> {
        if self.value.as_slice().is_empty() {
            return None;
        }
        let others = [
            ("same = \"problem\"", self.same == Some(Same::Problem)),
            ("exact", !self.exact.as_slice().is_empty()),
            ("orders", self.orders.l2.or(self.orders.h1).is_some()),
            ("up_to", !self.up_to.as_slice().is_empty()),
            ("uncovered", self.uncovered.is_some()),
            ("names", !self.names.is_empty()),
        ];
        let found = others.iter().find(|(_, is_given)| *is_given);
        found.map(|(key, _)| format!("it has a value and {key}"))
    }
}

/// A formula as text, or a plain number.
#[derive(Deserialize)]
#[serde(untagged)]
enum Given {
    Number(f64),
    Text(String),
}

impl Reader {
    /// A field or a number, by its kind (`fields`, `numbers`) and its name, next to the form, the default times, the parameters and the codes of
    /// the file.
    pub(super) fn asked(
        &self,
        (kind, name, table): (&str, String, toml::Value),
        form: Option<&Problem>,
        times: &Judged,
        parameters: &BTreeMap<String, String>,
        codes: &[Code],
    ) -> Result<Asked> {
        let place = format!("{kind}.{name}");
        let mut table: AskedTable = self.table(&place, table)?;
        if let Some(form) = form {
            table.complete(form);
        }
        let of_number = kind == "numbers";
        self.check_open(&place, &name, &table.up_to, form, of_number)?;
        let value = table.value.as_slice();
        if let Some((what, remedy)) = misplaced(value, form, of_number) {
            return Err(self.refuse(&place, what, &remedy));
        }
        if let Some(what) = table.only_compared().filter(|_| !of_number) {
            let remedy = "leave it out: a field on facets is compared between codes on one mesh";
            return Err(self.refuse(&place, what, remedy));
        }
        let key = match of_number {
            true => table.times.as_ref().map(|_| "times"),
            false => table.exact_rtol.map(|_| "exact_rtol"),
        };
        if let Some(key) = key {
            return Err(self.refuse(&place, format!("{kind} have no {key}"), "leave it out"));
        }
        table.times.get_or_insert_with(|| times.clone());
        let mut asked = self.in_range(&place, name, table, parameters, codes)?;
        asked.is_number = of_number;
        if of_number && asked.exact.iter().any(|formula| formula.has_time) {
            let what = "exact has t, and a number is of no time".to_owned();
            return Err(self.refuse(&place, what, "put the time in for t"));
        }
        Ok(asked)
    }

    /// A field may be declared open only as far as the form does not fix it.
    fn check_open(
        &self,
        place: &str,
        name: &str,
        up_to: &Several<UpTo>,
        form: Option<&Problem>,
        of_number: bool,
    ) -> Result<()> {
        let all = up_to.as_slice();
        let why = match (form, of_number && !all.is_empty()) {
            (_, true) => Some("up_to is of fields, and this is a number".to_owned()),
            (Some(form), _) => all.iter().find_map(|up_to| not_open(form, name, *up_to)),
            (None, _) => None,
        };
        match why {
            None => Ok(()),
            Some(what) => Err(self.refuse(place, what, "leave up_to out")),
        }
    }

    /// With its defaults, where its numbers, names and formulas are valid.
    fn in_range(
        &self,
        place: &str,
        name: String,
        table: AskedTable,
        parameters: &BTreeMap<String, String>,
        codes: &[Code],
    ) -> Result<Asked> {
        let refuse = |what: String, remedy: &str| self.refuse(place, what, remedy);
        let Some(same) = table.same else {
            return Err(refuse("missing field `same`".to_owned(), KEYS));
        };
        let in_range = |x: f64| x >= 0.0 && x.is_finite();
        let rtol = match (table.rtol, same) {
            (Some(rtol), _) => rtol,
            (None, Same::Discretisation) => 1e-10,
            (None, Same::Problem) if table.atol > 0.0 => 0.0,
            (None, Same::Problem) if table.orders.l2.or(table.orders.h1).is_some() => f64::INFINITY,
            (None, Same::Problem) if table.exact_rtol.is_some() => f64::INFINITY,
            (None, Same::Problem) => {
                let what =
                    "nothing says how far apart the answers to one problem may be".to_owned();
                return Err(refuse(
                    what,
                    "give rtol, of the norm on the finest mesh, atol where that is 0, or orders",
                ));
            }
        };
        let others = [
            table.exact_rtol,
            table.uncovered,
            table.orders.l2,
            table.orders.h1,
        ];
        let given = table
            .rtol
            .into_iter()
            .chain([table.atol])
            .chain(others.into_iter().flatten());
        if let Some(bad) = given.into_iter().find(|x| !in_range(*x)) {
            return Err(refuse(
                format!("{bad} is not a tolerance or order"),
                "give a number from 0 on",
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
        let formula = |given: Given| {
            match given {
            Given::Number(value) if !value.is_finite() => {
                Err(refuse(format!("exact is {value}"), "give a finite number"))
            }
            Given::Number(value) => Ok(Formula::constant(value)),
            Given::Text(text) => Formula::new(&text, parameters).map_err(|what| {
                let remedy = "docs/reference/scenes.md lists what an expression may hold; parameters are written {NAME}";
                refuse(what, remedy)
            }),
        }
        };
        let exact = table
            .exact
            .list()
            .into_iter()
            .map(formula)
            .collect::<Result<Vec<_>>>()?;
        Ok(Asked {
            name,
            names: table.names,
            same,
            rtol,
            atol: table.atol,
            on: table.on,
            components: table
                .components
                .or((exact.len() > 1).then_some(exact.len())),
            exact,
            exact_rtol: table.exact_rtol,
            orders: [table.orders.l2, table.orders.h1],
            uncovered: table.uncovered,
            times: table.times.unwrap_or_default(),
            up_to: table.up_to.list(),
            value: table.value.list(),
            is_number: false,
        })
    }
}
