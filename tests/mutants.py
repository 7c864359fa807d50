"""What must turn each verdict: makes inputs that are right, shows that they agree, puts one fault into each, and counts what
passes. None may.

    python3 tests/mutants.py PROGRAM [--seed N] [--count N] [--only PART,…] [--keep DIR] [--table docs/theory/hunt.md]

Equal seeds give equal mutants. What passes is kept, with the command that shows it.
"""

import argparse
import collections
import concurrent.futures
import random
import sys
import tempfile
import time
from pathlib import Path

from mutant import compare, face_off, odd, outside, schemes, trial

# Each verdict, how its mutants are made, and its part of them. What starts FreeFEM and dolfinx for each is dear.
SOURCES = [
    ("files", compare.files, 60),
    ("series", compare.series, 25),
    ("converted", compare.converted, 10),
    ("digits", odd.digits, 10),
    ("pieces", odd.pieces, 3),
    ("functions", odd.functions, 6),
    ("turned", odd.turned, 2),
    ("quadratic", odd.quadratic, 2),
    ("identity", odd.identity, 4),
    ("ghosts", odd.ghosts, 2),
    ("folders", odd.folders, 4),
    ("tables", odd.tables, 15),
    ("face-off fields", face_off.fields, 20),
    ("face-off numbers", face_off.numbers, 8),
    ("face-off programs", face_off.programs, 4),
    ("face-off orders", face_off.orders, 5),
    ("face-off records", face_off.records, 4),
    ("engines", schemes.engines, 20),
    ("against", schemes.against, 10),
    ("journal", schemes.journal, 2.5),
    ("judge", schemes.judge, 15),
    ("certify", schemes.certify, 1.5),
    ("matrix", schemes.matrix, 2),
    ("orders", schemes.campaigns, 2.5),
    ("action", outside.action, 2),
    ("campaigns", outside.campaigns, 0.6),
    ("templates", outside.templates, 0.6),
    ("pytest", outside.plugin, 10),
]


# What each is called in the table.
TITLES = {
    compare.files: "`compare` of two files, by format",
    compare.series: "`compare` of series",
    compare.converted: "`compare` of binary formats",
    odd.digits: "`compare` after changing a digit of a file",
    odd.pieces: "`compare` with a small body next to a large one",
    odd.functions: "`compare` as functions on two meshes",
    odd.turned: "`compare` of cells with a different order of corners",
    odd.quadratic: "`compare` of quadratic cells",
    odd.identity: "`compare` of a file with itself, or of nothing",
    odd.ghosts: "`compare` with ghosts and hidden cells",
    odd.folders: "`compare` of folders",
    odd.tables: "`compare` of tables, by key",
    face_off.fields: "`verify` of face-offs: fields, one or several times",
    face_off.numbers: "`verify` of face-offs: numbers",
    face_off.programs: "`verify` of face-offs: programs that misbehave",
    face_off.orders: "`verify` of face-offs: orders and exact answers",
    face_off.records: "`verify` of face-offs: `--record`, `--against`, `--resume`",
    schemes.engines: "`verify` of scenes: a code with false answers",
    schemes.against: "`verify --against`: a record or scene that was changed",
    schemes.journal: "`verify --resume`: a dependency of the journal was changed",
    schemes.judge: "`judge`",
    schemes.certify: "`certify`: a bound below the distance",
    schemes.matrix: "`matrix`",
    schemes.campaigns: "`orders`: a faulty order is measured",
    outside.action: "the GitHub action",
    outside.campaigns: "`stress` and `study`",
    outside.templates: "folders of `new`",
    outside.plugin: "pytest: `assert_agree`, `faceoff_regression`",
}


def drawn(seed, count, only, folder):
    """The trials, right inputs among them; `count` mutants, or a few less."""
    chosen = [s for s in SOURCES if only is None or s[0] in only.split(",")]
    whole = sum(part for _, _, part in chosen)
    for name, make, part in chosen:
        draw = random.Random(f"{seed} {name}")
        wanted = round(count * part / whole)
        if make is outside.plugin:
            trials = make(draw, folder, wanted) if wanted >= 60 else ()
        else:
            trials = take(make(draw), wanted)
        yield from ((TITLES[make], t) for t in trials)


def take(trials, wanted):
    """So many mutants, each group with its right input before it."""
    for t in trials:
        if wanted == 0:
            return
        yield t
        wanted -= not t.agrees


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("--seed", type=int, default=2017)
    parser.add_argument("--count", type=int, default=2030)
    parser.add_argument("--only")
    parser.add_argument("--keep", type=Path, default=Path("mutants"))
    parser.add_argument("--table", type=Path)
    arguments = parser.parse_args()
    program = str(Path(arguments.program).resolve())
    begun = time.monotonic()
    counts = collections.defaultdict(collections.Counter)
    faults = collections.defaultdict(set)
    wrong = 0
    with tempfile.TemporaryDirectory() as folder:
        trials = list(drawn(arguments.seed, arguments.count, arguments.only, folder))
    keeps = [arguments.keep / str(k) for k in range(len(trials))]
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        ran = pool.map(lambda t, keep: trial.run(program, t[1], keep), trials, keeps)
        for (title, t), keep, (code, said) in zip(trials, keeps, ran):
            kind = ("right", "right and refused")[code != 0] if t.agrees else KINDS.get(code, "broken")
            counts[title][kind] += 1
            if not t.agrees:
                faults[title].add(t.fault)
            if kind in ("passed", "broken", "right and refused"):
                wrong += 1
                last = said.strip().splitlines()[-1:] or [""]
                print(f"{kind}: {t.verdict}: {t.fault} (kept in {keep}): {last[0]}", flush=True)
    table = written(counts, faults)
    print(table, end="")
    if arguments.table:
        text = arguments.table.read_text()
        head, tail = text.index(HEAD), text.index("\n\n", text.index(HEAD))
        arguments.table.write_text(text[:head] + table.rstrip("\n") + text[tail:])
    mutants = sum(found[kind] for found in counts.values() for kind in (*KINDS.values(), "broken"))
    print(f"{mutants} mutants in {time.monotonic() - begun:.0f} s, {wrong} wrong")
    return wrong > 0


KINDS = {0: "passed", 1: "disagree", 2: "undetermined"}
HEAD = "| what is judged | right inputs | kinds of faults | mutants | disagree | undetermined | passed |"


def written(counts, faults):
    """The table, as the page has it."""
    lines = [HEAD, "|---|--:|--:|--:|--:|--:|--:|"]

    def row(title, found, kinds):
        mutants = sum(found[kind] for kind in KINDS.values())
        cells = [found["right"], kinds, mutants, found["disagree"], found["undetermined"], found["passed"]]
        return f"| {title} | " + " | ".join(map(str, cells)) + " |"

    lines += [row(title, found, len(faults[title])) for title, found in counts.items()]
    whole = sum(counts.values(), collections.Counter())
    lines.append(row("all", whole, len(set().union(*faults.values()))))
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sys.exit(main())
