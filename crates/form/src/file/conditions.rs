//! The values that a form file holds on parts of the boundary, and what must be held or tested somewhere.

use faceoff_fem::scene::expression::syntax::Kind;
use faceoff_mesh::error::Result;

use super::{Entry, File, Value};
use crate::language::{MOST_LENGTH, Names, Reader, find_group};
use crate::problem::{Condition, Element, Problem};
use crate::scalar::{Field, Node};
use crate::{kernel, swap};

impl<'a> File<'a> {
    pub(super) fn conditions(&self, entry: &Entry<'a>, problem: &mut Problem) -> Result<()> {
        for each in self.entries(entry.value, "dirichlet")? {
            let unknown = problem.unknowns.iter().position(|u| u.name == each.key);
            match (unknown, each.value.get_ref().is_table()) {
                (Some(unknown), true) => {
                    for held in self.entries(each.value, "dirichlet")? {
                        self.condition(&held, unknown, problem)?;
                    }
                }
                (None, false) if problem.unknowns.len() == 1 => {
                    self.condition(&each, 0, problem)?
                }
                (None, true) => {
                    let known: Vec<&str> =
                        problem.unknowns.iter().map(|u| u.name.as_str()).collect();
                    let remedy = format!("the unknowns are {}", known.join(", "));
                    return Err(self.refuse(
                        each.place.start,
                        format!("there is no unknown `{}`", each.key),
                        remedy,
                    ));
                }
                _ => {
                    let what = "with several unknowns it is not clear which one is held";
                    return Err(self.refuse(each.place.start, what, "write u = {left = \"…\"}"));
                }
            }
        }
        Ok(())
    }

    fn condition(&self, entry: &Entry<'a>, unknown: usize, problem: &mut Problem) -> Result<()> {
        let at = entry.place.start;
        let group = find_group(&problem.groups, entry.key, problem.dim - 1)
            .map_err(|(what, remedy)| self.refuse(at, what, remedy))?;
        let space = problem.unknowns[unknown].space;
        if matches!(space.element, Element::Broken(_)) {
            let what = format!(
                "{} has no dofs on facets, so that nothing can be held there",
                space.name()
            );
            return Err(self.refuse(at, what, "hold the values weakly, by terms of F on ds"));
        }
        let parts: Vec<&Value<'a>> = match entry.value.get_ref().as_array() {
            Some(list) => list.iter().collect(),
            None => vec![entry.value],
        };
        if parts.len() != space.count() {
            let name = &problem.unknowns[unknown].name;
            let counted = |n: usize, what: &str| match n {
                1 => format!("1 {what}"),
                _ => format!("{n} {what}s"),
            };
            let what = format!(
                "{} for {name}, which has {}",
                counted(parts.len(), "value"),
                counted(space.count(), "component")
            );
            return Err(self.refuse(
                entry.value.span().start,
                what,
                "give one for each; \"free\" leaves one free",
            ));
        }
        for (component, part) in parts.into_iter().enumerate() {
            let (text, term) = self.term(part)?;
            if matches!(&term.kind, Kind::Name(name) if name == "free") {
                continue;
            }
            let names = Names {
                dim: problem.dim,
                unknowns: &[],
                parameters: &problem.parameters,
                data: &problem.data,
                groups: &[],
                unmarked: 0,
            };
            let value = Reader::new(names, &mut problem.scalars).formula(&term);
            let value = value.map_err(|fault| self.fault(part, &text, fault))?;
            let data = &problem.data;
            // Data are put in as formulas.
            let value = problem.scalars.map(value, &mut |_, node| match node {
                Node::Leaf(leaf) => match leaf.field {
                    Field::Datum(k) => Some(data[k].components[leaf.component]),
                    _ => None,
                },
                _ => None,
            });
            if problem.scalars.length(value) > MOST_LENGTH {
                let what = "this value is too long when its data are put in";
                return Err(self.refuse(part.span().start, what, "shorten the data"));
            }
            problem.conditions.push(Condition {
                unknown,
                component,
                group,
                value,
            });
        }
        Ok(())
    }

    /// Does F say something of every unknown, and is each held?
    pub(super) fn check(
        &self,
        problem: &mut Problem,
        form: &Value<'_>,
        unmarked: usize,
    ) -> Result<()> {
        if let Some(at) = swap::changes(problem) {
            let what = "this integral over dS changes when the two sides of a facet are swapped, and codes order the sides differently";
            let remedy = "use jump and avg, or add the same with ('+') and ('-') exchanged";
            let at = self.inside(form, &problem.form.0, at);
            return Err(self.refuse(at, what, remedy));
        }
        let at = form.span().start;
        if let Some((p, v)) = kernel::free_constant(problem, unmarked) {
            let [p, v] = [p, v].map(|k| problem.unknowns[k].name.as_str());
            let what = format!(
                "a constant can be added to {p}: F has it times a divergence only, and {v} is given on the whole boundary"
            );
            let remedy = format!(
                "leave {v} free on a part of the boundary, hold {p} somewhere, or add a small multiple of {p} to its equation"
            );
            return Err(self.refuse(at, what, remedy));
        }
        let all = problem.integrals.iter().flat_map(|i| &i.terms);
        for (k, unknown) in problem.unknowns.iter().enumerate() {
            let name = &unknown.name;
            for component in 0..unknown.space.count() {
                let of = match unknown.space.size {
                    None => String::new(),
                    Some(_) => format!("[{component}]"),
                };
                let is_tested = |field| field == Field::Test(k);
                if !all
                    .clone()
                    .any(|(test, _)| is_tested(test.field) && test.component == component)
                {
                    let what = format!("no term of F has the test function {}{of}", unknown.test);
                    return Err(self.refuse(at, what, "each unknown needs an equation"));
                }
                let leaves = problem.scalars.leaves(all.clone().map(|(_, c)| *c));
                let mut of_it = leaves
                    .iter()
                    .filter(|leaf| leaf.field == Field::Unknown(k) && leaf.component == component)
                    .peekable();
                if of_it.peek().is_none() {
                    let what = format!("F does not depend on {name}{of}");
                    return Err(self.refuse(at, what, "use it, or take it out of [spaces]"));
                }
                let is_held = problem
                    .conditions
                    .iter()
                    .any(|c| c.unknown == k && c.component == component);
                if !is_held && of_it.all(|leaf| leaf.axis.is_some()) {
                    let what = format!(
                        "nothing holds {name}{of}: F depends on its gradient only, so that a constant is free"
                    );
                    let remedy =
                        "hold it on a group under [dirichlet], or add a term with its values";
                    return Err(self.refuse(at, what, remedy));
                }
            }
        }
        Ok(())
    }
}
