//! Measures, and integrals: linear in the test functions, with the sides that their domain has.

use faceoff_fem::scene::expression::syntax::{Kind, Term};
use faceoff_mesh::error::meant;

use super::{Reader, Result, fault};
use crate::problem::{Domain, Group, Integral, Measure};
use crate::scalar::{Field, Id, Leaf, Length, Node, NotLinear, Side};

impl Reader<'_> {
    /// An integral, if the integrand is linear in the test functions and valid on its domain.
    pub(super) fn integral(
        &mut self,
        term: &Term,
        integrand: Id,
        measure: Measure,
    ) -> Result<Integral> {
        let is_sided = |side| side != Side::Here;
        for id in self.scalars.nodes_of([integrand]) {
            let (side, what) = match self.scalars.node(id) {
                Node::Leaf(leaf) => {
                    if let (Field::Datum(k), true) = (leaf.field, leaf.side == Side::Here)
                        && self.names.data[k]
                            .space
                            .is_none_or(|s| s.element.is_continuous() && leaf.axis.is_none())
                    {
                        continue;
                    }
                    (leaf.side, self.field_name(leaf.field))
                }
                Node::Normal(_, side) => (side, "n".to_owned()),
                Node::Length(length, side) => (side, length.name().to_owned()),
                _ => continue,
            };
            match measure.domain {
                Domain::Cells if what == "n" => {
                    return Err(fault(
                        term,
                        "n is used with dx, and cells have no normal",
                        "integrate over ds or dS",
                    ));
                }
                Domain::Cells if what == Length::Facet.name() => {
                    return Err(fault(
                        term,
                        "facet_length is of facets, and dx is over cells",
                        "write h in dx, the diameter of the cell",
                    ));
                }
                // The same from both sides.
                Domain::Interior if what == Length::Facet.name() => {}
                Domain::Interior if !is_sided(side) => {
                    return Err(fault(
                        term,
                        format!("{what} has two values on the facets of dS"),
                        format!("take {what}('+'), {what}('-'), jump({what}) or avg({what})"),
                    ));
                }
                Domain::Cells | Domain::Boundary if is_sided(side) => {
                    return Err(fault(
                        term,
                        format!("a side of {what} is taken, and dx and ds have one side"),
                        "integrate over dS, or leave ('+'), ('-'), jump and avg out",
                    ));
                }
                _ => {}
            }
        }
        let integrand = self.scalars.map(integrand, &mut |s, node| match node {
            Node::Length(Length::Facet, _) => Some(s.push(Node::Length(Length::Facet, Side::Here))),
            _ => None,
        });
        let integrand = self.weighted(integrand, measure.domain);
        let is_test = |leaf: &Leaf| matches!(leaf.field, Field::Test(_));
        let terms = self.scalars.linear(integrand, &is_test).map_err(|why| {
            if self.weight.is_some() {
                let what = "a test function in a number";
                return fault(term, what, "a number is an integral of the solution");
            }
            let tests: Vec<&str> = self
                .names
                .unknowns
                .iter()
                .map(|u| u.test.as_str())
                .collect();
            let tests = tests.join(", ");
            let (what, remedy) = match why {
                NotLinear::Without => ("a term without a test function", "multiply it by"),
                NotLinear::Twice => ("a product of two test functions", "F is linear in"),
                NotLinear::Inside => (
                    "a test function inside of a function, power, divisor or condition",
                    "F is linear in",
                ),
            };
            fault(term, what, format!("{remedy} {tests}"))
        })?;
        Ok(Integral {
            measure,
            terms,
            at: term.start,
            is_mass: false,
        })
    }

    /// Times the test function of the weight, if there is one.
    fn weighted(&mut self, integrand: Id, domain: Domain) -> Id {
        let Some(weight) = self.weight else {
            return integrand;
        };
        let test = self.scalars.leaf(Leaf {
            field: Field::Test(weight),
            component: 0,
            axis: None,
            second: None,
            side: match domain {
                Domain::Interior => Side::Plus,
                _ => Side::Here,
            },
        });
        self.scalars.multiply(integrand, test)
    }

    pub(super) fn field_name(&self, field: Field) -> String {
        match field {
            Field::Unknown(k) | Field::Increment(k) => self.names.unknowns[k].name.clone(),
            Field::Old(k) => format!("old({})", self.names.unknowns[k].name),
            Field::Test(k) => self.names.unknowns[k].test.clone(),
            Field::Datum(k) => self.names.data[k].name.clone(),
        }
    }

    pub(super) fn measure(
        &mut self,
        whole: &Term,
        name: &str,
        arguments: &[Term],
    ) -> Result<Measure> {
        let (domain, dim) = match name {
            "dx" => (Domain::Cells, self.names.dim),
            "ds" => (Domain::Boundary, self.names.dim - 1),
            _ => (Domain::Interior, self.names.dim - 1),
        };
        let mut groups = Vec::new();
        let mut all: Vec<&Term> = Vec::new();
        let mut degree = None;
        for argument in arguments {
            match &argument.kind {
                Kind::Named(word, value) => {
                    let most = self.names.cells.most_degree(dim);
                    let found = match value.kind {
                        Kind::Number(x) if word == "degree" && x.fract() == 0.0 => Some(x as usize),
                        _ => None,
                    };
                    let found = found.filter(|found| *found <= most && degree.is_none());
                    degree = Some(found.ok_or_else(|| {
                        let remedy =
                            format!("write {name}(degree=2), an integer from 0 to {most}, once");
                        fault(argument, "this is not the degree of a rule", remedy)
                    })?);
                }
                Kind::List(parts) => all.extend(parts),
                _ => all.push(argument),
            }
        }
        for term in all {
            let word = match &term.kind {
                Kind::Name(name) | Kind::Text(name) => name.clone(),
                Kind::Number(number) => number.to_string(),
                _ => {
                    return Err(fault(
                        term,
                        "this is not a group",
                        "give names or numbers of groups",
                    ));
                }
            };
            let found = find_group(self.names.groups, &word, dim)
                .map_err(|(what, remedy)| fault(term, what, remedy))?;
            let on = self.names.groups[found].on;
            if on != Some(domain) {
                let (what, remedy) = match on {
                    Some(Domain::Boundary) => ("is on the boundary", "integrate over it with ds"),
                    Some(_) => ("is between cells", "integrate over it with dS"),
                    None => (
                        "is partly on the boundary and partly between cells",
                        "make two groups of it",
                    ),
                };
                return Err(fault(term, format!("the group `{word}` {what}"), remedy));
            }
            groups.push(found);
        }
        if domain == Domain::Boundary && groups.is_empty() && self.names.unmarked > 0 {
            let what = format!(
                "{} facets of the boundary are in no group, and not all codes integrate over those",
                self.names.unmarked
            );
            return Err(fault(
                whole,
                what,
                "name groups: ds(a, b), or mark the whole boundary in the mesh",
            ));
        }
        groups.sort_unstable();
        groups.dedup();
        Ok(Measure {
            domain,
            groups,
            degree,
        })
    }
}

/// The position of the group of this name or number.
///
/// # Errors
/// The error, with a remedy.
pub fn find_group(
    groups: &[Group],
    word: &str,
    dim: usize,
) -> std::result::Result<usize, (String, String)> {
    let is_meant = |group: &&Group| group.name == word || group.tag.to_string() == word;
    let found = groups
        .iter()
        .enumerate()
        .find(|(_, group)| group.dim == dim && is_meant(group));
    if let Some((_, group)) = found
        && !(1..=i64::from(i32::MAX)).contains(&group.tag)
    {
        let what = format!("the group `{word}` has the number {}", group.tag);
        return Err((
            what,
            "in most codes groups have positive numbers: change it in the mesh".into(),
        ));
    }
    found.map(|(k, _)| k).ok_or_else(|| {
        let of_dim = groups.iter().filter(|group| group.dim == dim);
        let known: Vec<&str> = of_dim.map(|group| group.name.as_str()).collect();
        let other = groups.iter().find(is_meant).map(|group| group.dim);
        let what = match other {
            Some(other) => {
                format!("the group `{word}` has cells of dimension {other}, and {dim} is needed")
            }
            None => format!("the mesh has no group `{word}`"),
        };
        let remedy = format!(
            "{}the groups of dimension {dim} are {}",
            meant(word, known.iter().copied()),
            known.join(", ")
        );
        (what, remedy)
    })
}
