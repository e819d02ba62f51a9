#!/usr/bin/env python3
"""Adds up a JUnit file, as ctest and pytest write it: "<passed> <failed>", then each failure with its last words.

Usage: junit.py FILE

In CI a skipped test is a failure: the data it wants are there.
"""

import os
import sys
import xml.etree.ElementTree as xml

FAILED = ("failure", "error")
LAST_WORDS = 12  # lines shown of what a failed test printed


def last_words(case: xml.Element) -> list[str]:
    """Of what the test printed (ctest), or of the message of its failure (pytest)."""
    parts = [case.find("system-out"), *(case.find(tag) for tag in FAILED)]
    lines = [line for part in parts if part is not None for line in (part.text or "").splitlines() if line.strip()]
    return [f"    {line}" for line in lines[-LAST_WORDS:]]


def case_name(case: xml.Element) -> str:
    return f"{case.get('classname', '')} {case.get('name', '')}"


def main() -> None:
    skips_fail = bool(os.environ.get("CI"))
    cases = list(xml.parse(sys.argv[1]).getroot().iter("testcase"))
    bad = [case for case in cases if any(case.find(tag) is not None for tag in FAILED)]
    skipped = [case for case in cases if case.find("skipped") is not None]
    failed = bad + (skipped if skips_fail else [])
    # A test whose fixture failed has two cases or two failures; a filter that finds no test is no success.
    print(len(cases) - len(bad) - len(skipped), len(failed) + (not cases))
    for case in failed:
        print(case_name(case), *last_words(case), sep="\n")
    if not cases:
        print("no test ran")


if __name__ == "__main__":
    main()
