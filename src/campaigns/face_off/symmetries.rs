//! What each code answers to images of the problem: an answer that does not move with them is wrong, and names its code.

use std::collections::BTreeMap;

use serde::Serialize;

use super::at_once::at_once;
use super::diagnosis::{differing, field_moved, number_moved};
use super::{OfField, OfNumber, Player, Rung, Running, run_how};
use crate::engine::{Back, Left, Progress, Task};
use crate::run::{Asked, FaceOff, Level, Same};
use crate::text::{Number, Text, text};
use faceoff_form::image::{Image, Motion};
use faceoff_judge::Verdict;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::Mesh;

/// How far answers to images may be apart where codes share the problem only, so that no tolerance says what rounding may do.
const MOVES: f64 = 1e-6;

/// The answers to images, on one level.
#[derive(Debug, Serialize)]
pub struct Symmetries {
    /// The refinement that all were run on.
    pub n: Option<usize>,
    /// The worst; undetermined where there is no image.
    pub verdict: Verdict,
    /// One for each code, image, and field or number.
    pub rows: Vec<OfImage>,
    /// What they say, in sentences without a full stop.
    pub findings: Vec<Text>,
}

/// A code's answer to an image of the problem, compared with its answer to the problem itself.
#[derive(Debug, Serialize)]
pub struct OfImage {
    /// The code.
    pub code: String,
    /// The image.
    #[serde(serialize_with = "name")]
    pub image: Image,
    /// The field or the number, by name.
    pub of: String,
    /// How far the answer is from the image of the answer, relative to the largest value; none where it is not known.
    pub relative: Option<f64>,
    /// How far it may be.
    pub allowed: f64,
    /// Of this code only.
    pub verdict: Verdict,
    /// Why it is not known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

fn name<S: serde::Serializer>(image: &Image, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_str(image.name())
}

/// Gives every code each image of the problem that there is, on the coarsest level where codes differ, or on the coarsest.
///
/// # Errors
/// A mesh that cannot be made; [`Error::Ended`].
pub(super) fn judge(
    of: &FaceOff,
    how: &Running,
    players: &[Player],
    rungs: &[Rung],
    (fields, numbers): (&[OfField], &[OfNumber]),
    progress: &dyn Progress,
) -> Result<Symmetries> {
    let rung = differing(rungs, fields, numbers);
    let mesh = of.mesh(rung.level.n)?;
    let mut rows = Vec::new();
    let all = how.symmetries.len() as f64;
    let has_answer: Vec<bool> = rung.left.iter().map(Option::is_some).collect();
    let (level, parameters) = (&rung.level, &rung.parameters);
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    for (k, image) in how.symmetries.iter().copied().enumerate() {
        let answers = at_once(players, cores, |at, player| {
            let (true, Some(mesh), None) = (has_answer[at], &mesh, player.record) else {
                return Ok(None);
            };
            progress.next(
                &format!("{}, {}", player.name, image.words()),
                k as f64 / all,
            );
            match again(of, how, player, (level, parameters, mesh), image) {
                Some(Err(Error::Ended(cause))) => Err(Error::Ended(cause)),
                again => Ok(again.map(|again| again.map_err(|error| error.to_string()))),
            }
        })?;
        for ((player, before), found) in players.iter().zip(&rung.left).zip(answers) {
            let (Some(before), Some(found)) = (before, found) else {
                continue;
            };
            for asked in &of.fields {
                let moved = field_moved(asked, player, before, &found)?;
                rows.push(row(player, image, asked, moved));
            }
            // Other numbers are the code's own, and nothing is known of how they move.
            for asked in of.numbers.iter().filter(|asked| !asked.value.is_empty()) {
                let name = asked.name_in(player.code.name());
                let after = found.as_ref().ok().and_then(|left| left.numbers.get(name));
                let moved = match (before.numbers.get(name), after) {
                    (Some(x), Some(y)) if (x - y).abs() <= asked.atol => Ok(0.0),
                    _ => number_moved(asked, player, before, &found),
                };
                rows.push(row(player, image, asked, moved));
            }
        }
    }
    let mut findings = Vec::new();
    let verdicts = settle(&rows, &mut findings);
    rows.sort_by_key(|row| players.iter().position(|player| player.name == row.code));
    Ok(Symmetries {
        n: rung.level.n,
        verdict: match rows.is_empty() {
            true => Verdict::Undetermined,
            false => Verdict::of_all(verdicts),
        },
        rows,
        findings,
    })
}

fn row(player: &Player, image: Image, asked: &Asked, moved: Result<f64, String>) -> OfImage {
    let allowed = match asked.same {
        Same::Discretisation if asked.rtol < 1.0 => asked.rtol,
        _ => asked.rtol.min(MOVES),
    };
    OfImage {
        code: player.name.clone(),
        image,
        of: asked.name.clone(),
        relative: moved.as_ref().ok().copied(),
        allowed,
        verdict: match &moved {
            Ok(far) if *far <= allowed => Verdict::Agree,
            Ok(_) => Verdict::Disagree,
            Err(_) => Verdict::Undetermined,
        },
        reason: moved.err(),
    }
}

/// The verdict on each field or number under each image. One that no code keeps is not a fault of one of them: the problem is conditioned so, has several
/// solutions, or has not that symmetry.
fn settle(rows: &[OfImage], findings: &mut Vec<Text>) -> Vec<Verdict> {
    let mut keys: Vec<(Image, &str)> = rows.iter().map(|row| (row.image, &*row.of)).collect();
    keys.sort_unstable();
    keys.dedup();
    let mut verdicts = Vec::new();
    for (image, of) in keys {
        let own = rows
            .iter()
            .filter(|row| (row.image, &*row.of) == (image, of));
        let own: Vec<&OfImage> = own.collect();
        let wrong = || own.iter().filter(|row| row.verdict == Verdict::Disagree);
        let stays = own.iter().any(|row| row.verdict.passes());
        if wrong().count() > 1 && !stays {
            verdicts.push(Verdict::Undetermined);
            findings.push(text!(
                "`{}` of no code keeps its values with {}: the problem is conditioned so, has several solutions, or has not that symmetry",
                of,
                image.words()
            ));
            continue;
        }
        findings.extend(wrong().map(|row| {
            let far = row.relative.unwrap_or(f64::NAN);
            text!(
                "`{}` of {} changes by {} of it with {}, and must not",
                of,
                row.code.clone(),
                Number::new(far, 2),
                image.words()
            )
        }));
        for row in own {
            if let Some(reason) = &row.reason {
                findings.push(text!(
                    "`{}` of {} with {}: {}",
                    of,
                    row.code.clone(),
                    image.words(),
                    reason
                ));
            }
            verdicts.push(row.verdict);
        }
    }
    verdicts
}

/// The answer of a code to an image, brought back; none where there is no image.
fn again(
    of: &FaceOff,
    how: &Running,
    player: &Player,
    (level, parameters, source): (&Level, &BTreeMap<String, String>, &Mesh),
    image: Image,
) -> Option<Result<Left>> {
    if !player.code.takes_mesh() {
        return None;
    }
    let is_by_hand = player.code.is_typed();
    let has_symmetry = image == Image::Renumbered || of.symmetries.contains(&image);
    // Data of scripts by hand may be symmetric about the middle, those of forms move with the mesh.
    let center = if is_by_hand { middle(source) } else { [0.0; 3] };
    let motion = image.about(center);
    let (mesh, numbers) = motion.mesh(source)?;
    let code = match player.code.of_image(&motion, has_symmetry)? {
        Ok(code) => code,
        Err(error) => return Some(Err(error)),
    };
    let task = Task {
        mesh: Some(&mesh),
        n: level.n,
        parameters,
    };
    let suffix = format!("-{}", image.name());
    let how = run_how(of, &code, level, &suffix, how, None);
    let again = code.run(&task, &how).and_then(|mut left| {
        left.bring_back(&Back {
            motion: Some(motion),
            vectors: vectors(of, player, &motion),
            numbers,
        });
        left.lay_on(source)?;
        of.integrate(player.code, Some(source), parameters, &mut left);
        Ok(left)
    });
    Some(again)
}

/// The fields whose components turn with the mesh: of forms those that are vectors as a whole, of scripts by hand all with as many components as the mesh has
/// dimensions.
fn vectors(of: &FaceOff, player: &Player, motion: &Motion) -> Vec<String> {
    if !motion.turns() {
        return Vec::new();
    }
    if let (Some(form), false) = (&of.form, player.code.is_typed()) {
        let whole = form
            .unknowns
            .iter()
            .filter(|of| of.space.element.is_vector());
        return whole.map(|of| of.name.clone()).collect();
    }
    let name = |asked: &Asked| asked.name_in(player.code.name()).to_owned();
    of.fields.iter().map(name).collect()
}

/// The middle of the box around a mesh.
fn middle(mesh: &Mesh) -> [f64; 3] {
    std::array::from_fn(|k| {
        let of = |fold: fn(f64, f64) -> f64| mesh.points.iter().map(|x| x[k]).reduce(fold);
        let [low, high] = [of(f64::min), of(f64::max)].map(Option::unwrap_or_default);
        0.5 * (low + high)
    })
}
