//! The fields of templates: a problem in the notation of a code.

use faceoff_mesh::mesh::CellKind;
use minijinja::{Value, context};

use super::points;
use super::speaker::Speaker;
use super::spelling::{comment, measure};
use super::strong::{component as component_of, strong_form};
use super::table::Sharing;
use crate::grid::Cells;
use crate::language::find_group;
use crate::problem::{Bilinear, Domain, Element, Held, Integral, Problem, Space, Unknown};
use crate::scalar::{Field, Id, Length};

/// The fields of a problem; `mesh` is the file that the script reads.
///
/// # Errors
/// Features that the code lacks.
pub fn fields(of: &mut Speaker<'_>, mesh: &str, has_system: bool) -> Result<Value, String> {
    let rules = rules(of)?;
    let functions = all(of.problem.blocks(), |(k, c)| function(of, k, c))?;
    let unknowns = all(0..of.problem.unknowns.len(), |k| unknown(of, k))?;
    let data = all(0..of.problem.data.len(), |k| datum(of, k))?;
    let interpolated = all(of.words.interpolated(&of.problem), |(name, element, id)| {
        let space = space_of(of, element)?;
        Ok(context! { name, element => space, degree => element.degree(), ..of.value(id) })
    })?;
    let more = (of.code.more)(of);
    let integrals = integrals(of);
    let problem = &of.problem;
    let held = problem.held();
    let is_whole = |held: &Held| held.component.is_none();
    let parameters = problem.parameters.iter().zip(&of.words.parameters);
    let lines = problem
        .form
        .source
        .lines()
        .map(str::trim)
        .filter(|line| !line.is_empty());
    let groups = problem.groups.iter().map(|group| {
        // Its codimension in the mesh.
        let less = problem.dim - group.dim;
        context! { name => comment(&group.name), tag => group.tag, less }
    });
    Ok(context! {
        name => problem.name.as_str(),
        file => of.code.file(problem),
        mesh,
        // Does it write its linear system too?
        has_system,
        // Is that at a state, since the form is nonlinear?
        has_state => has_system && !problem.clone().is_linear(),
        // `None` if the form itself is written.
        scheme => scheme(of)?,
        dim => problem.dim,
        cell => cell(problem),
        // Names of the coordinates.
        axes => ["x", "y", "z"][..problem.dim].to_vec(),
        about => comment(&problem.about),
        // The form as it was written, and the strong form if it is short.
        definitions => problem.definitions.iter().map(|d| comment(&d.line())).collect::<Value>(),
        form => lines.map(comment).collect::<Value>(),
        strong_form => strong_form(problem).iter().map(|line| comment(line)).collect::<Value>(),
        parameters => parameters
            .map(|(p, name)| context! { name => name.as_str(), value => format!("{:?}", p.value) })
            .collect::<Value>(),
        data,
        // The components of data that are interpolated.
        interpolated,
        unknowns,
        // The scalar functions of the unknowns, and functions in spaces of vectors.
        functions,
        // The components of all unknowns.
        components => problem.components().into_iter().map(|(k, c)| names(of, k, Some(c))).collect::<Value>(),
        groups => groups.collect::<Value>(),
        // On cells and on facets.
        rules,
        holds_parts => !held.iter().all(is_whole),
        holds_wholes => held.iter().any(is_whole),
        held => held.iter().map(|held| condition(of, held)).collect::<Result<Value, String>>()?,
        means => means(of),
        // `None` if nothing depends on time.
        time => time(of),
        // `None` if F(u; v) = 0 is solved.
        eigen => eigen(problem),
        has_diameter => problem.has_length(Length::Diameter),
        has_circumradius => problem.has_length(Length::Circumradius),
        has_facet_length => problem.has_length(Length::Facet),
        output => output(problem)?,
        // For one code only.
        more,
        ..integrals
    })
}

fn all<T>(
    parts: impl IntoIterator<Item = T>,
    each: impl Fn(T) -> Result<Value, String>,
) -> Result<Value, String> {
    parts.into_iter().map(each).collect()
}

/// The names of a component of an unknown or of the whole, and of related functions.
fn names(of: &Speaker<'_>, unknown: usize, component: Option<usize>) -> Value {
    let name = |field| match component {
        Some(c) => of.words.parts(field)[c].as_str(),
        None => of.words.whole(field),
    };
    context! {
        name => name(Field::Unknown(unknown)),
        test => name(Field::Test(unknown)),
        increment => name(Field::Increment(unknown)),
        // At the end of the previous step.
        old => of.problem.time.as_ref().map(|_| name(Field::Old(unknown))),
    }
}

/// The space of a component of data.
fn space_of(of: &Speaker<'_>, element: Element) -> Result<String, String> {
    let size = None;
    (of.code.element)(&of.problem, Space { element, size })
}

fn rules(of: &Speaker<'_>) -> Result<Value, String> {
    let names = (of.code.rules)(&of.problem)?;
    let rules = of.problem.all_rules();
    let each = rules.iter().zip(names).enumerate().map(|(k, (rule, name))| {
        // The weights sum to the volume of the reference cell.
        let volume = of.problem.cells.volume(rule.points[0].len());
        let weights = rule.weights.iter().map(|w| format!("{:?}", w * volume));
        let points = rule.points.iter().map(|point| format!("{point:?}"));
        let is_facets = rule.points[0].len() < of.problem.dim;
        context! { name, word => word(k), is_facets, points => points.collect::<Value>(), weights => weights.collect::<Value>() }
    });
    Ok(each.collect())
}

/// The name of a rule in scripts.
fn word(k: usize) -> String {
    match k {
        0 => "rule".into(),
        1 => "facet_rule".into(),
        k => format!("rule{k}"),
    }
}

fn datum(of: &Speaker<'_>, k: usize) -> Result<Value, String> {
    let datum = &of.problem.data[k];
    let parts = of
        .words
        .parts(Field::Datum(k))
        .iter()
        .zip(&datum.components);
    let parts = parts.map(|(name, id)| context! { name => name.as_str(), ..of.value(*id) });
    let element = datum.space.map(|space| space_of(of, space.element));
    Ok(context! {
        name => of.words.whole(Field::Datum(k)),
        title => datum.name.as_str(),
        texts => datum.texts.iter().map(|text| comment(text)).collect::<Value>(),
        space => datum.space.map(Space::name),
        shape => datum.shape.clone(),
        // The space of its interpolation; `None` if it is evaluated at the quadrature points.
        element => element.transpose()?,
        degree => datum.space.map(|space| space.element.degree()),
        parts => parts.collect::<Value>(),
    })
}

fn unknown(of: &Speaker<'_>, k: usize) -> Result<Value, String> {
    let unknown = &of.problem.unknowns[k];
    let space = unknown.space;
    let parts = (0..space.count()).map(|c| names(of, k, Some(c)));
    let functions = of.problem.blocks().into_iter().enumerate();
    let functions = functions.filter_map(|(at, (unknown, _))| (unknown == k).then_some(at));
    Ok(context! {
        // Its name in the form.
        title => unknown.name.as_str(),
        test_title => unknown.test.as_str(),
        space => space.name(),
        family => space.element.name(),
        // The position of its first component among all.
        position => of.problem.position(k, 0),
        element => (of.code.element)(&of.problem, space)?,
        is_continuous => space.element.is_continuous(),
        is_vector => space.element.is_vector(),
        size => space.size,
        parts => parts.collect::<Value>(),
        // Their positions.
        functions => functions.collect::<Value>(),
        ..names(of, k, None)
    })
}

fn function(of: &Speaker<'_>, unknown: usize, component: Option<usize>) -> Result<Value, String> {
    let space = of.problem.unknowns[unknown].space;
    let held = of.problem.held().into_iter();
    let held = held.filter(|held| (held.unknown, held.component) == (unknown, component));
    Ok(context! {
        unknown,
        element => (of.code.element)(&of.problem, space)?,
        // The space's name in form files.
        family => space.element.name(),
        is_vector => component.is_none(),
        degree => space.element.degree(),
        held => all(held, |held| condition(of, &held))?,
        ..names(of, unknown, component)
    })
}

/// A measure: its name, the form's text of it, the numbers of its groups and their positions among all, from 1.
pub fn over(of: &Speaker<'_>, integral: &Integral) -> Value {
    let problem = &of.problem;
    let tags = |groups: &[usize]| {
        groups
            .iter()
            .map(|k| problem.groups[*k].tag)
            .collect::<Value>()
    };
    let places = integral.measure.groups.iter().map(|k| k + 1);
    let rule = problem.rule_of(&integral.measure, problem.rules());
    let own = problem.all_rules().iter().rposition(|known| *known == rule);
    let rule = match (integral.measure.degree, integral.measure.domain) {
        (Some(_), _) => own.unwrap_or(0),
        (None, Domain::Cells) => 0,
        (None, _) => 1,
    };
    context! {
        // The position of its rule among all, and the name of the rule.
        rule,
        rule_word => word(rule),
        kind => match integral.measure.domain {
            Domain::Cells => "dx",
            Domain::Boundary => "ds",
            Domain::Interior => "dS",
        },
        title => comment(&measure(problem, &integral.measure)),
        is_mass => integral.is_mass,
        tags => tags(&integral.measure.groups),
        // Including those of the whole boundary, if a code otherwise integrates over all facets.
        named => tags(&problem.named(&integral.measure)),
        places => places.collect::<Value>(),
    }
}

/// Names for subexpressions that occur more than once.
pub fn named(shared: Vec<(String, String)>) -> Value {
    let each = shared.into_iter();
    each.map(|(name, value)| context! { name, value }).collect()
}

/// The residual, and its derivative if the code does not compute it.
fn integrals(of: &mut Speaker<'_>) -> Value {
    let sharing = of.code.sharing;
    if sharing == Sharing::Own {
        return context! {};
    }
    let residual = of.problem.residual();
    let by_hand = residual
        .iter()
        .map(|i| (of.code.by_hand)(&mut of.problem, i));
    let by_hand: Vec<bool> = by_hand.collect();
    let derivative = residual
        .iter()
        .zip(&by_hand)
        .map(|(i, by_hand)| match by_hand {
            true => of.problem.derivative(i),
            false => Bilinear::new(),
        });
    let derivative: Vec<Bilinear> = derivative.collect();
    let mut roots: Vec<Id> = residual
        .iter()
        .flat_map(|i| i.terms.values().copied())
        .collect();
    let more: Vec<Id> = derivative
        .iter()
        .flat_map(|d| d.values().copied())
        .collect();
    if sharing == Sharing::Together {
        roots.extend(&more);
    }
    let (shared, known) = of.share(&roots);
    let sums = residual.iter().map(|integral| {
        let products = integral.terms.iter().map(|(test, c)| (*c, vec![*test]));
        of.sum(products, &known)
    });
    let sums: Vec<Vec<Value>> = sums.collect();
    of.in_derivative = true;
    let (of_derivative, known) = match sharing {
        Sharing::Apart => of.share(&more),
        _ => (Vec::new(), known),
    };
    let each = residual.iter().zip(sums).enumerate();
    let each = each.map(|(position, (integral, terms))| {
        let products = derivative[position].iter();
        let products = products.map(|((test, d), c)| (*c, vec![*d, *test]));
        context! {
            position,
            terms,
            // Is the derivative written out, and how?
            by_hand => by_hand[position],
            derivative => of.sum(products, &known),
            ..over(of, integral)
        }
    });
    let each: Value = each.collect();
    of.in_derivative = false;
    context! {
        integrals => each,
        shared => named(shared),
        shared_by_derivative => named(of_derivative),
    }
}

/// A Dirichlet condition.
fn condition(of: &Speaker<'_>, held: &Held) -> Result<Value, String> {
    let space = of.problem.unknowns[held.unknown].space;
    let group = &of.problem.groups[held.group];
    let title = &of.problem.unknowns[held.unknown].name;
    let values = held.values.iter().map(|id| of.value(*id));
    Ok(context! {
        unknown => held.unknown,
        title => match held.component {
            Some(c) => component_of(title, space.size, c),
            None => title.clone(),
        },
        // `None` if it is a function of vectors as a whole; then the trace that is prescribed.
        component => held.component,
        is_whole => held.component.is_none(),
        trace => match space.element {
            Element::RaviartThomas => "normal",
            _ => "tangential",
        },
        // The position of the component among all.
        position => of.problem.position(held.unknown, held.component.unwrap_or(0)),
        element => (of.code.element)(&of.problem, space)?,
        degree => space.element.degree(),
        group => comment(&group.name),
        tag => group.tag,
        // The position of the group among all, from 1.
        place => held.group + 1,
        is_between => group.on == Some(Domain::Interior),
        values => values.collect::<Value>(),
        ..names(of, held.unknown, held.component)
    })
}

fn means(of: &Speaker<'_>) -> Value {
    let each = of.problem.means.iter();
    let each = each.map(|mean| {
        context! {
            title => of.problem.unknowns[mean.unknown].name.as_str(),
            value => format!("{:?}", mean.value),
            ..names(of, mean.unknown, None)
        }
    });
    each.collect()
}

fn time(of: &Speaker<'_>) -> Option<Value> {
    let time = of.problem.time.as_ref()?;
    let initial = time.initial.iter().map(|initial| {
        let (unknown, component) = (initial.unknown, initial.component);
        let Unknown { name, space, .. } = &of.problem.unknowns[unknown];
        let element = space.element;
        context! {
            title => component_of(name, space.size, component),
            unknown,
            component,
            // The positions of the component and of its function among all.
            position => of.problem.position(unknown, component),
            function => of.problem.block(unknown, component),
            family => element.name(),
            degree => element.degree(),
            name => of.words.parts(Field::Unknown(unknown))[component].as_str(),
            ..of.value(initial.value)
        }
    });
    let initial: Value = initial.collect();
    let [t, dt] = [0, 1].map(|k| of.words.parameters[time.parameter + k].as_str());
    let [end, step] = [0, 1].map(|k| of.problem.parameters[time.parameter + k].value);
    let [end, step] = [end, step].map(|value| format!("{value:?}"));
    Some(context! { t, dt, end, step, steps => time.steps, initial })
}

/// The data of a handwritten scheme in addition to parameters: the groups, and the names of its data.
fn scheme(of: &Speaker<'_>) -> Result<Option<Value>, String> {
    let Some(text) = of.code.by_hand_scheme else {
        return Ok(None);
    };
    let problem = &of.problem;
    let parts = problem.parts.as_ref();
    let parts = parts.ok_or("its scheme is for scenes of elasticity, and this is a form")?;
    let tags = |names: &[String]| {
        let found = names.iter().map(|name| {
            let found = find_group(&problem.groups, name, problem.dim - 1);
            found.map(|k| problem.groups[k].tag)
        });
        let found: Result<Vec<i64>, _> = found.collect();
        found.map_err(|(what, _)| what)
    };
    let datum = |name: &str| {
        let found = problem.data.iter().position(|datum| datum.name == name)?;
        let field = Field::Datum(found);
        Some(context! { name => of.words.whole(field), parts => of.words.parts(field).to_vec() })
    };
    Ok(Some(context! {
        text => text.trim_end(),
        // Of groups of facets.
        contact => tags(&parts.contact)?,
        neumann => tags(&parts.neumann)?,
        is_stress => parts.is_stress,
        has_jumps => problem.has_length(Length::Facet),
        f => datum("f"),
        t => datum("t"),
        psi => datum("psi"),
        along => datum("along"),
        friction => datum("friction"),
        coulomb => datum("coulomb"),
    }))
}

/// The request of an eigenproblem: the number of eigenvalues in scripts, the target, and m as it was written.
fn eigen(problem: &Problem) -> Option<Value> {
    let eigen = problem.eigen.as_ref()?;
    let lines = eigen.mass.source.lines().map(str::trim);
    let lines = lines.filter(|line| !line.is_empty()).map(comment);
    let shift = format!("{:?}", eigen.shift);
    Some(context! { count => eigen.found(), shift, mass => lines.collect::<Value>() })
}

/// The cells of the mesh.
fn cell(problem: &Problem) -> Value {
    let (cells, dim) = (problem.cells, problem.dim);
    // The corners in file order, listed for a loop along x, then y, then z.
    let order: &[usize] = match (cells, dim) {
        (Cells::Simplices, _) => &[],
        (_, 2) => &[0, 1, 3, 2],
        _ => &[0, 1, 3, 2, 4, 5, 7, 6],
    };
    let corners = || 0..cells.corners(dim);
    let pairs = corners().flat_map(|i| corners().take(i).map(move |j| [j, i]));
    let edges = pairs.filter_map(|[j, i]| match order {
        [] => Some(vec![j, i]),
        _ => (i ^ j).is_power_of_two().then(|| vec![order[j], order[i]]),
    });
    context! {
        // The ends of its edges, in the order of files.
        edges => edges.collect::<Vec<_>>(),
        name => match (cells, dim) {
            (Cells::Cubes, 2) => "quadrilateral",
            _ => cells.name(dim),
        },
        is_cube => cells == Cells::Cubes,
        order => order.to_vec(),
        // Gmsh's numbers of the kinds of cells and facets.
        kinds => cells.kinds(dim).map(CellKind::gmsh).to_vec(),
        facets => cells.facets(dim),
    }
}

/// The cells of the result: VTK's number, and the positions of the nodes in the reference cell.
fn output(problem: &Problem) -> Result<Value, String> {
    let element = problem.output();
    let (nodes, kind) = points::nodes(element, problem.cells, problem.dim)?;
    let texts = |node: Vec<f64>| node.iter().map(|t| format!("{t:?}")).collect::<Value>();
    Ok(context! {
        degree => element.degree(),
        is_continuous => element.is_continuous(),
        kind => usize::from(kind),
        nodes => nodes.into_iter().map(texts).collect::<Value>(),
    })
}
