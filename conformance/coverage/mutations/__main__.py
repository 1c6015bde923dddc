"""Coverage of requirements: python3 -m mutations [--check | --cited] [--part N] [--jobs N] [REQUIREMENT...], in
conformance/coverage

A requirement counts as covered if the vectors notice when the oracle breaks it. Each mutation of the table is made in a
copy of conformance/oracle, which then decodes the vectors, those that cite the requirement first, up to the first failure.
Writes requirements.csv: the requirements of the text with the vectors that noticed, in the order of the mutations.

--cited tries only the vectors that cite the requirement, which takes minutes instead of an hour.
--check writes nothing. It demands that the table fits the oracle and the text, that requirements.csv fits the table, and
that the vectors named there still notice; of these it tries every N-th mutation with --part N.
"""

import argparse
import csv
import glob
import json
import multiprocessing
import os
import sys

from . import MUTATIONS, NOT_MUTABLE
from .apply import CONFORMANCE, fault_of, first_failure

sys.path.insert(0, CONFORMANCE)
from generator.text import clause_of_requirements  # noqa: E402  (needs the path)

TABLE = os.path.join(CONFORMANCE, "coverage", "requirements.csv")
COLUMNS = ("requirement", "clause", "vectors", "mutations", "noticed", "noticed_by", "reason")
SURVIVED = "-"


class Suite:
    """The vectors: folders by size, and the requirements that they cite."""

    def __init__(self):
        self.folders, self.cited = [], {}
        rows = []
        for path in glob.glob(os.path.join(CONFORMANCE, "vectors", "*", "*", "*", "vector.json")):
            with open(path, encoding="utf-8") as f:
                record = json.load(f)
            folder = os.path.dirname(path)
            rows.append((len(record.get("points", "")) * record["bytes"], folder))
            for requirement in record["requirements"]:
                self.cited.setdefault(requirement, set()).add(folder)
        self.folders = [folder for _, folder in sorted(rows)]
        self.by_name = {os.path.basename(folder): folder for folder in self.folders}

    def in_order(self, requirement, only_cited):
        """Folders, those that cite a requirement first or alone, small ones first."""
        cited = self.cited.get(requirement, set())
        if only_cited:
            return [folder for folder in self.folders if folder in cited]
        return sorted(self.folders, key=lambda folder: folder not in cited)


def results(jobs, processes):
    """The results of first_failure, one process for each job."""
    with multiprocessing.Pool(processes, maxtasksperchild=1) as pool:
        return dict(pool.imap_unordered(first_failure, jobs, chunksize=1))


def table_problems(clauses):
    """What the table of mutations lacks."""
    known = {row[0] for row in MUTATIONS} | set(NOT_MUTABLE)
    problems = list(filter(None, map(fault_of, MUTATIONS)))
    problems += ["%s: no mutation, and no reason why not" % requirement for requirement in sorted(set(clauses) - known)]
    return problems + ["%s: not in the text" % requirement for requirement in sorted(known - set(clauses))]


def rows_of(clauses, suite, noticed):
    """requirements.csv; `noticed` has the vector by the number of the mutation."""
    for requirement, clause in sorted(clauses.items()):
        names = [noticed[number] or SURVIVED for number, row in enumerate(MUTATIONS) if row[0] == requirement]
        yield dict(zip(COLUMNS, (requirement, clause, str(len(suite.cited.get(requirement, ()))), str(len(names)),
                                 str(sum(name != SURVIVED for name in names)), " ".join(names),
                                 NOT_MUTABLE.get(requirement, ""))))


def read_rows():
    with open(TABLE, encoding="utf-8", newline="") as f:
        return list(csv.DictReader(f))


def write_rows(rows):
    with open(TABLE, "w", encoding="utf-8", newline="") as f:
        out = csv.DictWriter(f, COLUMNS, lineterminator="\n")
        out.writeheader()
        out.writerows(rows)


def recorded():
    """number of a mutation -> name of the vector that noticed it, from requirements.csv"""
    names = {row["requirement"]: iter(row["noticed_by"].split()) for row in read_rows()}
    return {number: next(names.get(row[0], iter(())), None) for number, row in enumerate(MUTATIONS)}


def measure(clauses, suite, options):
    """Makes the mutations; gives what is wrong."""
    asked = [number for number, row in enumerate(MUTATIONS)
             if not options.requirement or row[0] in options.requirement]
    noticed = recorded() if options.requirement and os.path.exists(TABLE) else {}
    jobs = [(-1, None, suite.folders)] if not (options.requirement or options.cited) else []
    jobs += [(number, MUTATIONS[number], suite.in_order(MUTATIONS[number][0], options.cited)) for number in asked]
    found = results(jobs, options.jobs)
    if found.pop(-1, None):
        return ["the oracle fails vectors without a mutation: run oracle/run_vectors.py"]
    noticed.update(found)
    rows = list(rows_of(clauses, suite, {number: None if noticed.get(number) == SURVIVED else noticed.get(number)
                                         for number in range(len(MUTATIONS))}))
    write_rows(rows)
    for number in asked:
        if found[number] is None:
            print("survived: %s: %s: %r" % MUTATIONS[number][:3])
    return []


def check(clauses, suite, options):
    """Whether requirements.csv is true of the table, the text and the vectors."""
    if not os.path.exists(TABLE):
        return ["requirements.csv is missing: run python3 -m mutations"]
    names = recorded()
    kept = {number: None if name in (None, SURVIVED) else name for number, name in names.items()}
    problems = ["%s: requirements.csv is out of date" % new["requirement"]
                for new, old in zip(rows_of(clauses, suite, kept), read_rows()) if new != old]
    if len(read_rows()) != len(clauses) or None in names.values():
        problems.append("requirements.csv does not fit the table: run python3 -m mutations")
    tried = [number for number, name in sorted(kept.items()) if name][::options.part]
    problems += ["%s: there is no vector %s" % (MUTATIONS[number][0], kept[number])
                 for number in tried if kept[number] not in suite.by_name]
    jobs = [(number, MUTATIONS[number], [suite.by_name[kept[number]]])
            for number in tried if kept[number] in suite.by_name]
    for number, name in sorted(results(jobs, options.jobs).items()):
        if name is None:
            problems.append("%s: %s no longer notices %r" % (MUTATIONS[number][0], kept[number], MUTATIONS[number][2]))
    return problems


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("requirement", nargs="*", help="only its mutations")
    parser.add_argument("--check", action="store_true", help="write nothing, compare")
    parser.add_argument("--cited", action="store_true", help="try only vectors that cite the requirement")
    parser.add_argument("--part", type=int, default=1, metavar="N", help="with --check: try every N-th mutation")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    options = parser.parse_args()
    clauses, suite = clause_of_requirements(), Suite()
    problems = table_problems(clauses)
    if not problems:
        problems = (check if options.check else measure)(clauses, suite, options)
    rows = read_rows() if os.path.exists(TABLE) else []
    mutable = [row for row in rows if row.get("mutations", "0") != "0"]
    problems += ["%s: no vector cites it" % requirement
                 for requirement in sorted(set(clauses) - set(suite.cited) - set(NOT_MUTABLE))]
    print("\n".join(problems + ["%d requirements: the vectors notice when one of %d of %d is broken, and %d of %d "
                                "mutations; %d problems" % (
                                    len(clauses), sum(row["noticed"] != "0" for row in mutable), len(mutable),
                                    sum(int(row["noticed"]) for row in mutable),
                                    sum(int(row["mutations"]) for row in mutable), len(problems))]))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
