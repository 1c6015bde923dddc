"""What the generator reads in the text: the requirements and the clause in which each stands."""

import glob
import os
import re

HERE = os.path.dirname(os.path.abspath(__file__))
CONFORMANCE = os.path.dirname(HERE)
SPEC = os.path.join(os.path.dirname(CONFORMANCE), "spec")
HEADING = re.compile(r"^#+ (?:Annex )?([A-Z0-9]+(?:\.\d+)*) ")
REQUIREMENT = re.compile(r"\*\*\[(SS-[A-Z]+-\d+)\]\*\*")


def clause_of_requirements():
    """Requirement -> number of the clause that has it."""
    result = {}
    for path in sorted(glob.glob(os.path.join(SPEC, "[0-9ab]*.md"))):
        clause = None
        with open(path, encoding="utf-8") as f:
            lines = f.readlines()
        for line in lines:
            heading = HEADING.match(line)
            clause = heading.group(1) if heading else clause
            for requirement in REQUIREMENT.findall(line):
                result[requirement] = clause
    return result
