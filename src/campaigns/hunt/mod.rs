//! Random forms in every code: what differs, or moves where it must not, is made smaller while it does, and reported once for each cause.

mod files;
mod trial;

use std::path::Path;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use crate::engine::{OWN, Progress};
use faceoff_form::image::Image;
use faceoff_form::random::{Drawn, Grammar, Random, Rewritten, Shape};
use faceoff_judge::Verdict;
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Place, Result};
use faceoff_mesh::mesh::Mesh;
pub use files::LIBRARIES;
use trial::{Integrals, Trial, rewritten, symmetric, trial};
pub use trial::{Kind, Suspect};

/// Problems of one form: what codes have compiled for it they need not compile again.
const OF_ONE: usize = 4;
/// Of a form whose mesh no generator makes.
const FILE: &str = "[mesh]\nfile = \"mesh.msh\"\n";
/// Of a cause that is a rule of a measure.
const DEGREE: &str = "(degree=";
/// At most this many trials are spent on making a finding smaller.
const TRIES: usize = 40;
/// The same of what takes long.
const FEW: usize = 8;
/// Between the names of two codes of which one is wrong.
const OR: &str = "-or-";

/// What is asked.
pub struct HuntRequest {
    /// The codes that solve forms, by name; a single code is compared with its own answers to images of a problem.
    pub engines: Vec<String>,
    /// Whether meshes are written and read by libraries, which `engines` then names, instead of forms solved by codes.
    pub files: bool,
    /// Of the forms that are drawn.
    pub seed: u64,
    /// The number of problems after which the hunt ends; none if it ends by its time limit or an interruption.
    pub count: Option<usize>,
    /// A code that takes longer than this hangs.
    pub patience: Duration,
    /// What an earlier hunt found, which goes on.
    pub before: Option<HuntOutcome>,
}

/// What was found.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct HuntOutcome {
    /// The codes.
    pub engines: Vec<String>,
    /// Whether files were written and read instead of forms solved.
    pub files: bool,
    /// Of the forms that were drawn.
    pub seed: u64,
    /// Problems so far.
    pub problems: usize,
    /// Forms so far, each of which is that of up to four problems.
    pub forms: usize,
    /// Problems on which all codes agree, and which move as they must.
    pub agree: usize,
    /// Problems on which answers differ by no more than rounding moves them.
    pub conditioned: usize,
    /// Problems that fewer than two codes have an answer to, or whose answers cannot be judged.
    pub refused: usize,
    /// Seconds so far.
    pub seconds: f64,
    /// One for each fault.
    pub findings: Vec<Finding>,
}

/// A fault of a code.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Finding {
    /// The code that is wrong.
    pub code: String,
    /// What it does.
    pub kind: Kind,
    /// What distinguishes one finding from another: the change that explains it, or the form in its smallest case.
    pub cause: String,
    /// What was found, as a sentence without a full stop.
    pub words: String,
    /// The smallest case: a form file, for which a mesh that no generator makes is `mesh.msh` in the same folder, or of files the mesh as JSON.
    pub form: String,
    /// The name of the file that holds it.
    pub file: String,
    /// That mesh.
    #[serde(skip)]
    pub grid: Option<Mesh>,
    /// A description of the mesh.
    pub mesh: String,
    /// The number of the problem that showed it first, from 1.
    pub first: usize,
    /// The number of the form of that problem, from 1.
    pub form_number: usize,
    /// How many problems have shown it.
    pub times: usize,
    /// How many smaller problems were tried.
    pub tried: usize,
}

impl Finding {
    /// Whether this code is wrong, or one of two of which one is.
    pub fn is_of(&self, code: &str) -> bool {
        self.code.split(OR).any(|of| of == code)
    }

    /// The name of its folder: the code and the place in the list.
    pub fn name(&self, k: usize) -> String {
        format!("{}-{}", self.code, k + 1)
    }
}

impl HuntOutcome {
    fn new(request: &HuntRequest) -> Self {
        HuntOutcome {
            engines: request.engines.clone(),
            files: request.files,
            seed: request.seed,
            problems: 0,
            forms: 0,
            agree: 0,
            conditioned: 0,
            refused: 0,
            seconds: 0.0,
            findings: Vec::new(),
        }
    }

    /// Agree where nothing was found.
    pub fn verdict(&self) -> Verdict {
        match (self.findings.is_empty(), self.agree) {
            (false, _) => Verdict::Disagree,
            (true, 0) => Verdict::Undetermined,
            (true, _) => Verdict::Agree,
        }
    }

    /// An earlier hunt that goes on with these codes and this seed.
    ///
    /// # Errors
    /// A file that is not of a hunt, or of another one.
    pub fn read(path: &Path, text: &str, [engines, seed]: [&str; 2]) -> Result<Self> {
        let refuse = |what: String, remedy: &str| Error::file(path, Place::Whole, what, remedy);
        let found: HuntOutcome = serde_json::from_str(text)
            .map_err(|e| refuse(e.to_string(), "name the folder of an earlier hunt"))?;
        let had = [found.engines.join(","), found.seed.to_string()];
        if had != [engines, seed] {
            let [engines, seed] = had;
            let what = "it is of another hunt".to_owned();
            let remedy =
                format!("go on with --engines {engines} --seed {seed}, or take another folder");
            return Err(refuse(what, &remedy));
        }
        Ok(found)
    }
}

/// Hunts until the count is reached or the run is ended; `each` hears what there is after each problem.
///
/// # Errors
/// A library that is not installed; a form that cannot be read, which would be a fault of this program; what `each` cannot keep.
pub fn hunt(
    request: &HuntRequest,
    progress: &dyn Progress,
    each: &mut dyn FnMut(&HuntOutcome) -> Result<()>,
) -> Result<HuntOutcome> {
    if request.files {
        files::installed(&request.engines)?;
    }
    let begun = Instant::now();
    let mut outcome = match &request.before {
        Some(before) => before.clone(),
        None => HuntOutcome::new(request),
    };
    let (earlier, start) = (outcome.seconds, outcome.problems);
    let mut kept: Option<(Drawn, Random, Option<Integrals>)> = None;
    loop {
        let number = outcome.problems;
        if request.count.is_some_and(|count| number >= count) {
            break;
        }
        let label = format!("problem {}, {} found", number + 1, outcome.findings.len());
        let share = match request.count {
            Some(count) => (number - start) as f64 / (count - start).max(1) as f64,
            None => 0.0,
        };
        progress.next(&label, share);
        let done = match request.files {
            true => files::problem(request, number, &mut outcome),
            false => of_forms(request, number, &mut kept, &mut outcome),
        };
        outcome.forms = match done {
            Err(Error::Ended(_)) => break,
            forms => forms?,
        };
        outcome.problems = number + 1;
        outcome.seconds = earlier + begun.elapsed().as_secs_f64();
        each(&outcome)?;
        if cancel::check().is_err() {
            break;
        }
    }
    Ok(outcome)
}

/// The problem of this number, where `kept` has the form of the last one; returns the number of forms so far.
fn of_forms(
    request: &HuntRequest,
    number: usize,
    kept: &mut Option<(Drawn, Random, Option<Integrals>)>,
    outcome: &mut HuntOutcome,
) -> Result<usize> {
    // Each form has its own random numbers, so that a hunt that goes on draws what it would have drawn.
    let (of_form, turn) = (number / OF_ONE, number % OF_ONE);
    let (drawn, mut random, before) = match kept.take() {
        Some(kept) if turn > 0 => kept,
        _ => {
            // What was drawn for the problems of this form that an earlier hunt had.
            let (drawn, mut random) = form(request.seed, of_form);
            (2..turn).for_each(|_| drop(another(&drawn, &mut random)));
            (drawn, random, None)
        }
    };
    let of = (&drawn, turn, before.as_ref());
    let integrals = problem(request, of, &mut random, of_form, outcome)?;
    *kept = Some((drawn, random, integrals));
    Ok(of_form + 1)
}

/// The random numbers of a form or mesh.
fn numbers(seed: u64, number: usize) -> Random {
    Random::new(seed.wrapping_mul(1_000_003).wrapping_add(number as u64))
}

/// The form of this number.
fn form(seed: u64, number: usize) -> (Drawn, Random) {
    let mut random = numbers(seed, number);
    let shape = Shape::new(&mut random);
    let grammar = Grammar::on(shape);
    (Drawn::new(&mut random, &grammar, shape), random)
}

/// The same terms with other values on another mesh.
fn another(drawn: &Drawn, random: &mut Random) -> Drawn {
    let shape = drawn.shape.other(random);
    drawn.varied(random, shape)
}

/// What is done to a problem, whose solution is known by that.
#[derive(Clone, Copy)]
enum Twist {
    Image(Image),
    Rewritten(Rewritten),
}

/// One problem of a form: the form itself, an image of it, or the same terms with other values on another mesh. The integrals of the answers to
/// the form itself are returned, for the same in other words.
fn problem(
    request: &HuntRequest,
    (drawn, turn, before): (&Drawn, usize, Option<&Integrals>),
    random: &mut Random,
    of_form: usize,
    outcome: &mut HuntOutcome,
) -> Result<Option<Integrals>> {
    let twist = match (turn, of_form % 8) {
        (1, _) if drawn.is_patch => Some(Twist::Rewritten(Rewritten::Raised)),
        (1, 0) => Some(Twist::Image(Image::Turned)),
        (1, 1) => Some(Twist::Image(Image::Mirrored)),
        (1, 2) => Some(Twist::Rewritten(Rewritten::Doubled)),
        (1, 4) => Some(Twist::Rewritten(Rewritten::Halved)),
        (1, 5) => Some(Twist::Image(Image::Scaled)),
        (1, 7) => Some(Twist::Image(Image::Regrouped)),
        // Codes that compile forms need not do so for another order.
        (1, _) => Some(Twist::Image(Image::Renumbered)),
        _ => None,
    };
    let drawn = match turn {
        0 | 1 => drawn.clone(),
        _ => another(drawn, random),
    };
    let patience = request.patience;
    let ask = |drawn: &Drawn, engines: &[String], before: Option<&Integrals>| match twist {
        Some(Twist::Image(image)) => {
            let found = symmetric(drawn, image, engines, patience)?;
            Ok((found, Integrals::new()))
        }
        Some(Twist::Rewritten(how)) => rewritten((drawn, before), how, engines, patience),
        None => trial(drawn, engines, patience),
    };
    let (found, integrals) = ask(&drawn, &request.engines, before)?;
    match found {
        Trial::Agree => outcome.agree += 1,
        Trial::Conditioned => outcome.conditioned += 1,
        Trial::Refused => outcome.refused += 1,
        Trial::Wrong(suspects) => {
            for suspect in suspects {
                let ask = |drawn: &Drawn, engines: &[String]| Ok(ask(drawn, engines, None)?.0);
                keep(request, &drawn, suspect, of_form, outcome, &ask)?;
            }
        }
    }
    Ok(Some(integrals))
}

/// Makes what was found smaller, and keeps it where it is not known yet.
fn keep(
    request: &HuntRequest,
    drawn: &Drawn,
    suspect: Suspect,
    of_form: usize,
    outcome: &mut HuntOutcome,
    ask: &dyn Fn(&Drawn, &[String]) -> Result<Trial>,
) -> Result<()> {
    let number = outcome.problems + 1;
    let is_same = |of: &Suspect| of.code == suspect.code && of.kind == suspect.kind;
    // The other codes are not needed to see it.
    let mut engines = vec![suspect.code.clone()];
    let other = request.engines.iter().find(|name| **name == OWN);
    engines.extend(other.filter(|own| **own != suspect.code).cloned());
    if engines.len() < 2 && request.engines.len() > 1 {
        engines.clone_from(&request.engines);
    }
    let wrong = |drawn: &Drawn| match ask(drawn, &engines)? {
        Trial::Wrong(suspects) => Ok(suspects.into_iter().find(is_same)),
        _ => Ok(None),
    };
    // Where it is right without the rules that measures have of their own, that is its cause whatever else explains it.
    let rules = match drawn.rules() {
        Some(rules) if matches!(wrong(&drawn.without_rules()), Ok(None)) => Some(rules),
        _ => None,
    };
    // What is explained as something that is known needs no smaller case.
    let is_known = |finding: &Finding, cause: &str, is_rule: bool| {
        let is_code = finding.code == suspect.code && finding.kind == suspect.kind;
        let of_rules = is_rule && finding.cause.contains(DEGREE);
        is_code && (of_rules || finding.cause == cause)
    };
    let cause = suspect.cause.as_deref().unwrap_or_default();
    let mut findings = outcome.findings.iter_mut();
    let known = findings.find(|of| is_known(of, cause, rules.is_some()));
    if let Some(known) = known {
        known.times += 1;
        return Ok(());
    }
    let (smallest, last, tried) = smaller(drawn, &suspect, Drawn::simpler, &wrong)?;
    let cause = match (rules, last.cause.clone()) {
        (None, Some(cause)) => cause,
        _ => smallest.key(),
    };
    let mut findings = outcome.findings.iter_mut();
    let known = findings.find(|of| is_known(of, &cause, cause.contains(DEGREE)));
    if let Some(known) = known {
        known.times += 1;
        return Ok(());
    }
    let generator = smallest.shape.generator();
    let grid = match generator {
        None => Some(smallest.shape.mesh()?),
        Some(_) => None,
    };
    outcome.findings.push(Finding {
        code: suspect.code,
        kind: suspect.kind,
        cause,
        words: last.words,
        form: smallest.text("found") + &generator.unwrap_or_else(|| FILE.to_owned()),
        file: "form.toml".to_owned(),
        grid,
        mesh: smallest.shape.words(),
        first: number,
        form_number: of_form + 1,
        times: 1,
        tried,
    });
    Ok(())
}

/// Takes the first of the simpler cases that is wrong in the same way, again and again; the last one, what is wrong there, and the number of cases tried.
fn smaller<C: Clone>(
    drawn: &C,
    suspect: &Suspect,
    simpler: fn(&C) -> Vec<C>,
    wrong: &dyn Fn(&C) -> Result<Option<Suspect>>,
) -> Result<(C, Suspect, usize)> {
    let (mut smallest, mut last, mut tried) = (drawn.clone(), suspect.clone(), 0);
    let mut at = 0;
    // A case that hangs takes the time limit each time.
    let most = match suspect.kind {
        Kind::Hangs => FEW,
        _ => TRIES,
    };
    while let Some(case) = simpler(&smallest).get(at)
        && tried < most
    {
        tried += 1;
        match wrong(case) {
            Ok(Some(of)) => (smallest, last) = (case.clone(), of),
            Ok(None) => at += 1,
            // What was found so far counts.
            Err(Error::Ended(_)) => break,
            Err(error) => return Err(error),
        }
    }
    Ok((smallest, last, tried))
}
