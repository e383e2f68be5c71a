"""Asks a vulnerability service for known faults of the pinned versions, with pip-audit.

    python tools/audit.py constraints.txt

pip-audit reports "no known vulnerabilities" also where its service knows none of the packages, as
behind an index without such data. So this counts what the service has judged.

Exit codes: 0 all versions were judged and have no known fault; 1 some have; 2 some or all were not
judged.
"""

import json
import subprocess
import sys
from collections.abc import Mapping, Sequence
from typing import Any

COMMAND = ("--no-deps", "--disable-pip", "--progress-spinner", "off", "--format", "json")


def verdict(packages: Sequence[Mapping[str, Any]]) -> tuple[int, list[str]]:
    """Exit code and lines of the report of pip-audit.

    Args:
        packages: Entries of `dependencies` in its JSON: `name` with `version` and `vulns`, or with
            `skip_reason`.
    """
    skipped = [each["name"] for each in packages if "skip_reason" in each]
    faults = [(each, fault) for each in packages for fault in each.get("vulns", ())]
    lines = [
        f"{each['name']} {each['version']}: {fault['id']}, mended in "
        f"{', '.join(fault['fix_versions']) or 'no version'}"
        for each, fault in faults
    ]
    judged = len(packages) - len(skipped)
    lines.append(f"{judged} of {len(packages)} pinned versions were judged, {len(faults)} faults")
    if skipped:
        named = "all of them" if not judged else ", ".join(skipped)
        lines.append(f"NOT AUDITED, as the vulnerability service does not know them: {named}")
    return (1 if faults else 2 if skipped or not packages else 0), lines


def main() -> None:
    """Prints what the service says of the pins of a file."""
    (pins,) = sys.argv[1:]
    command = (sys.executable, "-m", "pip_audit", "--requirement", pins, *COMMAND)
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    try:
        packages = json.loads(done.stdout)["dependencies"]
    except (ValueError, KeyError):
        last = done.stderr.strip().splitlines()[-1:] or ["no reason given"]
        print(f"NOT AUDITED, pip-audit reached no vulnerability service: {last[0]}")
        sys.exit(2)
    code, lines = verdict(packages)
    print("\n".join(lines))
    sys.exit(code)


if __name__ == "__main__":
    main()
