//! Dirichlet values in a form file, and checks that every unknown is constrained and tested.

use faceoff_fem::scene::expression::syntax::Kind;
use faceoff_mesh::error::Result;

use super::{Entry, File, Value};
use crate::kernel::Free;
use crate::language::{MOST_LENGTH, Names, Reader, find_group};
use crate::problem::{Condition, Domain, Element, Mean, Problem, Unknown};
use crate::scalar::{Field, Id, Leaf, Node};
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
                (None, true) => return self.unknown(&each, problem).map(drop),
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
        let parts = self.components(entry, unknown, problem)?;
        let is_whole = space.element.is_vector();
        if is_whole && problem.groups[group].on != Some(Domain::Boundary) {
            let what = format!(
                "{} functions are held on the boundary only, and this group is not there",
                space.name()
            );
            return Err(self.refuse(at, what, "name a group of the boundary"));
        }
        for (component, part) in parts.into_iter().enumerate() {
            let Some(value) = self.value(part, problem)? else {
                if is_whole {
                    let what = format!("a dof of {} belongs to all components", space.name());
                    let remedy = "give a vector: of RT0 its normal component counts, of N1curl its tangential ones";
                    return Err(self.refuse(part.span().start, what, remedy));
                }
                continue;
            };
            problem.conditions.push(Condition {
                unknown,
                component,
                group,
                value,
            });
        }
        Ok(())
    }

    /// The values of an entry, one for each component of an unknown.
    pub(super) fn components(
        &self,
        entry: &Entry<'a>,
        unknown: usize,
        problem: &Problem,
    ) -> Result<Vec<&'a Value<'a>>> {
        let parts: Vec<&Value<'a>> = match entry.value.get_ref().as_array() {
            Some(list) => list.iter().collect(),
            None => vec![entry.value],
        };
        let Unknown { name, space, .. } = &problem.unknowns[unknown];
        if parts.len() == space.count() {
            return Ok(parts);
        }
        let counted = |n: usize, what: &str| match n {
            1 => format!("1 {what}"),
            _ => format!("{n} {what}s"),
        };
        let what = format!(
            "{} for {name}, which has {}",
            counted(parts.len(), "value"),
            counted(space.count(), "component")
        );
        let remedy = match space.element.is_vector() {
            true => "give one for each",
            false => "give one for each; \"free\" leaves one free",
        };
        Err(self.refuse(entry.value.span().start, what, remedy))
    }

    /// A function of the point, with data replaced by their formulas; `None` if the text is `free`.
    pub(super) fn value(&self, part: &'a Value<'a>, problem: &mut Problem) -> Result<Option<Id>> {
        let formula = self.formula(part)?;
        if matches!(&formula.term.kind, Kind::Name(name) if name == "free") {
            return Ok(None);
        }
        let names = Names {
            dim: problem.dim,
            cells: problem.cells,
            unknowns: &[],
            parameters: &problem.parameters,
            data: &problem.data,
            groups: &[],
            unmarked: 0,
            is_timed: false,
        };
        let value = Reader::new(names, &mut problem.scalars).formula(&formula.term);
        let value = value.map_err(|fault| self.fault_in(part, &formula, fault))?;
        let data = &problem.data;
        let value = problem.scalars.map(value, &mut |_, node| match node {
            Node::Leaf(leaf) => match leaf.field {
                Field::Datum(k) => Some(data[k].components[leaf.component]),
                _ => None,
            },
            _ => None,
        });
        match problem.scalars.length(value) > MOST_LENGTH {
            false => Ok(Some(value)),
            true => {
                let what = "this value is too long when its data are put in";
                Err(self.refuse(part.span().start, what, "shorten the data"))
            }
        }
    }

    /// Does F depend on every unknown, and is each constrained?
    pub(super) fn check(
        &self,
        problem: &mut Problem,
        form: &Value<'_>,
        unmarked: usize,
    ) -> Result<()> {
        if let Some(at) = swap::changes(problem) {
            let what = "this integral over dS changes when the two sides of a facet are swapped, and codes order the sides differently";
            let remedy = "use jump and avg, or add the same with ('+') and ('-') exchanged";
            let at = self.inside(form, &problem.form.source, at);
            return Err(self.refuse(at, what, remedy));
        }
        let at = form.span().start;
        let all = problem.integrals.iter().flat_map(|i| &i.terms);
        let leaves = problem.scalars.leaves(all.clone().map(|(_, c)| *c));
        for (k, unknown) in problem.unknowns.iter().enumerate() {
            let name = &unknown.name;
            let is_whole = unknown.space.element.is_vector();
            let count = if is_whole { 1 } else { unknown.space.count() };
            for component in 0..count {
                let of = match unknown.space.size.filter(|_| !is_whole) {
                    None => String::new(),
                    Some(_) => format!("[{component}]"),
                };
                let is_it = |leaf: &Leaf| is_whole || leaf.component == component;
                let is_tested = |leaf: &Leaf| leaf.field == Field::Test(k) && is_it(leaf);
                if !all.clone().any(|(test, _)| is_tested(test)) {
                    let what = format!("no term of F has the test function {}{of}", unknown.test);
                    return Err(self.refuse(at, what, "each unknown needs an equation"));
                }
                let mut of_it = leaves
                    .iter()
                    .filter(|leaf| leaf.field == Field::Unknown(k) && is_it(leaf))
                    .peekable();
                if of_it.peek().is_none() {
                    let what = format!("F does not depend on {name}{of}");
                    return Err(self.refuse(at, what, "use it, or take it out of [spaces]"));
                }
                let is_held = problem
                    .conditions
                    .iter()
                    .any(|c| c.unknown == k && c.component == component);
                // Unconstrained functions have the eigenvalue 0.
                let may_be_free = problem.eigen.is_some();
                let is_free = unknown.space.size.is_some() && (is_whole || !is_held);
                if is_free && !may_be_free && of_it.all(|leaf| leaf.axis.is_some()) {
                    let what = format!(
                        "nothing holds {name}{of}: F depends on its derivatives only, so that {} is free",
                        if is_whole { "much of it" } else { "a constant" }
                    );
                    let remedy = match is_whole {
                        true => "add a term with its values, as in dot(u, v)*dx",
                        false => {
                            "hold it on a group under [dirichlet], or add a term with its values"
                        }
                    };
                    return Err(self.refuse(at, what, remedy));
                }
            }
        }
        self.check_start(problem, at)?;
        match problem.eigen {
            Some(_) => Ok(()),
            None => self.check_constants(problem, at, unmarked),
        }
    }

    /// Checks that every scalar is determined, not only up to a constant, and that means are given only where a constant is free.
    fn check_constants(&self, problem: &mut Problem, at: usize, unmarked: usize) -> Result<()> {
        for k in 0..problem.unknowns.len() {
            if problem.means.iter().any(|mean| mean.unknown == k) {
                continue;
            }
            let free = kernel::free_constant(problem, unmarked, k);
            let name = &problem.unknowns[k].name;
            let mean = format!("give its mean, as in [mean] {name} = 0");
            let (what, remedy) = match free {
                None => continue,
                Some(Free::Divergence(v)) => {
                    let v = &problem.unknowns[v].name;
                    (
                        format!(
                            "a constant can be added to {name}: F has it times a divergence only, and {v} is given on the whole boundary"
                        ),
                        format!(
                            "{mean}, leave {v} free on a part of the boundary, or hold {name} somewhere"
                        ),
                    )
                }
                Some(Free::Differences) => (
                    format!(
                        "nothing holds {name}: F depends on its gradient and jumps only, so that a constant is free"
                    ),
                    format!(
                        "hold it on a group under [dirichlet], {mean}, or add a term with its values"
                    ),
                ),
            };
            return Err(self.refuse(at, what, remedy));
        }
        Ok(())
    }

    /// The means that a file gives for unknowns that are determined up to a constant.
    pub(super) fn means(
        &self,
        entry: &Entry<'a>,
        problem: &mut Problem,
        unmarked: usize,
    ) -> Result<()> {
        for each in self.entries(entry.value, "mean")? {
            let at = each.place.start;
            let unknown = self.unknown(&each, problem)?;
            let name = &problem.unknowns[unknown].name;
            if problem.unknowns[unknown].space.size.is_some() {
                let what = format!("{name} is a vector, and means are given of scalars");
                return Err(self.refuse(at, what, "leave it out"));
            }
            let value = self.number(each.value).ok_or_else(|| {
                let what = format!("the mean of {name} is not a finite number");
                self.refuse(each.value.span().start, what, "give one number")
            })?;
            if kernel::free_constant(problem, unmarked, unknown).is_none() {
                let name = &problem.unknowns[unknown].name;
                let what = format!(
                    "the mean of {name} is given, and F and the values on the boundary determine it already"
                );
                return Err(self.refuse(at, what, "leave it out"));
            }
            problem.means.push(Mean { unknown, value });
        }
        Ok(())
    }

    /// The position of the unknown in a key.
    pub(super) fn unknown(&self, entry: &Entry<'_>, problem: &Problem) -> Result<usize> {
        let found = problem.unknowns.iter().position(|u| u.name == entry.key);
        found.ok_or_else(|| {
            let known = problem.unknowns.iter().map(|u| u.name.as_str());
            let known: Vec<&str> = known.collect();
            let what = format!("there is no unknown `{}`", entry.key);
            let remedy = format!("the unknowns are {}", known.join(", "));
            self.refuse(entry.place.start, what, remedy)
        })
    }
}
