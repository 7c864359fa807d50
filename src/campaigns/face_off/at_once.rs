//! Codes side by side: those whose scripts are written here, and our own solver.
//!
//! The user's programs may take all cores or write files next to the problem file, so they run one at a time.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use super::Player;
use faceoff_mesh::error::{Error, Result};

/// Does it run while others do?
fn is_written(player: &Player) -> bool {
    player.record.is_none() && player.code.program().is_none()
}

/// How many run at the same time on this number of cores.
pub fn most(players: &[Player], cores: usize) -> usize {
    let written = players.iter().filter(|player| is_written(player)).count();
    written.min(cores).max(1)
}

/// Asks each player, whose number `ask` gets, as many at a time as there are cores, and returns the answers in the order of the players. After an
/// error no other is begun.
///
/// # Errors
/// The first one of the players in their order; a thread that cannot be had.
pub fn at_once<T: Send>(
    players: &[Player],
    cores: usize,
    ask: impl Fn(usize, &Player) -> Result<T> + Sync,
) -> Result<Vec<T>> {
    let (together, apart): (Vec<usize>, Vec<usize>) =
        (0..players.len()).partition(|k| is_written(&players[*k]));
    let answers: Vec<Mutex<Option<Result<T>>>> = players.iter().map(|_| Mutex::new(None)).collect();
    let next = AtomicUsize::new(0);
    let answer = |k: usize| {
        let found = ask(k, &players[k]);
        let is_error = found.is_err();
        *answers[k].lock().unwrap_or_else(PoisonError::into_inner) = Some(found);
        is_error
    };
    let work = || {
        while let Some(k) = together.get(next.fetch_add(1, Ordering::Relaxed)) {
            if answer(*k) {
                next.store(together.len(), Ordering::Relaxed);
            }
        }
    };
    std::thread::scope(|scope| {
        let threads = (1..most(players, cores)).map(|_| {
            let thread = std::thread::Builder::new();
            thread.spawn_scoped(scope, work)
        });
        // Without a thread this one does all.
        let threads: Vec<_> = threads.filter_map(std::result::Result::ok).collect();
        work();
        for thread in threads {
            // What was not answered is reported below.
            let _ = thread.join();
        }
    });
    let is_good = |k: &usize| {
        let answer = answers[*k].lock().unwrap_or_else(PoisonError::into_inner);
        answer.as_ref().is_some_and(Result::is_ok)
    };
    if together.iter().all(is_good) {
        for k in apart {
            if answer(k) {
                break;
            }
        }
    }
    let (mut found, mut lost) = (Vec::with_capacity(players.len()), None);
    for (answer, player) in answers.into_iter().zip(players) {
        match answer.into_inner().unwrap_or_else(PoisonError::into_inner) {
            Some(answer) => found.push(answer?),
            None => lost = lost.or(Some(&player.name)),
        }
    }
    match lost {
        None => Ok(found),
        Some(name) => Err(Error::engine(
            name,
            "its run was lost",
            "run again, and report this",
        )),
    }
}
